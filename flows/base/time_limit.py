"""Work that is interrupted after a time."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

AT_ONCE_S = 1e-6
"""Shortest time of a timer, which 0 would stop."""


class Overdue(BaseException):
    """The time of a limit is over, on its way out of the block that has it, where it becomes an error with a reason.

    No Exception, since work that goes on without what fails (a study's copy, a candidate, an artifact) would take it
    for such a failure and go on without a limit.
    """


@contextmanager
def time_limit(seconds: float | None, late: Callable[[], Exception]) -> Iterator[None]:
    """Interrupt the block after so many seconds, and raise `late()` then; compiled code is interrupted when it returns.

    Limits nest: within an inner block the outer time runs on, and what ends it is raised through the inner one, which
    gives no reason of its own.
    There is no limit where `seconds` is None, none outside the main thread, which alone gets signals, and none on
    Windows, which has no such signal.
    """
    unheard = threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGALRM")
    if seconds is None or unheard:
        yield
        return

    ours, due, over = Overdue(), time.monotonic() + seconds, False
    outer = signal.getsignal(signal.SIGALRM)
    outer_s = signal.getitimer(signal.ITIMER_REAL)[0]
    outer_due = time.monotonic() + outer_s if outer_s > 0.0 else float("inf")

    def overdue(number: int, frame: FrameType | None) -> None:
        nonlocal outer_due
        if over:  # it rang while the block was left: the outer time, if it was that, is set again behind
            return
        if outer_due < due:
            outer_due = float("inf")
            _set_timer(due)
            if callable(outer):
                outer(number, frame)
            return
        raise ours

    try:
        try:
            signal.signal(signal.SIGALRM, overdue)
            _set_timer(min(due, outer_due))
            yield
        finally:
            over = True
    except Overdue as one:
        if one is not ours:
            raise
        raise late() from None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, outer)
        if outer_due < float("inf"):
            _set_timer(outer_due)


def _set_timer(due: float) -> None:
    """Let the alarm ring at a time of `time.monotonic`, at once where that has passed."""
    signal.setitimer(signal.ITIMER_REAL, max(due - time.monotonic(), AT_ONCE_S))
