"""Prefect's server may start late or go away: a run whose numbers are fine does not fail of it."""

import sys
import time

import httpx
import pytest

from aesi.errors import DataError
from flows.jobs import start
from flows.jobs.temporary_server import CURRENT, KeptWork, ServerNotStarted, as_the_job, start_server

GONE = httpx.ConnectError("All connection attempts failed")


@pytest.fixture
def started(monkeypatch):
    """A server that is there at once."""
    monkeypatch.setattr(start, "start_server", lambda: None)


def test_a_run_ended_in_a_connect_error_when_its_temporary_server_was_lost(workspace, started, capsys):
    def lost_at_the_end():
        as_the_job(lambda: "report")
        raise GONE

    assert start._with_or_without(lost_at_the_end, lambda: pytest.fail("run twice"), True) == "report"
    assert "its server is lost (All connection attempts failed)" in capsys.readouterr().err


def test_a_server_that_is_lost_before_the_run_begins_costs_nothing(workspace, started, capsys):
    def lost_at_once():
        raise GONE

    assert start._with_or_without(lost_at_once, lambda: "plainly", True) == "plainly"
    assert CURRENT.get() is None


def test_what_the_work_raised_is_raised_where_prefect_cannot_be_told(workspace, started):
    def lost_after_a_failure():
        try:
            as_the_job(lambda: (_ for _ in ()).throw(DataError("row 3 is no number")))
        except DataError:
            raise GONE from None

    with pytest.raises(DataError, match="row 3"):
        start._with_or_without(lost_after_a_failure, lambda: pytest.fail("run again"), True)


def test_a_job_began_without_prefect_after_a_signal_that_ended_the_server_too(
    workspace, started, monkeypatch
):
    from prefect.exceptions import TerminationSignal

    def before_the_job():
        try:
            raise TerminationSignal(signal=15)
        except TerminationSignal:
            raise GONE  # noqa: B904 - as it comes

    heard = []
    monkeypatch.setattr(start.signal, "raise_signal", lambda number: heard.append(number) or sys.exit(143))
    with pytest.raises(SystemExit):
        start._with_or_without(before_the_job, lambda: pytest.fail("begun"), True)
    assert heard == [15]


def test_a_mistake_is_no_lost_server(workspace, started):
    def wrong():
        raise TypeError("of its own")

    with pytest.raises(TypeError, match="of its own"):
        start._with_or_without(wrong, lambda: pytest.fail("hidden"), True)


def test_a_server_that_does_not_start_in_time_is_not_waited_for(workspace, monkeypatch, capsys):
    from prefect.server.api.server import SubprocessASGIServer

    stopped = []
    monkeypatch.setattr(SubprocessASGIServer, "start", lambda self: time.sleep(30))
    monkeypatch.setattr(SubprocessASGIServer, "stop", lambda self: stopped.append(self))
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    began = time.monotonic()
    with pytest.raises(ServerNotStarted, match=r"does not answer after 0\.2 s"):
        start_server(0.2)
    assert time.monotonic() - began < 20
    assert stopped
    monkeypatch.setattr(start, "start_server", lambda: start_server(0.2))
    assert start._with_or_without(lambda: pytest.fail("under Prefect"), lambda: "plainly", True) == "plainly"
    assert (
        "did not start (it does not answer after 0.2 s); the stages run without it" in capsys.readouterr().err
    )


def test_a_workspace_that_cannot_hold_prefects_files_ended_a_job_before_it_began(
    workspace, monkeypatch, capsys
):
    (workspace / "file").write_text("kept")
    monkeypatch.setenv("PREFECT_HOME", str(workspace / "file" / "prefect"))
    assert start._with_or_without(lambda: pytest.fail("under Prefect"), lambda: "plainly", True) == "plainly"
    assert "Not a directory); the stages run without it." in capsys.readouterr().err


def test_a_job_that_was_tried_again_counts_as_its_last_try():
    job = KeptWork()
    with pytest.raises(OSError, match="once"):
        job.do(lambda: (_ for _ in ()).throw(OSError("once")))
    assert job.do(lambda: 3) == 3
    assert job.outcome(lambda: pytest.fail("again")) == 3
    assert KeptWork().outcome(lambda: "first") == "first"
