"""Which run is gone on with: one that the tracking store has no more is none."""

import json
import re
import shutil
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest

from aesi.pipeline.experiment.sections import TrackingConfig
from flows.base.console import Console
from flows.jobs.run_request import RunRequest
from flows.jobs.run_session import _close_killed, _unfinished, resume_key, tracked_job, working_on
from flows.tracking.beginnings import close_unrecorded, noted_beginning
from flows.tracking.leftovers import deliver_leftovers
from flows.tracking.run_records import RunLock, RunRecord, RunTaken, records
from flows.tracking.store import Store, StoreAway
from flows.tracking.tracker import Subject, Tracker


@pytest.fixture
def store(tracked):
    return Store()


@pytest.fixture
def held():
    """Holds the locks of the runs that were found."""
    with ExitStack() as locks:
        yield locks


@pytest.fixture
def unfinished(store, workspace):
    """An experiment, and the record of a run of it that failed."""
    path = workspace / "small.yaml"
    path.write_text("name: small\ndata: {kind: virtual}\n")
    config = RunRequest(str(path)).config
    run_id = store.create_run(store.experiment("small"), "small, seed 0", {})
    record = RunRecord(run_id, "small", resume_key(config), time.time(), "failed")
    record.write()
    return config, record


def test_a_run_that_is_there_is_gone_on_with(store, unfinished, held):
    config, record = unfinished
    assert _unfinished(config, store, Console(), held) == record


@pytest.mark.parametrize("before_s", [-60.0, 60.0])
def test_of_two_runs_the_newer_one_is_gone_on_with(store, unfinished, held, before_s):
    config, record = unfinished
    run_id = store.create_run(store.experiment("small"), "small, seed 0, again", {})
    other = replace(record, run_id=run_id, started_s=record.started_s + before_s)
    other.write()
    assert _unfinished(config, store, Console(), held) == (other if before_s > 0.0 else record)


@pytest.mark.parametrize(("begun_anew", "cache"), [(True, True), (True, False), (False, False)])
def test_a_run_without_cache_was_gone_on_with_from_the_cache(store, unfinished, workspace, begun_anew, cache):
    _, before = unfinished
    replace(before, anew=begun_anew).write()
    request = RunRequest(str(workspace / "small.yaml"), resume=True, use_cache=cache)
    with working_on(request, store, Console()) as (tracker, record):
        assert record.anew
        same = tracker.run_id == before.run_id
        assert same == begun_anew  # what the other one has tracked may have come from the cache


@pytest.mark.parametrize("gone", ["deleted", "never there"])
def test_a_run_that_the_store_has_no_more_was_gone_on_with_and_ended_in_a_traceback(
    store, unfinished, held, capsys, gone
):
    config, record = unfinished
    if gone == "deleted":
        store.client.delete_run(record.run_id)
    else:
        record.forget()
        RunRecord("0" * 32, "small", record.config_digest, time.time(), "failed").write()
    assert _unfinished(config, store, Console(), held) is None
    assert "There is no unfinished run" in capsys.readouterr().err


def test_two_that_went_on_with_a_run_at_once_both_worked_on_it(store, unfinished, held):
    config, record = unfinished
    assert _unfinished(config, store, Console(), held) == record
    with (
        pytest.raises(RunTaken, match=f"another process works on run {record.run_id}"),
        ExitStack() as second,
    ):
        _unfinished(config, store, Console(), second)
    held.close()
    with ExitStack() as later:
        assert _unfinished(config, store, Console(), later) == record


def test_a_run_that_another_process_works_on_is_told_and_ends_the_command(call, unfinished, workspace):
    _, record = unfinished
    with RunLock(record.run_id):
        code, _, err = call("run", workspace / "small.yaml", "--resume", "--no-prefect")
    assert code == 1
    assert err.splitlines()[-1].endswith(
        f"another process works on run {record.run_id} or delivers what it tracked; wait for its end, then start again."
    )
    assert [one.run_id for one in records("small")] == [record.run_id]  # no other was begun


