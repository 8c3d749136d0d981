"""What is tracked of a run as it starts: its settings, and no password."""

import json
from pathlib import Path

import pytest

from aesi.numerics.files.source_digest import source_digest
from aesi.physics import Cell
from aesi.pipeline.experiment.config import parse_experiment
from aesi.pipeline.experiment.load import Loaded
from aesi.records import LeftOutDrives, Split
from flows.tracking.experiment_log import track_start

NMC = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"


class Kept:
    """A tracker that keeps what it is given."""

    def __init__(self):
        self.told = []

    def __getattr__(self, name):
        return lambda *given: self.told.append((name, *given))

    def of(self, name):
        return next(given for what, *given in self.told if what == name)


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
    track_start(tracker, loaded, tmp_path)
    return tracker


def test_the_password_of_a_database_was_tracked_as_a_parameter(kept):
    assert "secret" not in json.dumps([list(map(str, given)) for given in kept.told])
    parameters, _ = kept.of("parameters")
    assert parameters["runner.storage"] == "postgresql://db.example.org/aesi"
    assert parameters["tracking.uri"] == "https://tracking.example.org"
    assert not {"name", "note", "base", "fallback", "discover"} & set(parameters)


def test_the_program_that_ran_is_tracked(kept):
    _, tags = kept.of("parameters")
    assert tags["aesi.code"] == source_digest()


def test_the_experiment_is_kept_whole(kept):
    name, content = kept.of("json")
    assert name == "experiment.json"
    assert parse_experiment(content).name == "small"
