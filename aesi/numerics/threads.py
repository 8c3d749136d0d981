"""Parallel threads, for work that is mostly in compiled code, which releases the interpreter's lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Given = TypeVar("Given")
Made = TypeVar("Made")


def side_by_side(do: Callable[[Given], Made], items: Iterable[Given]) -> Iterator[Made]:
    """Yield `do(item)` for each item, in the order given, so that results do not depend on the number of threads. Calls
    that have not begun are cancelled when the caller stops iterating."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from pool.map(do, items)
