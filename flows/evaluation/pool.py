"""What a pool of evaluating processes offers, and how an exception inside a candidate fails that candidate alone."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable
from typing import Any, Protocol

from aesi.errors import AesiError
from aesi.records import Failed

Evaluate = Callable[[Any], Any]
"""A genome in, a Candidate or Failed out."""


class Pool(Protocol):
    """Who evaluates: `idle` candidates can be started at once; `collect` waits for finished ones."""

    @property
    def idle(self) -> int: ...

    @property
    def busy(self) -> int: ...

    def start(self, tag: Any, genome: Any) -> None: ...

    def collect(self, timeout_s: float) -> list[tuple[Any, Any]]: ...

    def close(self) -> None: ...


def guarded(evaluate: Evaluate, genome: Any) -> Any:
    """Evaluate; whatever goes wrong inside one candidate is an outcome of that candidate."""
    try:
        return evaluate(genome)
    except AesiError as error:
        return Failed(str(error))
    except MemoryError:
        return Failed("ran out of memory (search.memory_mb)")
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return Failed(
            f"{type(error).__name__}: {error} (in {os.path.basename(where.filename)}:{where.lineno})"
        )
