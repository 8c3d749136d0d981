"""What is told when machine code is not on disk and is made, which takes a minute: nothing, unless somebody asks.

A module of its own, so that a command can ask before numba is imported.
"""

from __future__ import annotations

from collections.abc import Callable

_asked: list[Callable[[], None]] = []


def tell_compiling(tell: Callable[[], None]) -> None:
    """Call `tell` the first time that something is compiled, in this process."""
    _asked[:] = [tell]


def compiling() -> None:
    """Something is compiled now."""
    while _asked:
        _asked.pop()()
