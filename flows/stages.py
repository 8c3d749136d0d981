"""How the stages of a flow are run: as Prefect tasks, or as the plain functions they are."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol, TypeVar

from flows.console import duration

T = TypeVar("T")


class Run(Protocol):
    """Runs one stage: its name, a function of nothing, and how often it may be tried again."""

    def __call__(self, name: str, work: Callable[[], T], retries: int = 0) -> T: ...


def plainly(say: Callable[[str], None]) -> Run:
    """Stages as function calls."""

    def run(name: str, work: Callable[[], T], retries: int = 0) -> T:
        started = time.monotonic()
        result = work()
        say(f"{name}: done in {duration(time.monotonic() - started)}")
        return result

    return run


def as_tasks(say: Callable[[str], None]) -> Run:
    """Stages as Prefect tasks, seen in its UI where a server is configured.

    They close over what they need instead of taking it as parameters, because Prefect would walk through
    every array it is handed. Bad input is not tried again.
    """
    from prefect import task
    from prefect.cache_policies import NO_CACHE

    plain = plainly(say)

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


def _passing(task: object, run: object, state: object) -> bool:
    """Whether a failed stage is worth another try: a network or disk error is, bad input is not."""
    try:
        state.result()  # type: ignore[attr-defined]
    except OSError:
        return True
    except Exception:
        return False
    return False
