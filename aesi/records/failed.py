"""A failure that a search or a fit expects, as a value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Failed:
    """An expected failure inside a search or a fit: a value, not an exception."""

    reason: str
    time_s: float | None = None
