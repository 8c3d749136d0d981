"""A run written in one transaction is the run that MLflow's client writes."""

import sqlite3

import pytest

from flows.tracking import delivery
from flows.tracking.store import KIND, NUMBER

TABLES = ("runs", "tags", "params", "metrics", "latest_metrics")
OWN = ("run_uuid", "artifact_uri")


@pytest.fixture
def item(store):
    experiment = store.experiment("cells")
    return {
        "kind": "run",
        "experiment_id": experiment,
        "parent": store.create_run(experiment, "a run", {KIND: "run"}),
        "label": "candidate:1",
        "name": "candidate 001",
        "tags": {KIND: "candidate", "aesi.failed": "diverged"},
        "params": {"lambda1": "0.001"},
        "metrics": {"fitness": 0.5, "loss/oob": -1e-9},
        "files": {"coefficients.json": "{}"},
        "status": "FAILED",
        "start_ms": 1_000,
        "end_ms": 2_000,
    }


def rows_of(database, run_id):
    """Every row about the run in MLflow's database, without its id and address."""
    connection = sqlite3.connect(database)
    connection.row_factory = sqlite3.Row
    found = {
        table: sorted(
            str({k: row[k] for k in row.keys() if k not in OWN})  # noqa: SIM118 (a sqlite3.Row is no mapping)
            for row in connection.execute(f"SELECT * FROM {table} WHERE run_uuid = ?", (run_id,))
        )
        for table in TABLES
    }
    connection.close()
    return found


def test_its_rows_are_those_of_the_client(store, item, tracked, monkeypatch):
    delivery.deliver(store, item, again=False)
    monkeypatch.setattr(store, "local", False)
    delivery.deliver(store, item | {"label": "candidate:2"}, again=False)
    ours, theirs = (
        store.children(item["experiment_id"], item["parent"])[f"candidate:{n}"].info for n in (1, 2)
    )
    a, b = (rows_of(tracked / "mlflow.db", info.run_id) for info in (ours, theirs))
    a["tags"] = [row for row in a["tags"] if NUMBER not in row]
    b["tags"] = [row for row in b["tags"] if NUMBER not in row]
    assert a == b
    assert ours.artifact_uri.replace(ours.run_id, "") == theirs.artifact_uri.replace(theirs.run_id, "")


def test_a_table_that_refuses_leaves_nothing_of_the_run(store, item):
    item["metrics"] = {"fitness": None}  # NOT NULL in MLflow's table
    with pytest.raises(Exception, match="NOT NULL"):
        delivery.deliver(store, item, again=False)
    assert store.children(item["experiment_id"], item["parent"]) == {}


def test_what_is_read_is_what_the_client_reads(store, item):
    experiment = item["experiment_id"]
    first, last = item["parent"], store.create_run(experiment, "another", {KIND: "run"})
    store.client.log_metric(last, "fitness", 0.25, step=1)
    store.client.log_metric(last, "fitness", float("nan"), step=2)
    store.client.log_param(last, "seed", "1")
    gone = store.create_run(experiment, "deleted", {KIND: "run"})
    store.client.delete_run(gone)
    delivery.deliver(store, item, again=False)  # nested: no job
    ours = store.jobs(experiment)
    theirs = list(store.runs(experiment, f"tags.`{KIND}` = 'run'"))
    assert {run.info.run_id for run in ours} == {first, last}
    for run, other in zip(ours, theirs, strict=True):
        assert dict(run.info) == dict(other.info)
        assert (run.data.params, run.data.tags) == (other.data.params, other.data.tags)
        assert str(run.data.metrics) == str(other.data.metrics)  # NaN is not equal to itself
