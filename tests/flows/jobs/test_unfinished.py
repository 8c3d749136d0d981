"""Which run is gone on with: one that the tracking store has no more is none."""

import time
from dataclasses import replace

import pytest

from flows.base.console import Console
from flows.jobs.run_request import RunRequest
from flows.jobs.run_session import _unfinished, resume_key
from flows.tracking.run_records import RunRecord
from flows.tracking.store import Store


@pytest.fixture
def store(tracked):
    return Store()


@pytest.fixture
def unfinished(store, workspace):
    """An experiment, and the record of a run of it that failed."""
    path = workspace / "small.yaml"
    path.write_text("name: small\ndata: {kind: virtual}\n")
    config = RunRequest(str(path)).config()
    run_id = store.create_run(store.experiment("small"), "small, seed 0", {})
    record = RunRecord(run_id, "small", resume_key(config), store.uri, time.time(), "failed")
    record.write()
    return config, record


def test_a_run_that_is_there_is_gone_on_with(store, unfinished):
    config, record = unfinished
    assert _unfinished(config, store, Console()) == record


@pytest.mark.parametrize("before_s", [-60.0, 60.0])
def test_of_two_runs_the_newer_one_is_gone_on_with(store, unfinished, before_s):
    config, record = unfinished
    run_id = store.create_run(store.experiment("small"), "small, seed 0, again", {})
    other = replace(record, run_id=run_id, started_s=record.started_s + before_s)
    other.write()
    assert _unfinished(config, store, Console()) == (other if before_s > 0.0 else record)


@pytest.mark.parametrize("gone", ["deleted", "never there"])
def test_a_run_that_the_store_has_no_more_was_gone_on_with_and_ended_in_a_traceback(
    store, unfinished, capsys, gone
):
    config, record = unfinished
    if gone == "deleted":
        store.client.delete_run(record.run_id)
    else:
        record.forget()
        RunRecord("0" * 32, "small", record.config_digest, store.uri, time.time(), "failed").write()
    assert _unfinished(config, store, Console()) is None
    assert "There is no unfinished run" in capsys.readouterr().err
