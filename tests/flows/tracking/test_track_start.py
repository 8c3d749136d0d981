"""What is tracked of a run as it starts: its settings, and no password."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from aesi.numerics.files.source_digest import source_digest
from aesi.physics import Cell
from aesi.pipeline.experiment.config import parse_experiment
from aesi.pipeline.experiment.load import Loaded
from aesi.records import LeftOutDrives, Split
from flows.jobs.experiment_stages import ExperimentJob
from flows.tracking.experiment_log import track_settings, track_start

NMC = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"


class Kept:
    """A tracker that keeps what it is given."""

    def __init__(self):
        self.told = []

    def __getattr__(self, name):
        return lambda *given: self.told.append((name, *given))

    def of(self, name):
        return next(given for what, *given in self.told if what == name)

    @property
    def settings(self):
        return {
            name: value
            for what, *given in self.told
            if what == "parameters"
            for name, value in given[0].items()
        }


@pytest.fixture
def kept(tmp_path):
    content = {
        "name": "small",
        "data": {"kind": "virtual"},
        "tracking": {"uri": "https://me:secret@tracking.example.org"},
        "runner": {"storage": "postgresql://me:secret@db.example.org/aesi"},
    }
    config = parse_experiment(content)
    loaded = Loaded(Cell.from_bpx(NMC), "nmc", (), Split((), (), ()), LeftOutDrives(), {}, {}, (), config)
    tracker = Kept()
    track_settings(tracker, config)
    track_start(tracker, loaded, tmp_path)
    return tracker


def test_the_password_of_a_database_was_tracked_as_a_parameter(kept):
    assert "secret" not in json.dumps([list(map(str, given)) for given in kept.told])
    settings = kept.settings
    assert settings["runner.storage"] == "postgresql://db.example.org/aesi"
    assert settings["tracking.uri"] == "https://tracking.example.org"
    assert not {"name", "note", "base", "fallback", "discover"} & set(settings)


def test_the_program_that_ran_is_tracked(kept):
    _, tags = kept.of("parameters")
    assert tags["aesi.code"] == source_digest()


FALLBACK = {"data": {"kind": "virtual"}, "cell": {"bpx": str(NMC)}}
REPEATS = {"period_s": 1800, "train": [1, 3, 5], "test": [2, 4]}


@pytest.mark.parametrize("fallback", [None, FALLBACK])
def test_the_parameters_of_a_run_stayed_empty_until_its_data_were_there(fallback):
    measured = {"kind": "catalogue", "set": "about_energy_nmc", "record": "drive_cycle", "repeats": REPEATS}
    config = parse_experiment({"name": "small", "seed": 3, "data": measured, "fallback": fallback})
    tracker = Kept()
    track_settings(tracker, config)
    assert tracker.settings["seed"] == 3
    assert tracker.settings["search.candidates"] == config.search.candidates
    assert "numpy" in tracker.settings["versions"]
    # MLflow changes no parameter, and a fallback is of other data.
    assert tracker.settings.get("data.kind") == (None if fallback else "catalogue")


def test_a_run_that_ended_while_its_data_were_read_did_not_say_what_it_was():
    class Killed(Exception):
        pass

    def run(stage, work, **how):
        assert stage == "data and physics"
        raise Killed

    request = SimpleNamespace(
        config=parse_experiment({"name": "small", "seed": 3, "data": {"kind": "virtual"}})
    )
    tracker = Kept()
    with pytest.raises(Killed):
        ExperimentJob(request, tracker, False, run, SimpleNamespace(begins=None), 0.0).results()
    assert tracker.settings["seed"] == 3


def test_the_experiment_is_kept_whole(kept):
    name, content = kept.of("json")
    assert name == "experiment.json"
    assert parse_experiment(content).name == "small"
