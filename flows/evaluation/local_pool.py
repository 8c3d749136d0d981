"""Processes that evaluate candidates and may be lost: a hang, a crash or a memory hog costs one candidate.

On Linux they are forks, so the problem (the library, its Gram matrices) is shared, not copied, and replacing
a lost process costs milliseconds. Elsewhere each builds the problem for itself.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from aesi.records import Failed
from flows.base.interrupt import leaving_interrupts_to_us
from flows.evaluation.pool import Evaluate, guarded, limit_memory

WATCH_S = 1.0
"""Interval between checks of a worker's memory and of its parent, s."""


@dataclass
class _Process:
    """A process of the pool and its end of the pipe.

    tag : of the candidate that it evaluates, None where it is idle.  built : whether it has built the evaluating
    function.  deadline_s : time on the monotonic clock by which the candidate has to be done, s; None while the process
    still builds."""

    process: Any
    pipe: Connection
    tag: Any = None
    built: bool = False
    deadline_s: float | None = None

    @property
    def busy(self) -> bool:
        return self.tag is not None


class LocalPool:
    """`workers` processes of this machine.

    build : makes the evaluating function, inside the process.
    timeout_s : wall time after which a candidate has failed and its process is replaced, from when that has built.
    memory_mb : address space a process may take beyond what it starts with (Linux).
    """

    def __init__(
        self, build: Callable[[], Evaluate], workers: int, timeout_s: float, memory_mb: float
    ) -> None:
        method = "fork" if sys.platform == "linux" else "spawn"
        self._context = multiprocessing.get_context(method)
        self._build = build
        self._timeout_s = timeout_s
        self._memory_mb = memory_mb
        self._processes = [self._spawn() for _ in range(workers)]

    @property
    def idle(self) -> int:
        return sum(not process.busy for process in self._processes)

    @property
    def busy(self) -> int:
        return len(self._processes) - self.idle

    def start(self, tag: Any, genome: Any) -> None:
        """Evaluate the genome in an idle process; its outcome will carry the tag, anything but None."""
        for i, one in enumerate(self._processes):
            if one.busy:
                continue
            try:
                one.pipe.send(genome)
            except OSError:  # it died while idle
                one = self._processes[i] = self._replace(one)
                one.pipe.send(genome)
            one.tag = tag
            if one.built:
                one.deadline_s = time.monotonic() + self._timeout_s
            return
        raise RuntimeError("no process is idle; collect before starting more")

    def collect(self, timeout_s: float) -> list[tuple[Any, Any]]:
        """(tag, outcome) of what has finished or been lost, after at most `timeout_s`."""
        busy = [one for one in self._processes if one.busy]
        if not busy:
            return []
        now = time.monotonic()
        left_s = [one.deadline_s - now for one in busy if one.deadline_s is not None]
        ready = wait([one.pipe for one in busy], timeout=max(0.0, min([timeout_s, *left_s])))
        found = []
        for i, one in enumerate(self._processes):
            if one.pipe in ready:
                found += self._received(i, one)
            elif one.deadline_s is not None and time.monotonic() >= one.deadline_s:
                found.append((one.tag, Failed(f"took longer than {self._timeout_s:g} s", of_machine=True)))
                self._processes[i] = self._replace(one)
        return found

    def close(self) -> None:
        """End all processes at once; what they worked on is lost."""
        for one in self._processes:
            _end(one)
        self._processes = []

    def _received(self, i: int, one: _Process) -> list[tuple[Any, Any]]:
        """(tag, outcome) of the candidate that process `i` has finished or was lost with; empty where its message says
        that it has built the evaluating function."""
        tag = one.tag
        try:
            message = one.pipe.recv()
        except (EOFError, OSError):
            one.process.join(5)
            self._processes[i] = self._replace(one)
            return [
                (tag, Failed(f"its process was lost ({_exit_words(one.process.exitcode)})", of_machine=True))
            ]
        if not one.built:
            one.built, one.deadline_s = True, time.monotonic() + self._timeout_s
            return []
        one.tag, one.deadline_s = None, None
        return [(tag, message)]

    def _replace(self, one: _Process) -> _Process:
        _end(one)
        return self._spawn()

    def _spawn(self) -> _Process:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(
            target=_serve, args=(theirs, self._build, self._memory_mb, os.getpid()), daemon=True
        )
        with warnings.catch_warnings(), leaving_interrupts_to_us(), _leaving_objects_to_us():
            # The forks run numpy code alone and leave by os._exit, so locks of other threads do not matter.
            warnings.simplefilter("ignore", DeprecationWarning)
            process.start()
        theirs.close()
        return _Process(process, ours)


@contextmanager
def _leaving_objects_to_us() -> Iterator[None]:
    """Forks made within never look for garbage among what is there now: what our other threads hold is out of reach in
    them and would end there, aloud where it was at work (Prefect's services), and the pages would no longer be shared.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _serve(pipe: Connection, build: Callable[[], Evaluate], memory_mb: float, parent: int) -> None:
    """Life of a process: build and say so, then one genome in and one outcome out, until the other end is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it is not held back
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_exit_with_parent, args=(parent,), daemon=True).start()
    limit_memory(memory_mb)
    evaluate = build()
    try:
        pipe.send(None)
        while True:
            genome = pipe.recv()
            pipe.send(guarded(evaluate, genome))
    except (EOFError, OSError):
        os._exit(0)


def _exit_with_parent(parent: int) -> None:
    """A killed parent cannot tell its children; they notice that they were adopted."""
    while os.getppid() == parent:
        time.sleep(WATCH_S)
    os._exit(1)


def _end(one: _Process) -> None:
    one.pipe.close()
    if one.process.is_alive():
        one.process.kill()
    one.process.join(5)


def _exit_words(exitcode: int | None) -> str:
    if exitcode is not None and exitcode < 0:
        name = signal.Signals(-exitcode).name
        return f"{name}, perhaps out of memory" if name == "SIGKILL" else name
    return f"exit code {exitcode}"
