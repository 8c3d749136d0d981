"""The discovery as a flow: files written, every hypothesis tracked, with and without Prefect."""

import json
from pathlib import Path

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.discovery import discover as pipeline
from aesi.pipeline.discovery.discover import Case
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.written import FINDING
from aesi.records import Measurement

CELL = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"


@pytest.fixture
def case(monkeypatch):
    """A small record with an ohmic drop that the cell file does not declare, and two effects to choose from."""
    few = {name: CATALOGUE[name] for name in ("series_resistance", "voltage_sensor_offset")}
    monkeypatch.setattr(pipeline, "CATALOGUE", few)
    rng = np.random.default_rng(3)
    time = np.arange(1800.0)
    current = np.repeat(rng.normal(0.3, 0.7, 90), 20) * 45.0
    current[:60] = 0.0
    effect = CATALOGUE["series_resistance"].activate(resistance_ohm=2e-4)
    voltage = simulate(Cell.from_bpx(CELL), time, current, 0.9, (effect,)).voltage_v
    data = Measurement(
        time, current, voltage + 1e-3 * rng.normal(size=1800), name="drive", notes=("drive: thinned.",)
    )
    return Case(CELL, (data,), soc0=0.9)


class Said:
    """A console that keeps what is said."""

    def __init__(self, lines):
        self.say = lines.append


def test_a_search_that_was_stopped_was_said_to_have_a_finding(tmp_path):
    from flows.jobs.discovery import _earlier_sentence

    replaced = "its finding is replaced when this search ends"
    assert replaced not in _earlier_sentence(tmp_path)
    (tmp_path / FINDING).write_text("{}")
    assert replaced in _earlier_sentence(tmp_path)


def test_everything_is_written_and_tracked(tracked, case):
    from flows.jobs.start import discover
    from flows.tracking.store import Store

    out = tracked / "out"
    content = discover(case, out, use_prefect=False)
    assert content == json.loads((out / "discovery.json").read_text())
    assert content["schema"] == "aesi.discovery/1"
    assert content["effects"] == ["series_resistance"]
    assert content["after"]["test"]["rmse_mv"] < content["before"]["test"]["rmse_mv"]
    assert content["notes"][:2] == [
        "drive: no temperature column; taken at 25 degC, as the cell's file declares; for another one give its "
        "temperature_degc.",
        "drive: thinned.",
    ]
    report = (out / "report.html").read_text()
    assert "series_resistance" in report
    assert "<li>drive: thinned.</li>" in report
    model = HybridModel.load(out / "model")
    data = case.measurements[0]
    voltage = model.predict(data.time_s, data.current_a, soc0=model.soc0).voltage_v
    assert np.sqrt(np.mean((voltage - data.voltage_v) ** 2)) < 1.1e-3
    store = Store()
    runs = list(store.runs(store.find_experiment("discover"), ""))
    names = [run.info.run_name for run in runs]
    assert {"drive", "series_resistance, tight", "series_resistance, tight, fit 2", "nothing, tight"} <= {
        *names
    }
    assert len(names) == len({*names}), "fits of one hypothesis looked like one that was tracked twice"


def test_searches_of_other_cells_records_or_options_are_told_apart_by_what_is_tracked(case, tmp_path):
    from dataclasses import replace

    from flows.jobs.discovery import _asked

    content = json.loads(CELL.read_text())
    content["Parameterisation"]["Negative electrode"]["Diffusivity [m2.s-1]"] = 1e-14
    (tmp_path / "other.json").write_text(json.dumps(content))
    data = case.measurements[0]
    others = {
        "cell_digest": replace(case, cell=tmp_path / "other.json"),
        "hold_asked": replace(case, measurements=(replace(data, hold="backward"),)),
        "data_digest": replace(case, measurements=(replace(data, current_a=1.01 * data.current_a),)),
        "test_digest": replace(case, tests=(data,)),
        "model_asked": replace(case, model="espm"),
        "soc0": replace(case, soc0=0.91),
    }
    asked = _asked(case)
    for name, other in others.items():
        assert _asked(other).get(name) != asked.get(name), name
    assert asked == _asked(replace(case))


def test_a_search_that_was_killed_is_told_from_others_and_closed_by_the_next(tracked, case, monkeypatch):
    from flows.jobs import discovery
    from flows.jobs.start import discover
    from flows.tracking.run_records import records
    from flows.tracking.store import Store

    def killed(*_):
        (record,) = records("discover")
        left.append(record)  # what a process leaves that is ended at once
        raise KeyboardInterrupt

    left = []
    with monkeypatch.context() as patched:
        patched.setattr(pipeline, "run_case", killed)
        with pytest.raises(KeyboardInterrupt):
            discover(case, tracked / "out", use_prefect=False)
    store = Store()
    (run_id,) = {record.run_id for record in left}
    run = store.client.get_run(run_id)
    assert (run.info.run_name, run.info.status, run.data.params["data"]) == ("drive", "KILLED", "drive")
    store.client.update_run(run_id, status="RUNNING")
    left[0].write()
    said = []
    with discovery.tracked_job(
        discovery._subject(case, discovery.TrackedUnder()), "next", Said(said)
    ) as tracker:
        assert store.client.get_run(run_id).info.status == "KILLED"
    assert said == [f"run {run_id} had been killed; it is closed as such."]
    assert store.client.get_run(tracker.run_id).info.status == "FINISHED"


