"""A limit on the processor seconds of one piece of work, and the row of a benchmark's case without an answer."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import TypeVar

from aesi.bench import CaseRow
from aesi.errors import AesiError

T = TypeVar("T")

ERROR, OUT_OF_TIME = "error", "out of time"
NO_ANSWER = (ERROR, OUT_OF_TIME)
"""Verdicts of cases without an answer."""
NOT_RUN = "not run"
"""Verdict of a case whose data are not available: it is counted, but not in any figure."""


class OutOfTime(BaseException):
    """The processor seconds are used up. Not an Exception, so that no handler for errors of a fit catches it."""


@contextmanager
def processor_limit(seconds: float | None) -> Iterator[None]:
    """Raise OutOfTime in the body once it has used `seconds` of processor time; None sets no limit.

    Effective in the main thread of a process, on systems with interval timers; elsewhere (threads of
    Dask workers, Windows) the body runs without a limit.
    """
    here = threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer")
    if seconds is None or not here:
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        raise OutOfTime

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds, 5.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@dataclass(frozen=True)
class NoAnswer:
    """Why a case gave no answer: `verdict` is one of NO_ANSWER, `error` one sentence."""

    verdict: str
    error: str

    @property
    def row(self) -> CaseRow:
        """Its entries in the row of the case."""
        return {"verdict": self.verdict, "error": self.error}


LOST = NoAnswer(
    ERROR,
    "the system ended the process that worked on it, perhaps for want of memory; fewer workers have more each.",
)
"""Answer of a case whose process was ended from outside."""
NO_TIME: CaseRow = {"processor_s": 0.0, "ours_s": 0.0}
"""Entries of a row in place of those of a stopwatch that was lost with its process."""


def answer_of(look: Callable[[], T], limit_s: float | None) -> T | NoAnswer:
    """What `look` returns; NoAnswer where it raises AesiError or uses more than limit_s processor seconds."""
    try:
        with processor_limit(limit_s):
            return look()
    except AesiError as error:
        return NoAnswer(ERROR, str(error))
    except OutOfTime:
        return NoAnswer(OUT_OF_TIME, f"more than {limit_s:g} s of processor time")


@dataclass(frozen=True)
class Stopwatch:
    """Processor seconds of this process and wall-clock seconds, since its creation."""

    processor_began: float = field(default_factory=time.process_time)
    clock_began: float = field(default_factory=time.perf_counter)

    @property
    def row(self) -> CaseRow:
        """The seconds under their names in the row of a case."""
        return {
            "processor_s": time.process_time() - self.processor_began,
            "ours_s": time.perf_counter() - self.clock_began,
        }
