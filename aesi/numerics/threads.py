"""Side by side in threads: for work whose time goes to compiled code, which does not hold the interpreter's lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Given = TypeVar("Given")
Made = TypeVar("Made")


def side_by_side(do: Callable[[Given], Made], items: Iterable[Given]) -> Iterator[Made]:
    """`do` of each, in the order given, so that what is made of it does not depend on how many threads there are. What
    has not begun is left undone where the caller takes no more."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from pool.map(do, items)
