"""Nested runs in the store: whole, and one however often they are sent."""

import json
from pathlib import Path

import pytest

from flows.tracking.delivery import deliver
from flows.tracking.store import KIND, Store

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


def coefficients(store, run):
    return json.loads(Path(store.client.download_artifacts(run.info.run_id, "coefficients.json")).read_text())


def test_sent_again_it_is_one_run(store, item):
    for again in (False, True, True):
        deliver(store, item("candidate:1"), again)
    (run,) = children(store, item).values()
    assert coefficients(store, run) == CONTENT
    assert run.data.metrics == {"fitness": 0.5, "loss/oob": 1e-9}
    assert (run.info.start_time, run.info.end_time) == (1_000, 2_000)


def test_a_failed_candidate_has_neither_metrics_nor_files(store, item):
    deliver(store, item("candidate:1", metrics={}, files={}, status="FAILED"), again=False)
    (run,) = children(store, item).values()
    assert (run.info.status, run.data.metrics) == ("FAILED", {})