def test_a_run_was_tracked_and_noted_before_it_was_this_processs_alone(
    store, unfinished, workspace, monkeypatch
):
    seen = []

    def taken(run_id):
        try:
            with RunLock(run_id):
                return False
        except RunTaken:
            return True

    class Watched(Tracker):
        def __init__(self, store, config, say, run_id=None, **named):
            seen.append(run_id is None or taken(run_id))
            super().__init__(store, config, say, run_id, **named)

    written = RunRecord.write

    def watched(record):
        seen.append(taken(record.run_id))
        written(record)

    monkeypatch.setattr("flows.tracking.tracker.Tracker", Watched)
    monkeypatch.setattr(RunRecord, "write", watched)
    path = str(workspace / "small.yaml")
    for resume in (True, False):
        with working_on(RunRequest(path, resume=resume), store, Console()) as (tracker, _):
            assert taken(tracker.run_id)
        assert not taken(tracker.run_id)
    with tracked_job(Subject("job", 0, "key", "batch"), "title", Console()) as tracker:
        assert taken(tracker.run_id)
    assert not taken(tracker.run_id)
    assert len(seen) == 9
    assert all(seen)


def test_a_run_that_others_work_on_is_neither_closed_nor_delivered(store, unfinished, workspace, said):
    _, record = unfinished
    replace(record, status="running").write()
    box = workspace / ".aesi" / "outbox" / record.run_id
    box.mkdir(parents=True)
    (box / "00000001.json").write_text("{}")
    with RunLock(record.run_id):
        deliver_leftovers(store, said.append)
        _close_killed(store, Console())
    assert said == []
    assert (box / "00000001.json").exists()
    assert record.again().status == "running"


def test_a_store_that_failed_after_it_was_opened_ended_a_job_whose_results_lie_elsewhere(
    store, unfinished, workspace, monkeypatch, capsys
):
    """And an experiment, which has to be tracked, ended in a traceback."""
    from mlflow.exceptions import MlflowException

    def fails(self, run_id):
        raise MlflowException("API request failed with error code 500")

    _, record = unfinished
    replace(record, status="running").write()
    monkeypatch.setattr(Store, "holds", fails)
    with tracked_job(Subject("small", 0, "key", "batch"), "title", Console()) as tracker:
        assert tracker is None
    told = "cannot be used (API request failed with error code 500)"
    assert re.match(f"not tracked: the tracking store .* {re.escape(told)}; ", capsys.readouterr().err)
    with (
        pytest.raises(StoreAway, match=re.escape(told)),
        working_on(RunRequest(str(workspace / "small.yaml")), store, Console()),
    ):
        pass


def test_a_file_that_a_job_left_over_was_sought_from_the_folder_of_the_next(
    store, workspace, monkeypatch, capsys
):
    there, elsewhere = workspace / "there", workspace / "elsewhere"
    for folder in (there, elsewhere):
        folder.mkdir()
    (there / "report.html").write_text("found")
    monkeypatch.chdir(there)
    with monkeypatch.context() as away:
        away.setattr("flows.tracking.tracker.deliver", _away)
        tracker = Tracker(store, Subject("job", 0, "key", "batch"), print)
        tracker.files(Path("report.html"))
        assert tracker.end("FINISHED", wait_s=0.0) > 0
    monkeypatch.chdir(elsewhere)
    with tracked_job(Subject("another", 0, "key", "batch"), "title", Console()):
        pass
    assert f"what run {tracker.run_id[:8]} had left over is delivered" in capsys.readouterr().err
    assert [one.path for one in store.client.list_artifacts(tracker.run_id)] == ["report.html"]


def test_a_run_was_left_behind_by_its_workspace_when_that_was_moved(
    unfinished, workspace, monkeypatch, held, capsys, tmp_path_factory
):
    config, record = unfinished
    report = workspace / "runs" / "report.html"
    report.parent.mkdir()
    report.write_text("found")
    with monkeypatch.context() as away:
        away.setattr("flows.tracking.tracker.deliver", _away)
        tracker = Tracker(Store(), config, print, record.run_id)
        tracker.files(report)
        tracker.end("FAILED", wait_s=0.0)
    replace(record, status="running").write()
    moved = tmp_path_factory.mktemp("elsewhere") / "workspace"
    shutil.copytree(workspace, moved)
    shutil.rmtree(report.parent)
    monkeypatch.setenv("AESI_HOME", str(moved))
    store = Store()
    _close_killed(store, Console())
    deliver_leftovers(store, print)
    assert f"run {record.run_id} had been killed" in capsys.readouterr().err
    assert [one.path for one in store.client.list_artifacts(record.run_id)] == ["report.html"]
    assert _unfinished(config, store, Console(), held) == replace(record, status="killed")


def test_what_waits_for_a_run_that_was_deleted_was_refused_item_by_item(store, workspace, said):
    run_id = store.create_run(store.experiment("small"), "small, seed 0", {})
    box = workspace / ".aesi" / "outbox" / run_id
    box.mkdir(parents=True)
    item = {"kind": "json", "run_id": run_id, "name": "a.json", "content": {}}
    (box / "00000001.json").write_text(json.dumps(item))
    store.client.delete_run(run_id)
    deliver_leftovers(store, said.append)
    assert said == []
    store.client.restore_run(run_id)
    deliver_leftovers(store, said.append)
    assert said == [f"tracking: what run {run_id[:8]} had left over is delivered."]


