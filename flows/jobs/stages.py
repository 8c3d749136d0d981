"""How the stages of a flow are run: as Prefect tasks, or as the plain functions they are."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol, TypeVar

from aesi.errors import AesiError
from flows.base.console import duration

T = TypeVar("T")
Say = Callable[[str], None]


class StageOverdue(AesiError):
    """A stage took longer than it may."""


class ServerAway(AesiError):
    """The Prefect server that is configured does not answer."""


class RunStage(Protocol):
    """Runs one stage: its name, a function of nothing, and how often it may be tried again."""

    def __call__(self, name: str, work: Callable[[], T], retries: int = 0) -> T: ...


def plainly(say: Say, timeout_s: float | None = None) -> RunStage:
    """Stages as function calls. Raises StageOverdue where one takes longer than `timeout_s`."""

    def run(name: str, work: Callable[[], T], retries: int = 0) -> T:
        started = time.monotonic()
        with _limit(name, timeout_s):
            result = work()
        say(f"{name}: done in {duration(time.monotonic() - started)}")
        return result

    return run


def as_tasks(say: Say, timeout_s: float | None = None) -> RunStage:
    """Stages as Prefect tasks, seen in its UI where a server is configured.

    They close over what they need instead of taking it as parameters, because Prefect would walk through
    every array it is handed; what they compute is kept by content (`flows.base.stage_cache`,
    `flows.evaluation.outcome_store`), with and without Prefect. Bad input is not tried again.
    """
    from prefect import task
    from prefect.cache_policies import NO_CACHE

    plain = plainly(say, timeout_s)

    def run(name: str, work: Callable[[], T], retries: int = 0) -> T:
        stage = task(
            name=name,
            retries=retries,
            retry_delay_seconds=2,
            retry_condition_fn=_passing,
            cache_policy=NO_CACHE,
            persist_result=False,
        )(lambda: plain(name, work))
        result: T = stage()
        return result

    return run


@contextmanager
def server_in_reach() -> Iterator[None]:
    """Raises ServerAway, with what to do, where Prefect finds that its server does not answer."""
    try:
        yield
    except RuntimeError as error:
        if "Failed to reach API" not in str(error):
            raise
        raise ServerAway(
            f"the Prefect server {os.environ.get('PREFECT_API_URL', 'of the active profile')} does not answer; "
            "start it, or unset PREFECT_API_URL to run the stages without it."
        ) from None


@contextmanager
def _limit(name: str, timeout_s: float | None) -> Iterator[None]:
    """Interrupt the block after a time; compiled code is interrupted when it returns."""
    if timeout_s is None or threading.current_thread() is not threading.main_thread():
        yield
        return

    def overdue(number: int, frame: FrameType | None) -> None:
        raise StageOverdue(
            f"the stage {name!r} took longer than {duration(timeout_s)} (runner.stage_timeout_s); what is "
            "finished is kept: allow more, and go on with --resume."
        )

    before = signal.signal(signal.SIGALRM, overdue)
    signal.setitimer(signal.ITIMER_REAL, timeout_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _passing(task: object, run: object, state: object) -> bool:
    """Whether a failed stage is worth another try: a network or disk error is, bad input is not."""
    try:
        state.result()  # type: ignore[attr-defined]
    except OSError:
        return True
    except Exception:
        return False
    return False
