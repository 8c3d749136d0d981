"""A voltage that is written later or earlier than the current that it answers to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from aesi.data.channels.checks import Columns, Context
from aesi.data.channels.load_columns import keep_rows
from aesi.numerics.typing import Array, IntArray

MOST_LAG_S = 60.0
"""Longest lag between the channels that is looked for: of two loggers that were started by hand, or whose clocks are
set by hand. A convention."""
LAG_CORRELATION = 0.5
"""Least magnitude of the correlation of the steps of current and voltage at a lag that is taken for one. In 249
measured and virtual records and 10 min of each it is 0.69 or more at lags of a row of 0.1 s, which 110 of these have,
and at most 0.27 at any other lag of those with LAG_STEPS."""
LAG_STEPS = 10.0
"""Least number of steps of the current that a lag is told from, as the square of the sum of their squares over the sum
of their fourth powers: a record of two steps has 2, and is like another one at the distance of these."""
LAG_DEVIATIONS = 5.0
"""Least correlation at a lag, in standard deviations of that of as many independent steps. One of 120 lags of a noise
is beyond it in one of 14,000 rests."""
LAG_POINTS = 400_000
"""Most points of the even grid on which lags are looked for."""
LAG_ROWS = 1
"""Rows by which loggers may write a voltage apart from its current; a lag beyond them is told."""


class _Lag(NamedTuple):
    """Where the steps of current and voltage are most alike.

    late_s : by which the voltage is later than its current, s; negative where it is earlier.
    correlation, correlation_at_0 : of the steps at that lag, and without one.
    """

    late_s: float
    correlation: float
    correlation_at_0: float


def aligned(columns: Columns, context: Context) -> tuple[Columns, Context, list[str]]:
    """(columns in which each row has the voltage that answers to its current, their context, a note on a lag that is
    more than a row). Where the steps of the current tell no lag, the columns as they are."""
    lag = _lag(columns)
    if lag is None or not lag.late_s:
        return columns, context, []
    time_s = columns["time_s"]
    answer_s = time_s + lag.late_s
    kept = np.flatnonzero((answer_s >= time_s[0]) & (answer_s <= time_s[-1]))
    moved, where = keep_rows(columns, context, kept)
    moved["voltage_v"] = columns["voltage_v"][_nearest(time_s, answer_s[kept])]
    if abs(lag.late_s) <= (LAG_ROWS + 0.5) * float(np.median(np.diff(time_s))):
        return moved, where, []
    way = "late" if lag.late_s > 0.0 else "early"
    note = (
        f"Its voltage answers to the steps of its current {abs(lag.late_s):.3g} s too {way} (their correlation is "
        f"{lag.correlation:.2f} at that lag and {lag.correlation_at_0:.2f} without), as where two loggers or channels "
        "are out of step: what a model leaves there is not the cell's; shift one of the two columns by it."
    )
    return moved, where, [note]


def _lag(columns: Columns) -> _Lag | None:
    """The lag of the voltage, within MOST_LAG_S; None where the steps of the current do not tell."""
    time_s = columns["time_s"]
    grid_step_s = max(float(np.median(np.diff(time_s))), float(time_s[-1] - time_s[0]) / LAG_POINTS)
    grid_s = np.arange(time_s[0], time_s[-1], grid_step_s)
    current, voltage = (np.diff(np.interp(grid_s, time_s, columns[q])) for q in ("current_a", "voltage_v"))
    if not (voltage.any() and current.any()):
        return None
    squares = np.square(current)
    steps = float(squares.sum()) ** 2 / float(np.square(squares).sum())
    most = min(max(int(MOST_LAG_S / grid_step_s), LAG_ROWS), len(current) - 1)
    correlation = _correlation_by_lag(current, voltage, most)
    best = int(np.argmax(np.abs(correlation)))
    least = max(LAG_CORRELATION, LAG_DEVIATIONS / np.sqrt(steps))
    if steps < LAG_STEPS or abs(correlation[best]) <= least:
        return None
    return _Lag((best - most) * grid_step_s, float(correlation[best]), float(correlation[most]))


def _correlation_by_lag(current: Array, voltage: Array, most: int) -> Array:
    """(2 most + 1,) correlations of the steps (n,) of current and voltage, with the voltage -most to most points of the
    grid later; a step has no mean taken off."""
    padded = 1 << (len(current) + most).bit_length()  # without it the ends would meet
    spectrum = np.fft.rfft(voltage, padded) * np.conj(np.fft.rfft(current, padded))
    size = float(np.linalg.norm(current) * np.linalg.norm(voltage))
    return np.asarray(np.fft.irfft(spectrum, padded)[np.arange(-most, most + 1)] / size)


def _nearest(time_s: Array, at_s: Array) -> IntArray:
    """(m,) numbers of the rows (n,) that are nearest to times (m,)."""
    after = np.clip(np.searchsorted(time_s, at_s), 1, len(time_s) - 1)
    return np.where(at_s - time_s[after - 1] <= time_s[after] - at_s, after - 1, after)
