"""How the stages of a job are run: as Prefect tasks, or as the plain functions they are."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol, TypeVar
from uuid import UUID

from aesi.errors import AesiError, first_line
from aesi.logins import without_login
from flows.base.console import duration
from flows.base.time_limit import time_limit
from flows.jobs.temporary_server import KeptWork, no_answer, of_prefect, stop_sending

T = TypeVar("T")
Say = Callable[[str], None]
PAUSE_S = 2.0
"""Before a stage is tried again: a convention, long enough for a connection that was reset."""


class StageOverdue(AesiError):
    """A stage took longer than it may."""


class ServerAway(AesiError):
    """The Prefect server that is configured does not answer."""


class Stages(Protocol):
    """Runs the stages of a job, and shows what comes of them where there is somebody to show it."""

    def __call__(self, name: str, work: Callable[[], T], retries: int = 0) -> T:
        """Run one stage, a function without arguments.  retries : how often it is tried again after a failure of a disk
        or a network (OSError); bad input and data that cannot be fetched, for which a fallback may stand in, are not.
        """
        ...

    def progress(self, name: str, done: int, total: int) -> None:
        """Progress of the present stage."""
        ...

    def publish(self, key: str, markdown: str, about: str) -> None:
        """A page about the job, kept under a key of lower-case letters, digits and dashes."""
        ...


class PlainStages:
    """Stages as function calls; nobody watches. Raises StageOverdue where a try takes longer than `timeout_s`."""

    def __init__(self, say: Say, timeout_s: float | None = None) -> None:
        self._say, self._timeout_s = say, timeout_s

    def __call__(self, name: str, work: Callable[[], T], retries: int = 0) -> T:
        for left in range(retries, 0, -1):
            try:
                return self._once(name, work)
            except OSError as error:
                times = "once more" if left == 1 else f"up to {left} times more"
                self._say(f"{name}: failed ({first_line(error)}); it is tried {times}.")
                time.sleep(PAUSE_S)
        return self._once(name, work)

    def _once(self, name: str, work: Callable[[], T]) -> T:
        def late() -> StageOverdue:
            return StageOverdue(
                f"the stage {name!r} took longer than {self._timeout_s:g} s (runner.stage_timeout_s); "
                "what is finished is kept: allow more, and go on with --resume."
            )

        started = time.monotonic()
        with time_limit(self._timeout_s, late):
            result = work()
        self._say(f"{name}: done in {duration(time.monotonic() - started)}")
        return result

    def progress(self, name: str, done: int, total: int) -> None:
        """Nothing: the console shows it."""

    def publish(self, key: str, markdown: str, about: str) -> None:
        """Nothing: the files are there."""


class PrefectStages:
    """Stages as Prefect tasks, with artifacts, seen in its UI.

    A task is a plain stage: its limit and its tries are the same without Prefect, whose own would be on top of them; a
    failed try is a line in the log of the task.
    They close over what they need instead of taking it as parameters, because Prefect would walk through
    every array it is handed; what they compute is kept by content (`flows.base.stage_cache`,
    `flows.evaluation.outcome_store`), with and without Prefect. An artifact that cannot be stored is said, and
    costs nothing else; where the server is lost, the run goes on without it.
    """

    def __init__(self, say: Say, timeout_s: float | None = None) -> None:
        self._say = say
        self._plain = PlainStages(say, timeout_s)
        self._bars: dict[str, UUID] = {}
        self._lost = False

    def __call__(self, name: str, work: Callable[[], T], retries: int = 0) -> T:
        def plainly() -> T:
            return self._plain(name, work, retries)

        if self._lost:
            return plainly()
        from prefect import task
        from prefect.cache_policies import NO_CACHE

        job: KeptWork[T] = KeptWork()
        stage = task(
            name=name,
            task_run_name=name,
            cache_policy=NO_CACHE,
            persist_result=False,
        )(lambda: job.do(plainly))
        try:
            result: T = stage()
        except Exception as error:
            if not of_prefect(error):
                raise
            self._lose(error)
            return job.outcome(plainly)
        return result

    def progress(self, name: str, done: int, total: int) -> None:
        """A bar beside the task at work; one write to the server each time."""
        if self._lost:
            return
        from prefect.artifacts import create_progress_artifact, update_progress_artifact

        share = 100.0 * done / total
        with self._without_failing("progress"):
            if name in self._bars:
                update_progress_artifact(self._bars[name], share)
            else:
                self._bars[name] = create_progress_artifact(share, description=f"{name}: of {total}")

    def publish(self, key: str, markdown: str, about: str) -> None:
        """A Markdown artifact of the flow run."""
        if self._lost:
            return
        from prefect.artifacts import create_markdown_artifact

        with self._without_failing(key):
            create_markdown_artifact(markdown, key=key, description=about)

    @contextmanager
    def _without_failing(self, what: str) -> Iterator[None]:
        """Within, a failure of Prefect is said and ends nothing; one of its connection ends what is shown there."""
        try:
            yield
        except Exception as error:
            if no_answer(error):
                self._lose(error)
            else:
                self._say(f"prefect: the artifact {what} is not shown ({first_line(error)}).")

    def _lose(self, error: Exception) -> None:
        self._lost = True
        stop_sending()
        self._say(
            f"prefect: its server is lost ({first_line(error)}); the run goes on, and the rest is not shown there."
        )


@contextmanager
def server_in_reach() -> Iterator[None]:
    """Raises ServerAway, with what to do, where Prefect finds that its server does not answer."""
    try:
        yield
    except RuntimeError as error:
        if "Failed to reach API" not in str(error):
            raise
        place = without_login(os.environ.get("PREFECT_API_URL", "of the active profile"))
        raise ServerAway(
            f"the Prefect server {place} does not answer; start it, or unset PREFECT_API_URL to run the stages without "
            "it."
        ) from None
