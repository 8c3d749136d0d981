"""The significant digits of a number."""

from __future__ import annotations

from math import floor, log10


def resolving(value: float, low: float, high: float, least: int = 3) -> int:
    """Significant digits that show the width of an interval to two, between `least` and six."""
    if not high > low:
        return least
    largest = max(abs(low), abs(high), abs(value))
    return min(6, max(least, 2 + floor(log10(largest)) - floor(log10(high - low))))


def decimals(largest: float) -> int:
    """Number of decimals with which numbers up to `largest` in magnitude have three significant digits; 0 for 0."""
    return max(0, 2 - floor(log10(largest))) if largest > 0.0 else 0