def test_an_item_that_was_left_over_and_refused_was_called_delivered(store, workspace, said, monkeypatch):
    monkeypatch.setattr("flows.tracking.outbox.RETRY_S", (0.01,))
    run_id = store.create_run(store.experiment("small"), "small, seed 0", {})
    box = workspace / ".aesi" / "outbox" / run_id
    box.mkdir(parents=True)
    (box / "00000001.json").write_text(json.dumps({"kind": "of a later version"}))
    deliver_leftovers(store, said.append)
    refused, delivered = said
    assert "of another version of the program (its kind 'of a later version' is not known here)" in refused
    assert delivered == (
        f"tracking: what run {run_id[:8]} had left over is delivered, but for what was put aside."
    )


def test_an_item_of_another_version_was_refused_in_the_words_of_a_key_error(store, workspace, said):
    run_id = store.create_run(store.experiment("small"), "small, seed 0", {})
    box = workspace / ".aesi" / "outbox" / run_id
    box.mkdir(parents=True)
    lacking = {"kind": "batch", "run_id": run_id, "params": {}, "tags": {}, "at_ms": 1}
    (box / "00000001.json").write_text(json.dumps(lacking))
    within = {"kind": "datasets", "run_id": run_id, "datasets": [{"name": "a", "digest": "b"}]}
    (box / "00000002.json").write_text(json.dumps(within))
    (box / "00000003.json").write_text(json.dumps(lacking | {"metrics": {"fitness": 0.5}}))
    deliver_leftovers(store, said.append)
    assert store.run(run_id).data.metrics == {"fitness": 0.5}
    for number, key in enumerate(("metrics", "source"), 1):
        aside = box / "refused" / f"0000000{number}.json"
        assert aside.is_file()
        assert said[number - 1] == (
            f"tracking: an item that waited for the store is of another version of the program (it lacks '{key}'), so "
            f"that what it held is missing there; it is kept in {aside}: put it back into {box} and run `aesi tables` "
            "of that version, or delete it."
        )
    assert said[2:] == [
        f"tracking: what run {run_id[:8]} had left over is delivered, but for what was put aside."
    ]


def _away(store, item, again):
    raise ConnectionError("away")


def test_a_run_that_ended_while_its_lock_was_asked_for_was_closed_as_killed(
    store, unfinished, monkeypatch, held
):
    config, record = unfinished
    stale = replace(record, status="running")
    replace(record, status="finished").write()
    monkeypatch.setattr("flows.jobs.run_session.records", lambda *experiment: [stale])
    _close_killed(store, Console())
    assert record.again().status == "finished"
    assert _unfinished(config, store, Console(), held) is None
    with RunLock(record.run_id):
        pass


def dying_after(function):
    """The function, whose process dies when its work is done."""

    def dies(*arguments, **named):
        function(*arguments, **named)
        raise KeyboardInterrupt

    return dies


def status_after_the_next_job(store, run_id):
    with tracked_job(Subject("another", 0, "key", "batch"), "title", Console()):
        return store.run(run_id).info.status


JOB = Subject("job", 0, "key", "batch")


def test_a_run_of_a_process_that_died_before_its_record_was_written_stayed_running_for_good(
    store, workspace, monkeypatch, capsys
):
    with monkeypatch.context() as patched:
        patched.setattr(Store, "create_run", dying_after(Store.create_run))
        with pytest.raises(KeyboardInterrupt), tracked_job(JOB, "title", Console()):
            pass
    (run,) = store.jobs(store.find_experiment("job"))
    assert (run.info.status, records()) == ("RUNNING", [])
    assert status_after_the_next_job(store, run.info.run_id) == "KILLED"
    assert f"run {run.info.run_id} had been killed as it began" in capsys.readouterr().err
    assert not list((workspace / ".aesi" / "begun").glob("*.json"))


def test_the_note_of_a_run_is_kept_until_the_store_that_may_hold_it_was_asked(store, workspace, monkeypatch):
    def dies(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Store, "create_run", dies)
        with pytest.raises(KeyboardInterrupt), tracked_job(JOB, "title", Console()):
            pass
    (note,) = (workspace / ".aesi" / "begun").glob("*.json")
    with tracked_job(
        replace(JOB, tracking=TrackingConfig(uri=f"sqlite:///{workspace}/other.db")), "title", Console()
    ):
        assert note.exists()
    with tracked_job(JOB, "title", Console()):
        assert not note.exists()


