"""Ctrl-C ends a command within two seconds; so does a scheduler that ends it, or `timeout`.

Not where PyBaMM's solver makes the data of a virtual cell in this process: it lets no other code run until it returns,
after minutes for a record of hours.

What is worth keeping is on disk at every moment, and the next command closes a run that was cut off. So Prefect and
MLflow get TIDY_S seconds to end by themselves, and then the process and its children are ended.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

TIDY_S = 1.2
"""For a tidy end. Interrupted at six moments on a machine with four times as much to do as it has cores, commands took
0.1 to 0.5 s longer than this to stop their children and end."""
INTERRUPTED = 130
"""What shells return for a process that Ctrl-C ended."""
BY_SIGNAL = INTERRUPTED - signal.SIGINT
"""What they add to the number of the signal."""
HEARD = (signal.SIGINT, signal.SIGTERM)


_hearing = threading.Event()
_asked = threading.Event()
_told = threading.Event()
_ending = threading.Lock()
_kept: list[str] = []
_code = [INTERRUPTED]


@contextmanager
def kept_on_interrupt(sentence: str) -> Iterator[None]:
    """Within, Ctrl-C says this: what is kept, and how to go on."""
    _kept.append(sentence)
    try:
        yield
    finally:
        _kept.remove(sentence)


@contextmanager
def ending_soon_on_interrupt() -> Iterator[None]:
    """Within, the first Ctrl-C, or SIGTERM, interrupts and, after a moment, ends the process; a second one ends it at
    once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, _interrupt) for number in HEARD}
    _hearing.set()
    try:
        yield
    finally:
        if _asked.is_set():
            end_now()
        _hearing.clear()
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def hearing_signals_again() -> Iterator[None]:
    """Within, signals are heard as in `ending_soon_on_interrupt`, which it has to be within, whatever took its place.

    Prefect takes SIGTERM while a flow runs: it unwinds the flow first and sends the signal on when it is left, when
    how to go on is no longer known; where its server was ended too, it never does, and all ends in its traceback.
    """
    if not _hearing.is_set() or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, _interrupt) for number in HEARD}
    try:
        yield
    finally:
        if not _asked.is_set():
            for number, handler in before.items():
                signal.signal(number, handler)


@contextmanager
def leaving_interrupts_to_us() -> Iterator[None]:
    """Processes started within do not hear Ctrl-C, which reaches the whole group: who started them ends them.

    It is held back from their first instruction on, also while they import; here it comes as soon as the block ends.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def tell_interrupted() -> None:
    """Say, once and as the last line of this process, that it was interrupted.

    What the work at hand makes of losing its children and its server is no news, so nothing is shown after it.
    """
    if _told.is_set():
        return
    _told.set()
    start = "\n" if sys.stderr.isatty() else ""  # there the line holds ^C, and perhaps progress
    said = f"Stopped. {_kept[-1]}" if _kept else "Interrupted."
    os.write(2, f"{start}{said}\n".encode())  # print could be in the midst of another line, from a signal
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)


def _interrupt(number: int, frame: FrameType | None) -> None:
    if _asked.is_set():
        end_now()
    _asked.set()
    _code[0] = BY_SIGNAL + number
    tell_interrupted()
    threading.Thread(target=_end_later, daemon=True).start()
    raise KeyboardInterrupt


def _end_later() -> None:
    time.sleep(TIDY_S)
    end_now()


def end_now() -> None:
    """End the children (workers, Prefect's temporary server) and the process, without waiting for anything."""
    import psutil

    if not _ending.acquire(blocking=False):
        time.sleep(60.0)  # another thread is at it
    tell_interrupted()
    children = psutil.Process().children(recursive=True)
    for child in children:
        _signal(child, signal.SIGTERM)
    psutil.wait_procs(children, timeout=0.3)
    for child in children:
        _signal(child, signal.SIGKILL)
    os._exit(_code[0])


def _signal(child: object, number: int) -> None:
    import psutil

    try:
        child.send_signal(number)  # type: ignore[attr-defined]
    except psutil.Error:
        return  # it has ended by itself
