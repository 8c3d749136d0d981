"""Assignment of the measured rows of a record to the steps of an even grid.

Step k ends at stamp k and begins after the stamp before it; a row at a stamp, within `TOLERANCE`, is in the step that
ends there. The grid begins at the first row, and rows after its last stamp are assigned to that one.
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.typing import Array, BoolArray, IntArray

MOST_STEP = 1.5
"""Rows no further apart than this many steps count as a row a step: loggers' stamps wander by less. A convention."""
TOLERANCE = 1e-6
"""Share of a step to which rows lie at even stamps; times are written with as many digits."""


def after_gap(time_s: Array, dt_s: float) -> BoolArray:
    """(n,) True for a row with none a step of dt_s before it."""
    return np.concatenate([[False], np.diff(time_s) > MOST_STEP * dt_s])


def known_by(time_s: Array, values: Array, stamps_s: Array) -> Array:
    """(m,) a slow quantity as it is known at each stamp: the average over the rows since the stamp before, and the last
    row's value where there are none. No value depends on a later row.

    time_s, values : (n,) of the rows.  stamps_s : (m,) even, the first at the first row or later.
    """
    last = rows_until(time_s, stamps_s)
    first = np.append(0, last[:-1])
    sums = np.append(0.0, np.cumsum(values))
    return np.where(last > first, (sums[last] - sums[first]) / np.maximum(last - first, 1), values[last - 1])


def next_stamp(time_s: Array, stamps_s: Array) -> IntArray:
    """(n,) number of the first of the even stamps (m,) at or after each row; the last stamp for rows after it."""
    found = np.searchsorted(stamps_s + _slack_s(stamps_s), time_s)
    return np.minimum(found, len(stamps_s) - 1)


def rows_until(time_s: Array, stamps_s: Array) -> IntArray:
    """(m,) number of the rows (n,) at or before each of the even stamps."""
    return np.searchsorted(time_s, stamps_s + _slack_s(stamps_s), side="right")


def _slack_s(stamps_s: Array) -> float:
    """Largest distance of a row from a stamp, s, within which it is at the stamp."""
    return TOLERANCE * float(stamps_s[1] - stamps_s[0]) if len(stamps_s) > 1 else 0.0
