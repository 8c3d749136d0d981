"""A candidate made again from the tracking store, with nothing else of the run left."""

import hashlib
import io
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import aesi
from aesi.errors import InputError
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.product.hybrid import HybridModel
from flows.base import codec
from flows.tracking.store import KIND, Store

PERIOD_S = 300
NMC = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"


def repeated_drive(folder):
    """An experiment on five repeats of a drive with worse contacts than the cell file has, physics recalibrated."""
    cell = aesi.Cell.from_bpx(NMC)
    rng = np.random.default_rng(0)
    current = np.tile(np.repeat(rng.normal(12.0, 30.0, PERIOD_S // 20), 20).clip(-60.0, 90.0), 5)
    current[:60] = 0.0
    time = np.arange(len(current), dtype=float)
    run = aesi.simulate(
        cell, time, current, 0.8, [CATALOGUE["series_resistance"].activate(resistance_ohm=1.5e-3)]
    )
    voltage = run.voltage_v + 1e-3 * rng.standard_normal(len(time))
    aesi.Measurement(time, current, voltage).to_frame().to_csv(folder / "drive.csv", index=False)
    repeats = {"period_s": PERIOD_S, "train": [1, 3, 5], "test": [2, 4]}
    content = {
        "name": "repeats",
        "data": {"kind": "files", "record": "drive.csv", "repeats": repeats},
        "cell": {"bpx": str(NMC), "soc0": 0.8, "start": "recalibrated"},
        "search": {"candidates": 3, "population": 3, "resamples": 10, "block": 60},
        "conformal": {"window": 20, "compare": []},
        "models": ["ESPM", "AESI I", "AESI II"],
        "tracking": {"log_model": False, "system_metrics": False},
    }
    path = folder / "repeats.yaml"
    path.write_text(json.dumps(content))  # which is YAML
    return path


@pytest.fixture
def store_alone(finished, tmp_path, monkeypatch):
    """The store and its artifacts in another folder; caches, run folders and the data are not with them."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for path in finished.glob("mlflow.db*"):
        shutil.copy(path, elsewhere)
    shutil.copytree(finished / "mlartifacts", elsewhere / "mlartifacts")
    monkeypatch.setenv("AESI_CACHE", str(tmp_path / "empty"))
    monkeypatch.delenv("AESI_DATA", raising=False)
    return f"sqlite:///{elsewhere / 'mlflow.db'}"


def runs_of(uri, kind):
    store = Store(uri)
    return list(store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = '{kind}'"))


def test_a_candidate_could_not_be_made_again_from_what_was_tracked(store_alone, tmp_path, call):
    run = next(run for run in runs_of(store_alone, "candidate") if "aesi.failed" not in run.data.tags)
    code, _, err = call("candidate", run.info.run_id, "--out", tmp_path / "back", "--uri", store_alone)
    assert code == 0, err
    assert re.search(
        r"terms, \d+\.\d % less squared error on validation in free run, \d+\.\d % \w+ than recalibrated", err
    )
    content = json.loads((tmp_path / "back" / "candidate.json").read_text())
    assert content["metrics"]["free_run/valid_mser_pct"] == run.data.metrics["free_run/valid_mser_pct"]
    assert content["metrics"]["loss/oob"] == run.data.metrics["loss/oob"]
    logged = json.loads(Store(store_alone).read(run, "coefficients.json").read_text())
    assert content["coefficients"] == logged
    model = HybridModel.load(tmp_path / "back" / "model")
    prediction = model.predict(np.arange(60.0), np.full(60, 10.0), soc0=0.6)
    assert np.isfinite(prediction.voltage_v).all()


def test_the_run_of_an_experiment_gives_the_candidate_that_it_chose(store_alone, tmp_path):
    from flows.results.candidate import rebuild, rebuilt_line

    (run,) = runs_of(store_alone, "run")
    for name in (run.info.run_id, run.info.run_id[:8]):  # as pages show it
        rebuilt = rebuild(name, store_alone)
        assert rebuilt.number == int(run.data.params["chosen_candidate"])
        assert rebuilt.members == (rebuilt.number,)
    assert "one of several" not in rebuilt_line(rebuilt, tmp_path)
    one_of_two = replace(rebuilt, members=(rebuilt.number, 99))
    assert f"the mean of candidates {rebuilt.number} and 99" in rebuilt_line(one_of_two, tmp_path)


def test_another_run_is_refused_in_one_sentence(store_alone):
    from flows.results.candidate import rebuild

    model = runs_of(store_alone, "model")[0]
    with pytest.raises(InputError, match="is no candidate of a search"):
        rebuild(model.info.run_id, store_alone)
    with pytest.raises(InputError, match="no run 'abc' is tracked"):
        rebuild("abc", store_alone)


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("experiment.json", lambda text: text.replace(b'"search"', b'"quest"', 1), "unknown key"),
        ("inputs/records.bin", lambda data: data[:-9], "checksum"),
        ("inputs/records.bin", lambda data: renamed(data), "stored by another version"),
        ("inputs/declared/model.json", lambda text: text.replace(b"aesi.", b"old.", 1), "schema 'old."),
    ],
)
def test_a_run_of_an_earlier_version_was_an_unexpected_error(store_alone, name, change, words):
    from flows.results.candidate import rebuild

    (run,) = runs_of(store_alone, "run")
    file = Store(store_alone).read(run, name)
    file.write_bytes(change(file.read_bytes()))
    with pytest.raises(InputError, match="was made by an earlier version") as told:
        rebuild(run.info.run_id, store_alone)
    assert words in str(told.value)


def test_a_run_whose_files_are_away_was_said_to_be_of_an_earlier_version(store_alone, tmp_path):
    from flows.results.candidate import rebuild

    (run,) = runs_of(store_alone, "run")
    shutil.rmtree(tmp_path / "elsewhere" / "mlartifacts")
    with pytest.raises(InputError, match=r"^run \w+ cannot be read: its files are in .*, which is not here"):
        rebuild(run.info.run_id, store_alone)


def renamed(data):
    """Stored records with a field that the class of this version does not have."""
    head = len(codec.MAGIC) + hashlib.sha256().digest_size
    with np.load(io.BytesIO(data[head:])) as archive:
        arrays = {key: archive[key] for key in archive.files}
    tree = arrays[codec.TREE].tobytes().replace(b'"fields": {"', b'"fields": {"once_', 1)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays | {codec.TREE: np.frombuffer(tree, dtype=np.uint8)})
    body = buffer.getvalue()
    return codec.MAGIC + hashlib.sha256(body).digest() + body


def test_coverage_is_tracked_for_both_ensembles(store_alone):
    metrics = [
        run.data.metrics for run in runs_of(store_alone, "candidate") if "aesi.failed" not in run.data.tags
    ]
    assert metrics
    for one in metrics:
        assert 50 < one["intervals/valid_coverage_pct"] <= 100
        assert 50 < one["intervals/valid_coverage_pct_aesi_ii"] <= 100
        assert one["loss/valid"] == pytest.approx((one["loss/valid_aesi_i"] + one["loss/valid_aesi_ii"]) / 2)


def test_a_candidate_on_recalibrated_physics_came_back_with_other_figures(tracked, tmp_path):
    from flows.jobs.start import start
    from flows.results.candidate import rebuild, save

    folder = start(repeated_drive(tmp_path), use_prefect=False)
    rebuilt = rebuild(folder.name)
    assert rebuilt.tracked["loss/valid"] == rebuilt.metrics["loss/valid"]
    assert rebuilt.differing == {}
    save(rebuilt, tmp_path / "back")
    time, current = np.arange(120.0), np.full(120, 5.0)
    ran, again = (
        HybridModel.load(each / "model").predict(time, current, soc0=0.7)
        for each in (folder, tmp_path / "back")
    )
    np.testing.assert_array_equal(again.voltage_v, ran.voltage_v)
    np.testing.assert_array_equal(again.upper_v, ran.upper_v)


def test_a_run_whose_chosen_candidate_is_gone_ended_in_a_traceback(store_alone, tmp_path, call):
    (run,) = runs_of(store_alone, "run")
    store, number = Store(store_alone), run.data.params["chosen_candidate"]
    gone = store.child(run.info.experiment_id, run.info.run_id, f"candidate:{number}")
    store.client.delete_run(gone.info.run_id)
    code, _, err = call("candidate", run.info.run_id, "--out", tmp_path / "back", "--uri", store_alone)
    assert code == 2
    assert f"chose candidate {number}, which is not in" in err