def test_a_cell_file_that_is_none_is_refused_before_anything_starts(workspace, case, tmp_path):
    from dataclasses import replace

    from aesi.errors import CellError
    from flows.jobs.start import discover

    path = tmp_path / "cell.json"
    path.write_text("{}")
    with pytest.raises(CellError) as caught:
        discover(replace(case, cell=path), tmp_path / "out", use_prefect=False)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_under_prefect_the_finding_is_the_same(tracked, case):
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.sorting import FlowRunSort, TaskRunSort
    from prefect.testing.utilities import prefect_test_harness

    from flows.jobs.start import discover

    plain = discover(case, tracked / "plain", use_prefect=False)
    with prefect_test_harness(server_startup_timeout=180):
        found = discover(case, tracked / "out", use_prefect=True)
        with get_client(sync_client=True) as client:
            (run,) = client.read_flow_runs(limit=9, sort=FlowRunSort.ID_DESC)
            tasks = client.read_task_runs(limit=9, sort=TaskRunSort.ID_DESC)
    assert run.state.is_completed()
    assert {task.name.rsplit("-", 1)[0] for task in tasks} == {"hypotheses", "report"}
    assert found["effects"] == plain["effects"] == ["series_resistance"]
    assert found["after"] == plain["after"]


EXPERIMENT = f"""
name: told_where
seed: 3
data: {{kind: files, train: [drive.csv], test: [drive.csv]}}
cell: {{bpx: {CELL}}}
discover: {{fit: [drive.csv]}}
"""


@pytest.mark.parametrize("prefect", [False, True])
def test_a_discovery_of_an_experiment_was_not_tracked_where_its_file_says(
    workspace, case, monkeypatch, empty_store, prefect
):
    """Prefect is asked as `flows.jobs.start` asks it: with the file beside the case."""
    import shutil

    from aesi.pipeline.discovery import cases
    from flows.jobs import prefect_flows, start
    from flows.jobs.run_request import RunRequest
    from flows.jobs.stages import PlainStages
    from flows.tracking.store import Store

    shutil.copy(empty_store, workspace / "elsewhere.db")
    (workspace / "told.yaml").write_text(EXPERIMENT)
    uri = f"sqlite:///{workspace}/elsewhere.db"
    monkeypatch.setattr(cases, "case_of_experiment", lambda config: case)
    for job in (start, prefect_flows):
        monkeypatch.setattr(job, "run_discovery", _only_tracked)
    if prefect:
        monkeypatch.setattr(start, "_with_or_without", lambda under_prefect, plainly, use: under_prefect())
        monkeypatch.setattr(prefect_flows, "discovery", prefect_flows.discovery.fn)
        monkeypatch.setattr(prefect_flows, "PrefectStages", PlainStages)
    request = RunRequest("told.yaml", (f"tracking.uri={uri}",))
    under = start.discover_experiment(request, use_prefect=prefect)
    assert (under.name, under.tracking.uri) == ("told_where", uri)
    assert Store(uri).find_experiment("told_where") is not None
    assert not (workspace / "mlflow.db").exists()


def test_an_experiment_was_read_again_after_it_was_checked(workspace, case, monkeypatch):
    """Who edits the file meanwhile edits that of the next run."""
    from aesi.pipeline.discovery import cases
    from aesi.pipeline.experiment.config import read_experiment
    from flows import cli
    from flows.jobs import run_request, start

    (workspace / "told.yaml").write_text(EXPERIMENT)
    read, found = [], []

    def counted(path, overrides):
        read.append(path)
        return read_experiment(path, overrides)

    monkeypatch.setattr(run_request, "read_experiment", counted)
    monkeypatch.setattr(cases, "case_of_experiment", lambda config: case)
    monkeypatch.setattr(start, "discover", lambda case, folder, *rest: found.append((case, folder)))
    cli.app(["discover", "told.yaml"], standalone_mode=False)
    assert read == ["told.yaml"]
    assert found == [(case, workspace / "runs" / "told_where" / "discovery")]


def _only_tracked(case, out, run, console, under):
    from flows.jobs import discovery

    with discovery.tracked_job(discovery._subject(case, under), "title", console):
        return under
