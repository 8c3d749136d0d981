"""Killed with -9 where it hurts, then resumed: the result of an uninterrupted run, nothing done or tracked twice."""

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from flows.tracking.store import KIND, NUMBER, PARENT, Store

HERE = Path(__file__).parent
ROOT = HERE.parents[2]


@pytest.fixture
def killed(tracked):
    """Runs `aesi` until it dies in the n-th call of a function; what it had said by then."""

    def run(module, name, call, arguments):
        command = [sys.executable, str(HERE / "killed_inside.py"), module, name, str(call), *arguments]
        environ = os.environ | {"PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            command, cwd=tracked, env=environ, capture_output=True, text=True, timeout=240, check=False
        )
        assert done.returncode == -9, done.stderr
        return done.stderr

    return run


def candidates_on_disk(workspace):
    return {path: path.stat().st_mtime_ns for path in (workspace / ".aesi/cache/candidates").glob("??/*.bin")}


def all_tracked(workspace):
    """The one parent run, and every nested run with its label; a label that was tracked twice is there twice."""
    store = Store(f"sqlite:///{workspace}/mlflow.db")
    experiment = store.find_experiment("smoke")
    (parent,) = store.runs(experiment, f"tags.`{KIND}` = 'run'")
    nested = list(store.runs(experiment, f"tags.`{PARENT}` = '{parent.info.run_id}'"))
    return parent, [(run.data.tags[NUMBER], run) for run in nested]


def what_counts(nested):
    return {
        label: (run.info.status, run.data.params, without_clock(run.data.metrics))
        for label, run in nested
        if label.startswith(("candidate:", "model:"))
    }


def without_clock(metrics):
    return {name: value for name, value in metrics.items() if not name.endswith(("seconds", "_evaluation_s"))}


def assert_as_uninterrupted(workspace, finished):
    parent, nested = all_tracked(workspace)
    assert parent.info.status == "FINISHED"
    assert max(Counter(label for label, _ in nested).values()) == 1
    assert what_counts(nested) == what_counts(all_tracked(finished)[1])
    tables = [next((each / "runs/smoke").glob("*/tables.md")).read_text() for each in (workspace, finished)]
    resumed, whole = (re.sub(r"\| [\d.]+ \|$", "|", text, flags=re.MULTILINE) for text in tables)
    assert resumed == whole


@pytest.fixture
def resume(run, capsys):
    """Goes on with the killed run, in this process: only what was left on disk is there; what it said."""

    def go(*more):
        capsys.readouterr()
        run(*more, resume=True)
        said = capsys.readouterr().err
        assert "resumed" in said
        return said

    return go


def test_killed_in_the_calibration_of_the_intervals(killed, resume, arguments, tracked, finished):
    said = killed("aesi.conformal", "FreeRunBands.fit", 2, arguments())
    assert "final models: done" in said
    assert "intervals: done" not in said
    before = candidates_on_disk(tracked)
    assert len(before) == 6
    said = resume()
    assert "0 candidates evaluated, 6 known from before" in said
    assert candidates_on_disk(tracked) == before
    assert_as_uninterrupted(tracked, finished)


def test_killed_in_the_delivery_of_a_candidate(killed, resume, arguments, tracked, finished):
    killed("flows.tracking.delivery", "_write_files", 3, arguments())  # the third candidate is there in part
    waiting = list((tracked / ".aesi/outbox").glob("*/[0-9]*.json"))
    assert waiting
    before = candidates_on_disk(tracked)
    assert 3 <= len(before) < 6
    said = resume()
    assert f"{6 - len(before)} candidates evaluated, {len(before)} known from before" in said
    after = candidates_on_disk(tracked)
    assert {path: stamp for path, stamp in after.items() if path in before} == before
    assert len(after) == 6
    assert not list((tracked / ".aesi/outbox").glob("*/[0-9]*.json"))
    assert_as_uninterrupted(tracked, finished)


def test_killed_when_the_last_item_is_delivered(killed, resume, arguments, tracked, finished):
    # Nested runs are written as ones that have ended: the run itself is the only one that is ended by a call.
    said = killed("mlflow", "MlflowClient.set_terminated", 1, arguments())
    assert "report: done" in said
    before = candidates_on_disk(tracked)
    resume()
    assert candidates_on_disk(tracked) == before
    assert_as_uninterrupted(tracked, finished)


def test_killed_after_the_model_was_registered(killed, resume, arguments, tracked):
    with_model = "tracking.log_model=true"
    killed("flows.tracking.serving.logged_model", "_register", 1, arguments(with_model))
    resume(with_model)
    client = Store(f"sqlite:///{tracked}/mlflow.db").client
    assert [version.version for version in client.search_model_versions("name = 'smoke'")] == [1]
    assert len(client.search_logged_models([client.get_experiment_by_name("smoke").experiment_id])) == 1
