"""Nested runs in the store: the short way and MLflow's client leave the same, and neither doubles the other."""

import json
from pathlib import Path

import pytest

from aesi.pipeline.sections import TrackingConfig
from flows import mlflow_delivery, outbox
from flows.mlflow_store import KIND, Store, now_ms
from flows.tracking import Subject, Tracker

QUIET = TrackingConfig(system_metrics=False, log_model=False)
CONTENT = {"bagging": {"T1(I)": 0.25}}


@pytest.fixture
def store(tracked):
    return Store()


@pytest.fixture
def item(store):
    """What a tracker hands over of a candidate; give another label for another run."""
    experiment = store.experiment("cells")
    parent = store.create_run(experiment, "a run", {KIND: "run"})

    def make(label, **changes):
        return {
            "kind": "run",
            "experiment_id": experiment,
            "parent": parent,
            "label": label,
            "name": "candidate 007",
            "tags": {KIND: "candidate"},
            "params": {"lambda1": "0.001", "versions": "python 3, numpy 2"},
            "metrics": {"fitness": 0.5, "loss/oob": 1e-9},
            "files": {"coefficients.json": json.dumps(CONTENT)},
            "status": "FINISHED",
            "start_ms": 1_000,
            "end_ms": 2_000,
        } | changes

    make.parent = parent
    return make


def children(store, item):
    return store.children(store.find_experiment("cells"), item.parent)


def as_seen(store, run):
    """All that MLflow's client tells of a run but for its ids and its label."""
    run = store.client.get_run(run.info.run_id)
    info = {
        key: value
        for key, value in dict(run.info).items()
        if key not in ("run_id", "run_uuid", "artifact_uri")
    }
    tags = {key: value for key, value in run.data.tags.items() if key != "aesi.number"}
    history = [
        (name, point.value, point.timestamp, point.step)
        for name in sorted(run.data.metrics)
        for point in store.client.get_metric_history(run.info.run_id, name)
    ]
    path = Path(store.client.download_artifacts(run.info.run_id, "coefficients.json"))
    inside = run.info.artifact_uri.replace(run.info.run_id, "ID")
    return info, inside, tags, run.data.params, run.data.metrics, history, json.loads(path.read_text())


def test_the_short_way_leaves_what_the_client_leaves(store, item, monkeypatch):
    store.deliver(item("short"), again=False)
    monkeypatch.setattr(mlflow_delivery, "database_of", lambda store: None)
    store.deliver(item("long"), again=False)
    found = children(store, item)
    short, long = (as_seen(store, found[label]) for label in ("short", "long"))
    assert short == long
    assert short[-1] == CONTENT


def test_sent_again_it_is_one_run(store, item):
    for again in (False, True, True):
        store.deliver(item("candidate:1"), again)
    (run,) = children(store, item).values()
    assert as_seen(store, run)[-1] == CONTENT


def test_a_failed_candidate_has_neither_metrics_nor_files(store, item):
    store.deliver(item("candidate:1", metrics={}, files={}, status="FAILED"), again=False)
    (run,) = children(store, item).values()
    assert (run.info.status, run.data.metrics) == ("FAILED", {})


def test_what_the_tables_refuse_goes_by_the_client(store, said, monkeypatch):
    def other_tables(*_):
        raise RuntimeError("NOT NULL constraint failed: runs.workspace")

    monkeypatch.setattr(mlflow_delivery, "insert_run", other_tables)
    monkeypatch.setattr(outbox, "RETRY_S", (0.01,))
    tracker = Tracker(store, Subject("cells", 0, "digest", QUIET), said.append)
    tracker.nested(
        "candidate:0", "candidate 000", "candidate", {"tau": 1}, {"fitness": 0.5}, {"a.json": CONTENT}
    )
    assert tracker.end("FINISHED") == 0
    assert not said
    (run,) = store.children(tracker.experiment_id, tracker.run_id).values()
    assert run.data.metrics == {"fitness": 0.5}
    assert run.info.end_time <= now_ms()
