"""Work that is interrupted after a time."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Overdue(BaseException):
    """The time is over. It names no reason: whoever set the limit knows what took too long, and catches it.

    No Exception, since work that goes on without what fails (a study's copy, a candidate, an artifact) would take it
    for such a failure and go on without a limit.
    """


@contextmanager
def time_limit(seconds: float | None) -> Iterator[None]:
    """Raise Overdue within the block after so many seconds; compiled code is interrupted when it returns.

    There is no limit where `seconds` is None, none outside the main thread, which alone gets signals, and none on
    Windows, which has no such signal.
    """
    unheard = threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGALRM")
    if seconds is None or unheard:
        yield
        return

    def overdue(number: int, frame: FrameType | None) -> None:
        raise Overdue

    before = signal.signal(signal.SIGALRM, overdue)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
