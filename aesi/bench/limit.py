"""A limit on the processor seconds of one piece of work, and what a benchmark says of a case that gave no answer."""

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
"""Verdicts of cases that gave no answer."""
NOT_RUN = "not run"
"""Verdict of a case whose data cannot be had: it is counted, and in no figure."""


class OutOfTime(BaseException):
    """The processor seconds are used up. No Exception, so that no clause for errors of a fit takes it for one."""


@contextmanager
def processor_limit(seconds: float | None) -> Iterator[None]:
    """Raise OutOfTime in the body once it has used so many processor seconds; None sets no limit.

    Held where the body runs in the main thread of its process, on systems with interval timers; elsewhere (threads of
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
        """What the row of the case says of it."""
        return {"verdict": self.verdict, "error": self.error}


LOST = NoAnswer(
    ERROR,
    "the system ended the process that worked on it, perhaps for want of memory; fewer workers have more each.",
)
"""Of a case whose process was ended from outside."""
NO_TIME: CaseRow = {"processor_s": 0.0, "ours_s": 0.0}
"""What a row has in the place of a stopwatch's that was lost with its process."""


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
    """Processor seconds of this process and seconds by the clock, since it was made."""

    processor_began: float = field(default_factory=time.process_time)
    clock_began: float = field(default_factory=time.perf_counter)

    @property
    def row(self) -> CaseRow:
        """As the row of a case names them."""
        return {
            "processor_s": time.process_time() - self.processor_began,
            "ours_s": time.perf_counter() - self.clock_began,
        }
