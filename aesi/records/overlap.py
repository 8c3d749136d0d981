"""Whether two records hold the same rows of one test, in whole or in part: one shifted in time, rounded, or thinned.

Rows are compared, not curves: a row is its current and voltage, rounded to the coarser of the two files' decimals.
Rows that each record has once, and both have, say by how much one clock is ahead of the other; where enough of them
say the same, all rows at common times are compared. A second test of the same protocol agrees in its currents, and not
in its voltages to their last digit. A record that was resampled or averaged has other rows, and is not told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array, IntArray
from aesi.records.measurement import Measurement

SAME_SHARE = 0.995
"""Of the rows at common times, that have to agree. Of the 3,761 pairs of 137 measured and virtual records of one cell
19 are the same test, or a part of it, in two archives, and agree in all rows; of all others 0.01 at most. Second cycles
of virtual cells under one protocol, in numbers as coarse as 10 mV, agree in 0.97."""
FEWEST_ROWS = 30
"""That each has once and that tell the same time, and that agree where current or voltage move: fewer are a seam
between two parts, or chance, and one pair of those others has so many."""
MOVES = 3.0
"""Of the last decimal, by which a row is another than the one before: rows of a voltage that slides by less are the
same in every cycle under one current."""
MOST_DECIMALS = 5
"""Of seconds, amperes and volts: more than a file of 4-byte numbers keeps."""
WHOLE = 1e-3
"""Of the last decimal, within which a number is written in so many: what a file in other units leaves of round-off."""
ROUNDED = 1.01
"""Of the last decimal of the times: by so much two clocks that were rounded may differ."""
HALF = 0.501
"""Of the coarser last decimal: what rounding one number takes off it, whichever way a program rounds its halves. With
the whole of it a second test agrees in 0.85 of its rows where both are rounded to 0.1 A and 10 mV, so in 0.45."""


@dataclass(frozen=True)
class Overlap:
    """What the second of two records shares with the first.

    rows, share : of the sparser's rows at common times, those that agree.  from_s, to_s : the second's times between
    which they lie.  ahead_s : by how much its clock is ahead.
    """

    rows: int
    share: float
    from_s: float
    to_s: float
    ahead_s: float


class Rows:
    """A record, with the decimals in which its columns are written."""

    def __init__(self, record: Measurement) -> None:
        self.time_s, self.current_a, self.voltage_v = record.time_s, record.current_a, record.voltage_v
        self.decimals = tuple(map(_decimals, (self.time_s, self.current_a, self.voltage_v)))
        self.step_s = float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else np.inf
        self._once: dict[tuple[int, int], tuple[IntArray, IntArray]] = {}

    def once(self, of_current: int, of_voltage: int) -> tuple[IntArray, IntArray]:
        """The rows, in so many decimals, that are there once: their keys in order, and where they are."""
        at = of_current, of_voltage
        if at not in self._once:
            known = np.flatnonzero(np.isfinite(self.voltage_v))
            current = np.round(self.current_a[known] * 10.0**of_current).astype(np.int64)
            voltage = np.round(self.voltage_v[known] * 10.0**of_voltage).astype(np.int64)
            keys, first, counts = np.unique(
                current * 10 ** (MOST_DECIMALS + 2) + voltage, return_index=True, return_counts=True
            )
            self._once[at] = keys[counts == 1], known[first[counts == 1]]
        return self._once[at]


def overlap(one: Rows, other: Rows) -> Overlap | None:
    """What two records share; None for two tests."""
    found = agreement(one, other)
    return None if found is None or found.share < SAME_SHARE else found


def agreement(one: Rows, other: Rows) -> Overlap | None:
    """How two records agree at the times on which most of the rows agree that both have once; None without enough."""
    if other.step_s < one.step_s:  # each row of the sparser is sought in the denser, not the other way round
        found = agreement(other, one)
        return None if found is None else _of_the_other(found)
    of_time, *digits = map(min, one.decimals, other.decimals)
    (our_keys, our_rows), (their_keys, their_rows) = one.once(*digits), other.once(*digits)
    _, ours, theirs = np.intersect1d(our_keys, their_keys, assume_unique=True, return_indices=True)
    if len(ours) < FEWEST_ROWS:
        return None
    close_s = ROUNDED * 10.0**-of_time
    ahead = np.sort(other.time_s[their_rows[theirs]] - one.time_s[our_rows[ours]])
    alike = np.searchsorted(ahead, ahead + close_s, side="right") - np.arange(len(ahead))
    first, most = int(alike.argmax()), int(alike.max())
    if most < FEWEST_ROWS:
        return None
    return _at(one, other, float(np.median(ahead[first : first + most])), close_s, digits)


def _of_the_other(found: Overlap) -> Overlap:
    times = found.from_s - found.ahead_s, found.to_s - found.ahead_s
    return Overlap(found.rows, found.share, *times, -found.ahead_s)


def _at(one: Rows, other: Rows, ahead_s: float, close_s: float, digits: list[int]) -> Overlap | None:
    """How the rows of two records agree, one clock being so much ahead of the other."""
    time = other.time_s - ahead_s
    after = np.clip(np.searchsorted(one.time_s, time), 1, len(one.time_s) - 1)
    row = after - (time - one.time_s[after - 1] < one.time_s[after] - time)
    there = np.abs(one.time_s[row] - time) <= close_s
    agree, moves = there.copy(), np.zeros(len(time), dtype=bool)
    for ours, theirs, digit in (
        (one.current_a, other.current_a, digits[0]),
        (one.voltage_v, other.voltage_v, digits[1]),
    ):
        agree &= np.abs(ours[row] - theirs) <= HALF * 10.0**-digit
        moves[1:] |= np.abs(np.diff(theirs)) > MOVES * 10.0**-digit
    rows = np.flatnonzero(agree)
    if int(np.sum(agree & moves)) < FEWEST_ROWS:
        return None
    begin, end = float(other.time_s[rows[0]]), float(other.time_s[rows[-1]])
    return Overlap(rows.size, rows.size / int(np.sum(there)), begin, end, ahead_s)


def _decimals(column: Array) -> int:
    """Digits behind the point in which a column (n,) is written, at most MOST_DECIMALS."""
    known = column[np.isfinite(column)]
    for digits in range(MOST_DECIMALS):
        scaled = known * 10.0**digits
        if np.all(np.abs(scaled - np.round(scaled)) < WHOLE):
            return digits
    return MOST_DECIMALS
