"""A limit on the processor time of one case of a benchmark, and the row of a case that gives no answer."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import TypeVar

from aesi.bench import CaseRow
from aesi.errors import AesiError

T = TypeVar("T")

ERROR, OUT_OF_TIME = "error", "out of time"
NO_ANSWER = (ERROR, OUT_OF_TIME)
"""Verdicts of cases that gave no answer: the tracer refused the records, or the processor time was used up."""
NOT_RUN = "not run"
"""Verdict of a case whose data are not available. The summary counts these cases, but no figure includes them."""


class OutOfTime(BaseException):
    """The processor time is used up. It derives from BaseException, so that no handler for the errors of a fit catches
    it."""


@contextmanager
def processor_limit(seconds: float | None) -> Iterator[None]:
    """Raise OutOfTime in the body of the `with` statement once it has used `seconds` of processor time.

    seconds : s; None sets no limit. The limit works in the main thread of a process, on systems with interval timers.
    Elsewhere (threads of Dask workers, Windows) the body runs without a limit.
    """
    here = threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer")
    if seconds is None or not here:
        yield
        return

    over = False

    def stop(number: int, frame: FrameType | None) -> None:
        if not over:  # raised while the block is left, it would leave the timer running
            raise OutOfTime

    before = signal.signal(signal.SIGPROF, stop)
    try:
        try:
            signal.setitimer(signal.ITIMER_PROF, seconds, 5.0)
            yield
        finally:
            over = True
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@dataclass(frozen=True)
class NoAnswer:
    """Why a case gave no answer.  verdict : one of NO_ANSWER.  error : the reason, one sentence."""

    verdict: str
    error: str

    @property
    def row(self) -> CaseRow:
        """The entries `verdict` and `error` of the case's row."""
        return {"verdict": self.verdict, "error": self.error}


LOST = NoAnswer(
    ERROR,
    "the system ended the process that worked on it, perhaps for want of memory; fewer workers have more each.",
)
"""Outcome of a case whose process was ended by the operating system."""
NO_TIME: CaseRow = {"processor_s": 0.0, "ours_s": 0.0}
"""Times of a case whose stopwatch was lost with its process; `timed` leaves it out."""


def answer_of(look: Callable[[], T], limit_s: float | None) -> T | NoAnswer:
    """The value of `look()`; NoAnswer if it raises AesiError or uses more than `limit_s` s of processor time (None: no
    limit)."""
    try:
        with processor_limit(limit_s):
            return look()
    except AesiError as error:
        return NoAnswer(ERROR, str(error))
    except OutOfTime:
        return NoAnswer(OUT_OF_TIME, f"more than {limit_s:g} s of processor time")


def timed(rows: Sequence[CaseRow]) -> list[CaseRow]:
    """The rows of the cases that were timed: not those whose stopwatch was lost."""
    return [row for row in rows if row["processor_s"] > NO_TIME["processor_s"]]


@dataclass(frozen=True)
class Stopwatch:
    """Processor time of this process and wall time since the stopwatch was created.

    Both attributes are the readings of the two clocks at that moment, s.
    """

    processor_began: float = field(default_factory=time.process_time)
    clock_began: float = field(default_factory=time.perf_counter)

    @property
    def row(self) -> CaseRow:
        """The elapsed times, s: `processor_s` (processor time of this process) and `ours_s` (wall time)."""
        return {
            "processor_s": time.process_time() - self.processor_began,
            "ours_s": time.perf_counter() - self.clock_began,
        }
