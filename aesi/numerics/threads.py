"""Parallel threads, for work that is mostly in compiled code, which releases the interpreter's lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Argument = TypeVar("Argument")
Returned = TypeVar("Returned")


def side_by_side(function: Callable[[Argument], Returned], items: Iterable[Argument]) -> Iterator[Returned]:
    """Yield `function(item)` for each item, in the order given, so that results do not depend on the number of threads.
    Calls that have not begun are cancelled when the caller stops iterating."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from pool.map(function, items)
