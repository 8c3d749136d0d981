"""A listener to the first compilation of machine code that is not on disk, which takes a minute.

A module of its own, so that a command can listen before numba is imported.
"""

from __future__ import annotations

from collections.abc import Callable

_listeners: list[Callable[[], None]] = []


def on_first_compilation(listener: Callable[[], None]) -> None:
    """Call `listener` once, at the first compilation in this process; it replaces an earlier one."""
    _listeners[:] = [listener]


def report_compilation() -> None:
    """Call the listener, if any, as code is compiled now."""
    while _listeners:
        _listeners.pop()()
