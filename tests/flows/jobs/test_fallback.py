"""A run whose data cannot be had runs on the virtual cell, and says so everywhere."""

import json

import pytest
import yaml

from aesi.errors import DataAway, DataError, FitError
from aesi.pipeline.product.hybrid import HybridModel
from flows.results.tables import tables_of
from flows.tracking.store import KIND, Store

SMALL = {
    "library": {"p_c": [0, 1], "d": [1, 2]},
    "search": {"candidates": 4, "population": 2, "resamples": 5, "pearson_train": 0.0, "pearson_valid": 0.0},
    "conformal": {"window": 50, "compare": []},
    "models": ["ESPM", "AESI I"],
    "tracking": {"log_model": False, "system_metrics": False},
}


@pytest.fixture
def experiment(tracked, monkeypatch, cell):
    """An experiment on a measured cell that is not here, held backward, with a virtual cell to fall back to."""

    def away(name, file):
        raise DataAway(
            f"{file} cannot be fetched from https://example.org (ConnectionError): connect, or set it."
        )

    monkeypatch.setattr("aesi.data.catalogue.locate", away)
    virtual = {"kind": "virtual", "dt_s": 2.0, "hold": "linear", "virtual": {"model": "SPMe"}}
    measured = {
        "kind": "catalogue",
        "set": "about_energy_nmc",
        "record": "drive_cycle",
        "repeats": {"period_s": 1800, "train": [1, 3, 5], "test": [2, 4]},
    }
    content = {
        "name": "small",
        "note": "Hybrid model of a measured 12.5 Ah NMC pouch cell",
        "data": measured,
        "fallback": {"data": virtual, "cell": {"bpx": str(cell)}},
    }
    path = tracked / "small.yaml"
    path.write_text(yaml.safe_dump(content | SMALL))
    return path


def test_a_run_that_fell_back_was_tracked_as_the_measured_one(experiment, capsys):
    from flows.jobs.start import start

    folder = start(experiment, use_prefect=False)
    said = capsys.readouterr().err
    summary = json.loads((folder / "summary.json").read_text())
    (note,) = [note for note in summary["notes"] if "cannot be had" in note]
    assert "about_energy_nmc cannot be had (no copy on this machine and no network)" in note
    assert "a virtual cell (SPMe of nmc_30ah.bpx.json with ocv_hysteresis, series_resistance)" in note
    assert said.count("cannot be had") == 1
    assert "ConnectionError" not in said
    assert summary["data"] == "virtual"
    report = (folder / "report.html").read_text()
    assert '<p class="banner"' in report
    assert "of a measured" not in report
    assert HybridModel.load(folder / "model").hold == "linear"
    store = Store()
    (run,) = store.runs(store.find_experiment("small"), f"tags.`{KIND}` = 'run'")
    assert run.data.params["data.kind"] == "virtual"
    assert run.data.tags["aesi.fallback"] == note
    assert "of a measured" not in run.data.tags["mlflow.note.content"]
    assert "cannot be had" in tables_of("small")
    assert "of a measured" not in tables_of("small")


def test_the_setting_of_a_fallback_and_of_another_measurement_are_others(experiment, tmp_path):
    from dataclasses import replace

    from aesi.pipeline.experiment.config import read_experiment
    from aesi.pipeline.experiment.load import load

    config = read_experiment(experiment)
    loaded = load(config)
    assert loaded.config.data.kind == "virtual"
    names = list(loaded.digests)
    other = replace(loaded, digests={**loaded.digests, names[0]: "0123"})
    assert len({loaded.setting, other.setting, config.setting}) == 3
    again = load(read_experiment(experiment, ["seed=7"]))
    assert again.setting == loaded.setting


def test_what_is_wrong_with_data_that_are_there_was_told_as_data_that_cannot_be_had(
    experiment, tmp_path, monkeypatch
):
    from aesi.pipeline.experiment.config import read_experiment
    from aesi.pipeline.experiment.load import load

    record = tmp_path / "drive_cycle.csv"
    record.write_text("time_s,current_a\n0,1\n1,1\n2,1\n")
    monkeypatch.setattr("aesi.data.catalogue.locate", lambda name, file: record)
    with pytest.raises(DataError, match=r"drive_cycle\.csv.*voltage_v"):
        load(read_experiment(experiment, [f"cell.bpx={read_experiment(experiment).fallback.cell.bpx}"]))


@pytest.mark.parametrize("edited", ["cell.bpx.json", "own.py", "fallback.bpx.json", "own_of_fallback.py"])
def test_a_run_was_gone_on_with_over_an_edited_fallback(experiment, tmp_path, edited):
    from aesi.pipeline.experiment.config import read_experiment
    from flows.jobs.run_session import resume_key

    names = {
        "cell": ("cell.bpx.json", "own.py"),
        "fallback.cell": ("fallback.bpx.json", "own_of_fallback.py"),
    }
    overrides = [f"{key}={{bpx: {bpx}, effect_files: [{own}]}}" for key, (bpx, own) in names.items()]
    for name in sum(names.values(), ()):
        (tmp_path / name).write_text("as it was")
    config = read_experiment(experiment, overrides)
    before = resume_key(config)
    assert resume_key(config) == before
    (tmp_path / edited).write_text("edited")
    assert resume_key(config) != before


def test_a_run_was_gone_on_with_over_an_edited_effect_of_the_saved_model_that_it_corrects(
    experiment, tmp_path
):
    from aesi.pipeline.experiment.config import read_experiment
    from flows.jobs.run_session import resume_key

    model, own = tmp_path / "found", tmp_path / "own.py"
    model.mkdir()
    own.write_text("as it was")
    (model / "effects.json").write_text(json.dumps([{"effect": "own", "file": str(own), "parameters": {}}]))
    config = read_experiment(experiment, [f"cell={model}"])
    before = resume_key(config)
    assert resume_key(config) == before
    own.write_text("edited")
    assert resume_key(config) != before


def test_a_run_that_fell_back_was_gone_on_with_on_other_data(experiment, call, monkeypatch):
    from dataclasses import replace

    from flows.jobs import experiment_stages as module

    load = module.load

    def fails(problem, config):
        raise FitError("no more.")

    with monkeypatch.context() as first:
        first.setattr(module, "build_problem", fails)
        assert call("run", experiment, "--no-prefect")[0] == 1

    def others(config, sources, begins):
        loaded = load(config, sources, begins)
        return replace(loaded, digests=dict.fromkeys(loaded.digests, "0123"))

    monkeypatch.setattr(module, "load", others)  # the key of what is on disk is the same
    code, _, err = call("run", experiment, "--no-prefect", "--resume")
    assert code == 1
    assert "was begun with records or a cell file that are others now" in err.splitlines()[-1]
    store = Store()
    (run,) = store.runs(store.find_experiment("small"), f"tags.`{KIND}` = 'run'")
    assert run.info.status == "FAILED"
