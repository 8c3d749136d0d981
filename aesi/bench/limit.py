"""A limit on the processor seconds of one piece of work."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


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
