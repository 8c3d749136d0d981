"""What a pool of evaluating processes offers, and how an exception inside a candidate, or one for want of the memory
that it may take, fails that candidate alone.
"""

from __future__ import annotations

import os
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from aesi.errors import AesiError
from aesi.records import Failed

MEGABYTE = 1 << 20
Evaluate = Callable[[Any], Any]
"""A genome in, a Candidate or Failed out."""


class Pool(Protocol):
    """Processes or workers that evaluate candidates."""

    @property
    def idle(self) -> int:
        """Number of candidates that can be started now."""
        ...

    @property
    def busy(self) -> int:
        """Number of candidates that are started and not collected."""
        ...

    def start(self, tag: Any, genome: Any) -> None:
        """Start a candidate; its outcome carries the tag, which is not None."""
        ...

    def collect(self, timeout_s: float) -> list[tuple[Any, Any]]:
        """(tag, outcome) of the candidates that are done or lost, after at most `timeout_s`; an outcome is a Candidate
        or Failed."""
        ...

    def close(self) -> None:
        """End the processes, or leave the scheduler."""
        ...


def guarded(evaluate: Evaluate, genome: Any) -> Any:
    """Evaluate; whatever goes wrong inside one candidate is an outcome of that candidate."""
    try:
        return evaluate(genome)
    except AesiError as error:
        return Failed(str(error))
    except MemoryError:
        return Failed("ran out of memory (search.memory_mb)", of_machine=True)
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return Failed(
            f"{type(error).__name__}: {error} (in {os.path.basename(where.filename)}:{where.lineno})"
        )


def limit_memory(memory_mb: float) -> int | None:
    """Let this process take that much address space beyond what it has (Linux); the limit before in bytes, None where
    it is left as it is."""
    if sys.platform != "linux":
        return None
    import resource

    with open("/proc/self/statm") as statm:
        now = int(statm.read().split()[0]) * resource.getpagesize()
    limit = now + int(memory_mb * MEGABYTE)
    before, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard != resource.RLIM_INFINITY and limit >= hard:
        return None
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    return before


class MemoryOfThreads:
    """The limit of a process whose threads evaluate, and which does other things between: it holds while any does."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._before: int | None = None

    @contextmanager
    def limited(self, memory_mb: float, threads: int) -> Iterator[None]:
        """Within, the process may take that much for each of its threads beyond what it has."""
        with self._lock:
            if not self._inside:
                self._before = limit_memory(threads * memory_mb)
            self._inside += 1
        try:
            yield
        finally:
            with self._lock:
                self._inside -= 1
                if not self._inside:
                    self._restore()

    def _restore(self) -> None:
        if self._before is None:
            return
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (self._before, resource.getrlimit(resource.RLIMIT_AS)[1]))
