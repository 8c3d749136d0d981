"""Whether two records are one test on other times: the rows of one between those of the other.

A program that brings a record to another step writes straight lines between its rows, the row before, after or nearest,
means over the rows of a step, or means over its time, as `aesi.data.to_even` and `decimate` do: of the voltage in
straight lines, and of a current that is held or straight. Each is made again of one record at the times of the other,
with both clocks alike, or both beginning at their first rows, and compared where the current moves or the voltage
bends, to the coarser of the two files' decimals: along a smooth slide two tests of one kind are alike. So a smooth
slide alone is not told, nor a part that was resampled and whose clock was moved as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records.rows import FEWEST_ROWS, MOVES, Overlap, Rows

RESAMPLED_SHARE = 0.95
"""Share of the telling rows that has to agree. Of 3,157 pairs of 128 measured and virtual records of one cell eight are
one test in two archives and agree in all; the others in 0.02 at most, in 0.39 where one is read off straight lines
every 60 s in 0.01 A and 1 mV, and in 0.21 where one is means over 60 s. The 128, each resampled to 0.7, 2.5 and 10
times its step, agree with themselves in all rows, in 0.93 at least of means over 10 steps (below this 2 of 113)."""
FINEST_V_DECIMALS = 3
"""Of both voltages, at the least: in 10 mV and 0.1 A two tests of one highway drive agree in 0.86 of such rows."""
ROUNDED_TWICE = 1.01
"""Of the last decimal: what rounding takes off a number and off what it is made of."""
PROBED = 60
"""Rows that are looked at first, evenly spread, and the share of them that may go on to all."""
PROBED_SHARE = 0.8
MEANS_FROM = 1.5
"""Times the step of the finer record, from which the coarser may be means of it."""
EDGE = 1e-6
"""Share of a step within which a row is at a time of the other record, or on the edge of a mean."""
Ways = Callable[[Rows, Rows, Array, IntArray, list[int]], Iterator[BoolArray]]
"""One array for each way to resample."""


def resampled(one: Rows, other: Rows) -> Overlap | None:
    """What two records share where the rows of one lie between those of the other; None for two tests."""
    digits = [min(pair) for pair in zip(one.decimals[1:], other.decimals[1:], strict=True)]
    if digits[1] < FINEST_V_DECIMALS or min(len(one.time_s), len(other.time_s)) < FEWEST_ROWS:
        return None
    found = _sought_between(one, other, digits)
    if found is None:
        found = _sought_between(other, one, digits)
        return None if found is None else found.reversed()
    return found


def _sought_between(one: Rows, other: Rows, digits: list[int]) -> Overlap | None:
    """The rows of `other` sought between those of `one`; None where too few agree."""
    telling = _telling(other, digits)
    for ahead_s in sorted({0.0, float(other.time_s[0] - one.time_s[0])}):
        time = other.time_s - ahead_s
        inside = np.flatnonzero(telling & (time >= one.time_s[0]) & (time <= one.time_s[-1]))
        after = np.clip(np.searchsorted(one.time_s, time[inside]), 1, len(one.time_s) - 1)
        apart = np.minimum(
            np.abs(one.time_s[after] - time[inside]), np.abs(time[inside] - one.time_s[after - 1])
        )
        # A row at a time of the other is made of none but that, and is compared more sharply where rows are shared.
        for ways, rows in ((_between, inside[apart > EDGE * one.step_s]), (_averaged, inside)):
            found = _agreement(one, other, time, rows, digits, ways)
            if found is not None:
                return replace(found, ahead_s=ahead_s)
    return None


def _agreement(
    one: Rows, other: Rows, time_s: Array, rows: IntArray, digits: list[int], ways: Ways
) -> Overlap | None:
    """What the two share by the best of these ways to resample; None where that is too little."""
    if len(rows) < FEWEST_ROWS:
        return None
    probed = rows[np.unique(np.linspace(0, len(rows) - 1, PROBED).astype(int))]
    shares = [float(agree.mean()) for agree in ways(one, other, time_s, probed, digits)]
    if max(shares, default=0.0) < PROBED_SHARE:
        return None
    agree = list(ways(one, other, time_s, rows, digits))[int(np.argmax(shares))]
    share, told = float(agree.mean()), other.time_s[rows[agree]]
    if share < RESAMPLED_SHARE or len(told) < FEWEST_ROWS:
        return None
    return Overlap(len(told), share, float(told[0]), float(told[-1]), 0.0, resampled=True)


def _telling(rows: Rows, digits: list[int]) -> BoolArray:
    """(n,) True where the current moves or the voltage bends, by more than their decimals."""
    of_current, of_voltage = digits
    bends = np.zeros(len(rows.time_s), dtype=bool)
    bends[1:] = np.abs(np.diff(rows.current_a)) > MOVES * 10.0**-of_current
    bends[2:] |= np.abs(np.diff(rows.voltage_v, 2)) > MOVES * 10.0**-of_voltage
    return np.asarray(bends & rows.moving(*digits) & np.isfinite(rows.voltage_v))


def _between(one: Rows, other: Rows, time_s: Array, rows: IntArray, digits: list[int]) -> Iterator[BoolArray]:
    """(rows,) which rows of `other` lie on straight lines between those of `one`; which are the one before or after."""
    at, wanted = time_s[rows], (other.current_a[rows], other.voltage_v[rows])
    before = np.clip(np.searchsorted(one.time_s, at, side="right") - 1, 0, len(one.time_s) - 2)
    share = (at - one.time_s[before]) / (one.time_s[before + 1] - one.time_s[before])
    ends = [(column[before], column[before + 1]) for column in (one.current_a, one.voltage_v)]
    lines = [low + share * (high - low) for low, high in ends]
    yield _equal(lines, wanted, digits)
    yield _equal([low for low, _ in ends], wanted, digits) | _equal(
        [high for _, high in ends], wanted, digits
    )
    held, _ = _means_in_time(one, at - other.step_s, other.step_s)
    yield _equal([held[0], lines[1]], wanted, digits)


def _averaged(
    one: Rows, other: Rows, time_s: Array, rows: IntArray, digits: list[int]
) -> Iterator[BoolArray]:
    """(rows,) which rows of `other` are means of those of `one` over a step, that ends, begins or lies around them."""
    if other.step_s <= MEANS_FROM * one.step_s:
        return
    at, wanted = time_s[rows], (other.current_a[rows], other.voltage_v[rows])
    for begin in (0.0, -other.step_s, -0.5 * other.step_s):
        yield np.any([_equal(mean, wanted, digits) for mean in _means(one, other.step_s, at + begin)], axis=0)
        for mean in _means_in_time(one, at + begin, other.step_s):
            yield _equal(mean, wanted, digits)


def _means(one: Rows, step_s: float, begin_s: Array) -> Iterator[list[Array]]:
    """Current and voltage (rows,) of `one` in the mean of its rows in a step, with the first, the last or both of the
    rows on its edges; NaN without any."""
    edges = [
        (np.searchsorted(one.time_s, at - EDGE * step_s), np.searchsorted(one.time_s, at + EDGE * step_s))
        for at in (begin_s, begin_s + step_s)
    ]
    for first, last in ((0, 0), (1, 1), (0, 1)):
        begin, end = edges[0][first], edges[1][last]
        count = np.where(end > begin, end - begin, np.nan)
        yield [(sums[end] - sums[begin]) / count for sums in one.sums]


def _means_in_time(one: Rows, begin_s: Array, step_s: float) -> tuple[list[Array], list[Array]]:
    """Current and voltage (rows,) of `one` in the mean of the time of a step, with the current held since the row
    before, and straight between rows; the voltage is straight in both."""
    ends = zip(one.areas_at(begin_s), one.areas_at(begin_s + step_s), strict=True)
    held, *straight = ((end - begin) / step_s for begin, end in ends)
    return [held, straight[1]], straight


def _equal(made: list[Array], wanted: tuple[Array, Array], digits: list[int]) -> BoolArray:
    """(rows,) whether current and voltage are those, whichever way the current is written to flow."""
    allowed_a, allowed_v = (ROUNDED_TWICE * 10.0**-digit for digit in digits)
    way = float(np.sign(np.nansum(made[0] * wanted[0]))) or 1.0
    same: BoolArray = np.abs(way * made[0] - wanted[0]) <= allowed_a
    return same & (np.abs(made[1] - wanted[1]) <= allowed_v)
