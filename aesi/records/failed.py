"""A failure that a search or a fit expects, as a value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Failed:
    """An expected failure inside a search or a fit: a value, not an exception.

    of_machine : a process that was lost, or time that ran out, which another run may not meet.
    """

    reason: str
    time_s: float | None = None
    of_machine: bool = False
