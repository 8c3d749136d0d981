"""How the stages of a job are run: as Prefect tasks, or as the plain functions they are."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol, TypeVar
from uuid import UUID

from aesi.errors import AesiError
from flows.base.console import duration

T = TypeVar("T")
Say = Callable[[str], None]


class StageOverdue(AesiError):
    """A stage took longer than it may."""


class ServerAway(AesiError):
    """The Prefect server that is configured does not answer."""


class Stages(Protocol):
    """Runs the stages of a job, and shows what comes of them where there is somebody to show it."""

    def __call__(self, name: str, work: Callable[[], T], retries: int = 0) -> T:
        """One stage: its name, a function of nothing, and how often it may be tried again."""
        ...

    def progress(self, name: str, done: int, total: int) -> None:
        """How far the stage at work has come."""
        ...

    def publish(self, key: str, markdown: str, about: str) -> None:
        """A page about the job, kept under a key of lower-case letters, digits and dashes."""
        ...


class PlainStages:
    """Stages as function calls; nobody watches. Raises StageOverdue where one takes longer than `timeout_s`."""

    def __init__(self, say: Say, timeout_s: float | None = None) -> None:
        self._say, self._timeout_s = say, timeout_s

    def __call__(self, name: str, work: Callable[[], T], retries: int = 0) -> T:
        started = time.monotonic()
        with _limit(name, self._timeout_s):
            result = work()
        self._say(f"{name}: done in {duration(time.monotonic() - started)}")
        return result

    def progress(self, name: str, done: int, total: int) -> None:
        """Nothing: the console shows it."""

    def publish(self, key: str, markdown: str, about: str) -> None:
        """Nothing: the files are there."""


class PrefectStages:
    """Stages as Prefect tasks, with artifacts, seen in its UI.

    They close over what they need instead of taking it as parameters, because Prefect would walk through
    every array it is handed; what they compute is kept by content (`flows.base.stage_cache`,
    `flows.evaluation.outcome_store`), with and without Prefect. Bad input is not tried again. An artifact that
    cannot be stored is said, and costs nothing else.
    """

    def __init__(self, say: Say, timeout_s: float | None = None) -> None:
        self._say = say
        self._plain = PlainStages(say, timeout_s)
        self._bars: dict[str, UUID] = {}

    def __call__(self, name: str, work: Callable[[], T], retries: int = 0) -> T:
        from prefect import task
        from prefect.cache_policies import NO_CACHE

        stage = task(
            name=name,
            task_run_name=name,
            retries=retries,
            retry_delay_seconds=2,
            retry_condition_fn=_passing,
            cache_policy=NO_CACHE,
            persist_result=False,
        )(lambda: self._plain(name, work))
        result: T = stage()
        return result

    def progress(self, name: str, done: int, total: int) -> None:
        """A bar beside the task at work; one write to the server each time."""
        from prefect.artifacts import create_progress_artifact, update_progress_artifact

        share = 100.0 * done / total
        with self._told("progress"):
            if name in self._bars:
                update_progress_artifact(self._bars[name], share)
            else:
                self._bars[name] = create_progress_artifact(share, description=f"{name}: of {total}")

    def publish(self, key: str, markdown: str, about: str) -> None:
        """A Markdown artifact of the flow run."""
        from prefect.artifacts import create_markdown_artifact

        with self._told(key):
            create_markdown_artifact(markdown, key=key, description=about)

    @contextmanager
    def _told(self, what: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            reason = (str(error).strip().splitlines() or [type(error).__name__])[0][:200]
            self._say(f"prefect: the artifact {what} is not shown ({reason}).")


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