@pytest.mark.parametrize(
    "content", ['{"uri": "sqlite:///a.db"}', '{"store": 1, "experiment": "job"}', "[1]", "", "\xff"]
)
def test_a_note_of_another_version_ended_each_job_with_a_key_error(store, workspace, said, content):
    folder = workspace / ".aesi" / "begun"
    folder.mkdir(parents=True, exist_ok=True)
    note = folder / "of_another_version.json"
    note.write_text(content, encoding="latin-1")
    with noted_beginning(store, "job") as tags:
        run_id = store.create_run(store.experiment("job"), "killed", tags)
        kept = (folder / f"{next(iter(tags.values()))}.json").read_bytes()
    (folder / f"{next(iter(tags.values()))}.json").write_bytes(kept)
    close_unrecorded(store, said.append)
    assert store.run(run_id).info.status == "KILLED"  # the others are dealt with
    assert [path.name for path in folder.glob("*.json")] == [note.name]
    (told,) = [line for line in said if str(note) in line]
    assert told == (
        f"{note} is no note of this version on a run that begins, so that a run that it may name stays RUNNING in its "
        "store: run a job with the version that wrote it, or delete the file."
    )


def test_a_process_that_died_as_it_closed_its_run_left_it_running_in_the_store(store, monkeypatch):
    written = RunRecord.write

    def dies(record):
        written(record)
        if record.status == "failed":
            raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(RunRecord, "write", dies)
        with pytest.raises(KeyboardInterrupt), tracked_job(JOB, "title", Console()) as tracker:
            raise ValueError
    assert records("job")[0].status == "failed"
    assert status_after_the_next_job(store, tracker.run_id) == "FAILED"


def test_a_process_that_died_as_it_went_on_with_a_run_left_it_running_in_the_store(
    store, unfinished, workspace, monkeypatch
):
    from mlflow import MlflowClient

    _, record = unfinished
    with monkeypatch.context() as patched:
        patched.setattr(MlflowClient, "update_run", dying_after(MlflowClient.update_run))
        with (
            pytest.raises(KeyboardInterrupt),
            working_on(RunRequest(str(workspace / "small.yaml"), resume=True), store, Console()),
        ):
            pass
    assert store.run(record.run_id).info.status == "RUNNING"
    assert status_after_the_next_job(store, record.run_id) == "KILLED"


def test_a_run_whose_end_the_store_did_not_take_was_noted_as_closed(store, unfinished, monkeypatch):
    from mlflow import MlflowClient
    from mlflow.exceptions import MlflowException

    def fails(self, *_):
        raise MlflowException("database is locked")

    _, record = unfinished
    replace(record, status="running").write()
    with monkeypatch.context() as patched:
        patched.setattr(MlflowClient, "set_terminated", fails)
        with tracked_job(JOB, "title", Console()) as tracker:
            assert tracker is None
    assert record.again().status == "running"
    assert status_after_the_next_job(store, record.run_id) == "KILLED"


def test_a_run_that_was_killed_when_all_was_done_was_closed_as_killed(store, unfinished, capsys):
    _, record = unfinished
    replace(record, status="running").write()
    store.client.set_terminated(record.run_id, "FINISHED")
    assert status_after_the_next_job(store, record.run_id) == "FINISHED"
    assert "had been killed" not in capsys.readouterr().err


def test_an_item_that_was_cut_off_ended_each_later_command(store, workspace, capsys):
    run_id = store.create_run(store.experiment("small"), "small, seed 0", {})
    box = workspace / ".aesi" / "outbox" / run_id
    box.mkdir(parents=True)
    (box / "00000001.json").write_text('{"kind": "json", "run_')
    (box / "00000002.json").write_text(
        json.dumps({"kind": "json", "run_id": run_id, "name": "a.json", "content": {}})
    )
    assert status_after_the_next_job(store, run_id) == "RUNNING"
    unreadable, delivered, *_ = capsys.readouterr().err.splitlines()
    assert "cannot be read (Unterminated string" in unreadable
    assert (
        f"it is kept in {box / 'refused' / '00000001.json'}: put a whole copy back into {box}" in unreadable
    )
    assert delivered.endswith("is delivered, but for what was put aside.")
    assert [one.path for one in store.client.list_artifacts(run_id)] == ["a.json"]
    status_after_the_next_job(store, run_id)
    assert capsys.readouterr().err == ""
