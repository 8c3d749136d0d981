"""Stages: timed, retried where that helps, shown where a person looks."""

import logging
import signal
import time
from contextlib import suppress

import pytest

from aesi.errors import DataError
from flows.base.console import Console
from flows.jobs import stages
from flows.jobs.stages import PlainStages, ServerAway, StageOverdue, server_in_reach
from flows.jobs.temporary_server import CURRENT


def test_a_stage_says_when_it_is_done(said):
    assert PlainStages(said.append)("sums", lambda: 2 + 2) == 4
    assert said == ["sums: done in 0 s"]


def test_a_stage_that_takes_too_long_is_interrupted_in_one_sentence(said):
    started = time.monotonic()
    with pytest.raises(
        StageOverdue, match=r"'rest' took longer than 0\.2 s \(runner\.stage_timeout_s\)"
    ) as caught:
        PlainStages(said.append, timeout_s=0.2)("rest", lambda: time.sleep(30))
    assert time.monotonic() - started < 20
    assert "\n" not in str(caught.value)
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_a_limit_that_came_while_a_failure_was_borne_was_taken_for_one(said):
    def bears_all():
        with suppress(Exception):  # as of a storage, a candidate or an artifact that fails
            time.sleep(30)
        return "without a limit"

    with pytest.raises(StageOverdue, match="'search' took longer"):
        PlainStages(said.append, timeout_s=0.2)("search", bears_all)
    assert said == []


def test_a_limit_that_came_while_a_candidate_was_kept_ended_the_copy_of_the_study_instead(said, monkeypatch):
    import optuna

    from flows.search.nsga2 import Constraints
    from flows.search.published_study import PublishedStudy

    monkeypatch.setattr(optuna, "create_study", lambda **_: time.sleep(30))
    with pytest.raises(StageOverdue):
        PlainStages(said.append, timeout_s=0.2)(
            "search", lambda: PublishedStudy("one", None, Constraints(0.0, 0.0), None, said.append)
        )
    assert said == []


def test_the_time_of_one_stage_is_not_taken_from_the_next(said):
    run = PlainStages(said.append, timeout_s=0.5)
    for _ in range(3):
        run("rest", lambda: time.sleep(0.3))
    assert len(said) == 3


def away(times):
    """Work that the network fails at first, and the tries it takes."""
    tries = []

    def work():
        tries.append("once")
        if len(tries) <= times:
            raise ConnectionError("no route")
        return "data"

    return work, tries


def test_without_prefect_a_stage_was_not_tried_again(said, monkeypatch):
    monkeypatch.setattr(stages, "PAUSE_S", 0.0)
    work, tries = away(2)
    assert PlainStages(said.append)("data", work, retries=2) == "data"
    assert len(tries) == 3
    assert said == [
        "data: failed (no route); it is tried up to 2 times more.",
        "data: failed (no route); it is tried once more.",
        "data: done in 0 s",
    ]


def test_a_stage_that_fails_at_every_try_says_so_as_it_did(said, monkeypatch):
    monkeypatch.setattr(stages, "PAUSE_S", 0.0)
    work, tries = away(9)
    with pytest.raises(ConnectionError, match="no route"):
        PlainStages(said.append)("data", work, retries=1)
    assert len(tries) == 2
    with pytest.raises(ConnectionError):
        PlainStages(said.append)("data", work)
    assert len(tries) == 3


def test_bad_input_and_a_limit_are_not_tried_again(said):
    tries = []

    def wrong():
        tries.append("once")
        raise DataError("row 3 is no number")

    with pytest.raises(DataError, match="row 3"):
        PlainStages(said.append)("data", wrong, retries=2)
    with pytest.raises(StageOverdue):
        PlainStages(said.append, timeout_s=0.1)(
            "data", lambda: tries.append("once") or time.sleep(30), retries=2
        )
    assert len(tries) == 2
    assert said == []


def test_the_password_of_a_server_that_is_away_was_shown(monkeypatch):
    monkeypatch.setenv("PREFECT_API_URL", "http://me:secret@127.0.0.1:9/api")
    with (
        pytest.raises(ServerAway, match=r"the Prefect server http://127\.0\.0\.1:9/api does not answer"),
        server_in_reach(),
    ):
        raise RuntimeError("Failed to reach API at http://me:secret@127.0.0.1:9/api")


def test_a_server_that_is_away_is_one_sentence(monkeypatch):
    monkeypatch.setenv("PREFECT_API_URL", "http://127.0.0.1:9/api")
    with (
        pytest.raises(ServerAway, match=r"127\.0\.0\.1:9/api does not answer; start it, or unset"),
        server_in_reach(),
    ):
        raise RuntimeError("Failed to reach API at http://127.0.0.1:9/api/")
    with pytest.raises(RuntimeError, match="of its own"), server_in_reach():
        raise RuntimeError("of its own")


def test_what_is_said_reaches_the_logger_that_prefect_shows(capsys):
    lines = []
    handler = logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())
    logging.getLogger("aesi").addHandler(handler)
    try:
        console = Console(every_s=0.0)
        console.say("search: done")
        console.progress("candidates", 1, 4, time.monotonic() - 2.0, "best 0.5")
    finally:
        logging.getLogger("aesi").removeHandler(handler)
    assert lines == ["search: done", "  candidates: 1/4, about 6 s left, best 0.5"]
    assert capsys.readouterr().err.splitlines() == lines


@pytest.mark.slow
def test_as_tasks_a_passing_failure_is_tried_again_and_bad_input_is_not(said):
    from prefect import flow
    from prefect.testing.utilities import prefect_test_harness

    from flows.jobs.stages import PrefectStages

    tries = {"network": 0, "input": 0}

    def away_once():
        tries["network"] += 1
        if tries["network"] == 1:
            raise ConnectionError("no route")
        return "data"

    def wrong():
        tries["input"] += 1
        raise DataError("row 3 is no number")

    @flow
    def job():
        run = PrefectStages(said.append)
        found = run("data", away_once, retries=2)
        with pytest.raises(DataError, match="row 3"):
            run("more", wrong, retries=2)
        return found

    with prefect_test_harness(server_startup_timeout=180):
        assert job() == "data"
    assert tries == {"network": 2, "input": 1}
    assert said == ["data: failed (no route); it is tried up to 2 times more.", "data: done in 0 s"]


@pytest.mark.slow
def test_as_tasks_a_server_that_is_lost_between_two_stages_is_said_and_the_rest_goes_on(said, monkeypatch):
    from prefect import flow
    from prefect.server.api.server import SubprocessASGIServer
    from prefect.testing.utilities import prefect_test_harness

    from flows.jobs.stages import PrefectStages
    from flows.jobs.temporary_server import KeptWork, as_the_job

    counted = []

    def lose():
        server = SubprocessASGIServer()  # the harness's
        server.server_process.kill()
        server.server_process.wait()
        return counted.append("lost") or 1

    @flow
    def job():
        def work():
            run = PrefectStages(said.append)
            total = run("first", lose) + run("second", lambda: counted.append("second") or 2)
            run.publish("page", "# Text", "of nothing")
            return total

        return as_the_job(work)

    kept = KeptWork()
    token = CURRENT.set(kept)
    try:
        with prefect_test_harness(server_startup_timeout=180), pytest.raises(Exception, match=r"(?i)connect"):
            job()
    finally:
        CURRENT.reset(token)
    assert kept.results == [3]
    assert counted == ["lost", "second"]
    assert sum("its server is lost" in line for line in said) == 1
