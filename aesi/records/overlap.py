"""Whether two records hold the same rows of one test, in whole or in part: one shifted in time, rounded, thinned,
resampled, or with the other sign of its current.

Rows are compared, not curves: a row is its current and voltage, rounded to the coarser of the two files' decimals.
Rows that each record has once, and both have, say by how much one clock is ahead of the other; where enough of them
say the same, all rows at common times are compared. A second test of the same protocol agrees in its currents, and not
in its voltages to their last digit. Rows between those of the other are in `aesi.records.resampled`.
"""

from __future__ import annotations

import numpy as np

from aesi.records.resampled import resampled
from aesi.records.rows import FEWEST_ROWS, Overlap, Rows

SAME_SHARE = 0.995
"""Of the rows at common times, that have to agree. Of the 3,761 pairs of 137 measured and virtual records of one cell
19 are the same test, or a part of it, in two archives, and agree in all rows; of all others 0.01 at most. Second cycles
of virtual cells under one protocol, in numbers as coarse as 10 mV, agree in 0.97."""
ROUNDED = 1.01
"""Of the last decimal of the times: by so much two clocks that were rounded may differ."""
CLOCK_DECIMALS = 9
"""Of seconds, far finer than any time is written: the difference of two equal times may leave round-off."""
HALF = 0.501
"""Of the coarser last decimal: what rounding one number takes off it, whichever way a program rounds its halves. With
the whole of it a second test agrees in 0.85 of its rows where both are rounded to 0.1 A and 10 mV, so in 0.45."""


def overlap(one: Rows, other: Rows) -> Overlap | None:
    """What two records share; None for two tests."""
    found = agreement(one, other)
    return resampled(one, other) if found is None or found.share < SAME_SHARE else found


def agreement(one: Rows, other: Rows) -> Overlap | None:
    """How two records agree, with the clock offset on which most of their common unique rows agree; None where too few
    do."""
    if other.step_s < one.step_s:  # each row of the sparser is sought in the denser, not the other way round
        found = agreement(other, one)
        return None if found is None else found.reversed()
    of_time, *digits = map(min, one.decimals, other.decimals)
    (our_keys, our_rows), (their_keys, their_rows) = one.unique_rows(*digits), other.unique_rows(*digits)
    _, ours, theirs = np.intersect1d(our_keys, their_keys, assume_unique=True, return_indices=True)
    if len(ours) < FEWEST_ROWS:
        return None
    close_s = ROUNDED * 10.0**-of_time
    ahead = np.sort(other.time_s[their_rows[theirs]] - one.time_s[our_rows[ours]])
    alike = np.searchsorted(ahead, ahead + close_s, side="right") - np.arange(len(ahead))
    first, most = int(alike.argmax()), int(alike.max())
    if most < FEWEST_ROWS:
        return None
    ahead_s = round(float(np.median(ahead[first : first + most])), CLOCK_DECIMALS)
    return _agreement_at(one, other, ahead_s, close_s, digits)


def _agreement_at(
    one: Rows, other: Rows, ahead_s: float, close_s: float, digits: list[int]
) -> Overlap | None:
    """How the rows of two records agree for a clock offset of `ahead_s`; None where too few of those that move do.

    close_s : largest difference of two times that count as one.  digits : decimals of current and voltage.
    """
    time = other.time_s - ahead_s
    after = np.clip(np.searchsorted(one.time_s, time), 1, len(one.time_s) - 1)
    row = after - (time - one.time_s[after - 1] < one.time_s[after] - time)
    there = np.abs(one.time_s[row] - time) <= close_s
    current = np.abs(np.abs(one.current_a[row]) - np.abs(other.current_a))
    voltage = np.abs(one.voltage_v[row] - other.voltage_v)
    agree = there & (current <= HALF * 10.0 ** -digits[0]) & (voltage <= HALF * 10.0 ** -digits[1])
    rows = np.flatnonzero(agree)
    if int(np.sum(agree & other.moving(*digits))) < FEWEST_ROWS:
        return None
    begin, end = float(other.time_s[rows[0]]), float(other.time_s[rows[-1]])
    return Overlap(rows.size, rows.size / int(np.sum(there)), begin, end, ahead_s)
