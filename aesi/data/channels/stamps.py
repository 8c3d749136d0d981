"""Times that are possible in s but more likely in another unit, and a voltage whose times are not its current's."""

from __future__ import annotations

import numpy as np

from aesi.constants import MILLI
from aesi.data.channels.checks import Columns, Context
from aesi.data.channels.load_columns import keep_rows
from aesi.numerics.typing import Array, IntArray

QUICKEST_S = 5e-3
"""Median interval below which a note is given: measured records have at most 10 rows a second. With time in hours, rows
one second apart seem 0.28 ms apart, and rows ten seconds apart 2.8 ms."""
SERIAL_DAYS = (20_000.0, 80_000.0)
"""Dates as spreadsheets write them, in days since 1900: 1954 to 2119. A convention."""
LONGEST_TEST_D = 1000.0
"""Longest test with times in such days."""

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


def aligned(columns: Columns, context: Context) -> tuple[Columns, Context, list[str]]:
    """(columns in which each row has the voltage that answers to its current, their context, a note on a lag that is
    more than a row). Where the steps of the current tell no lag, the columns as they are."""
    lag_s, there, here = _lag(columns)
    if not lag_s:
        return columns, context, []
    time_s = columns["time_s"]
    kept = np.flatnonzero((time_s + lag_s >= time_s[0]) & (time_s + lag_s <= time_s[-1]))
    answers = _nearest(time_s, time_s[kept] + lag_s)
    moved, where = keep_rows(columns, context, kept)
    moved["voltage_v"] = columns["voltage_v"][answers]
    if abs(lag_s) <= (LAG_ROWS + 0.5) * float(np.median(np.diff(time_s))):
        return moved, where, []
    late = "late" if lag_s > 0.0 else "early"
    return (
        moved,
        where,
        [
            f"Its voltage answers to the steps of its current {abs(lag_s):.3g} s too {late} (their correlation is "
            f"{there:.2f} at that lag and {here:.2f} without), as where two loggers or channels are out of step: what "
            "a model leaves there is not the cell's; shift one of the two columns by it."
        ],
    )


def _lag(columns: Columns) -> tuple[float, float, float]:
    """(s by which the voltage is later than its current, the correlation of their steps at that lag, and without one);
    0 s where they do not tell."""
    time_s = columns["time_s"]
    step_s = max(float(np.median(np.diff(time_s))), float(time_s[-1] - time_s[0]) / LAG_POINTS)
    grid_s = np.arange(time_s[0], time_s[-1], step_s)
    current, voltage = (np.diff(np.interp(grid_s, time_s, columns[q])) for q in ("current_a", "voltage_v"))
    squares = np.square(current)
    if not (voltage.any() and current.any()):
        return 0.0, 0.0, 0.0
    steps = float(squares.sum()) ** 2 / float(np.square(squares).sum())
    size = float(np.linalg.norm(current) * np.linalg.norm(voltage))
    most = min(max(int(MOST_LAG_S / step_s), LAG_ROWS), len(current) - 1)
    padded = 1 << (len(current) + most).bit_length()  # without it the ends would meet
    spectrum = np.fft.rfft(voltage, padded) * np.conj(np.fft.rfft(current, padded))
    likeness = np.fft.irfft(spectrum, padded)[np.arange(-most, most + 1)] / size
    best = int(np.argmax(np.abs(likeness)))
    least = max(LAG_CORRELATION, LAG_DEVIATIONS / np.sqrt(steps))
    if steps < LAG_STEPS or abs(likeness[best]) <= least:
        return 0.0, 0.0, 0.0
    return (best - most) * step_s, float(likeness[best]), float(likeness[most])


def _nearest(time_s: Array, at_s: Array) -> IntArray:
    """(m,) numbers of the rows (n,) that are nearest to times (m,)."""
    after = np.clip(np.searchsorted(time_s, at_s), 1, len(time_s) - 1)
    return np.where(at_s - time_s[after - 1] <= time_s[after] - at_s, after - 1, after)


def longer_unit(time_s: Array) -> str:
    """The more likely unit of times (n,) that are too close for seconds, as `--unit time_s=` takes it."""
    if _of_a_spreadsheet(time_s):
        return "d"
    return "h, min or d"


def time_doubts(data: Columns) -> list[str]:
    """A note where rows are closer in time than cyclers write them; else empty."""
    step_s = float(np.median(np.diff(data["time_s"]))) if len(data["time_s"]) > 1 else np.inf
    if step_s >= QUICKEST_S:
        return []
    return [
        f"Its rows come every {MILLI * step_s:.3g} ms, quicker than cyclers write them; if the time is in another "
        f"unit: --unit time_s={longer_unit(data['time_s'])}."
    ]


def _of_a_spreadsheet(time_s: Array) -> bool:
    low, high = SERIAL_DAYS
    return bool(low < time_s[0] < high and time_s[-1] - time_s[0] < LONGEST_TEST_D)
