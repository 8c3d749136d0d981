"""A failure that a search or a fit expects, as a value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

MOST_TOLD = 3
"""Reasons that a sentence lists."""


@dataclass(frozen=True)
class Failed:
    """An expected failure inside a search or a fit: a value, not an exception.

    of_machine : a process that was lost, or time or memory that ran out, which another run may not meet.
    """

    reason: str
    time_s: float | None = None
    of_machine: bool = False


def counted(reasons: Mapping[str, int]) -> str:
    """Reasons of failures with how many each had, the most frequent first and alone where there are many."""
    frequent = sorted(reasons.items(), key=lambda item: -item[1])
    told = [f"{count} x {reason}" for reason, count in frequent[:MOST_TOLD]]
    others = sum(count for _, count in frequent[MOST_TOLD:])
    return "; ".join([*told, *([f"{others} x something else"] if others else [])])


def candidates_failed(failed: Mapping[str, int], evaluated: int) -> list[str]:
    """A sentence on the candidates of a search that failed; none where none did.  failed : reason -> how many."""
    total = sum(failed.values())
    return [f"{total} of {evaluated} candidates failed: {counted(failed)}."] if total else []
