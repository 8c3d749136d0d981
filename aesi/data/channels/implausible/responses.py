"""What a voltage answers to its current: at the steps of the current, and while it stays constant."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.channels.checks import Columns
from aesi.data.channels.gaps import find_gaps
from aesi.numerics.typing import Array

STEP_SHARE = 0.05
"""A step of the current counts where it is above this share of the largest step; ENOUGH_STEPS of them are needed."""
ENOUGH_STEPS = 5
CLEAR_CORRELATION = 0.5
"""Magnitude of the correlation of current and voltage steps above which they determine the sign of the current. The
voltage falls with the current, so measured records are near -1."""
STRIDES = (1, 3, 10)
"""Distances in rows over which steps are taken. Where a logger writes current and voltage a row apart, the step from
row to row shows only the slide of the voltage."""
SMALL_SHARE = 0.02
"""Share of the largest current below which the cell rests."""
ENOUGH_ROWS = 10
"""Rows that a stretch of constant current needs to distinguish a trend from noise."""


class StepResponse(NamedTuple):
    """The changes of voltage over the clear steps of a current.

    slope_ohm : dV/dI by least squares, ohm; negative of a cell.  correlation : of the two, -1 to 1.
    """

    slope_ohm: float
    correlation: float


def step_response(columns: Columns) -> StepResponse | None:
    """The response to the steps of the current from row to row; None for fewer than ENOUGH_STEPS clear ones, or where
    none moves the voltage."""
    rise = np.diff(columns["current_a"])
    answer = np.diff(columns["voltage_v"])
    clear = np.abs(rise) > STEP_SHARE * np.max(np.abs(rise), initial=0.0)
    if int(np.sum(clear)) < ENOUGH_STEPS or np.all(answer[clear] == 0):
        return None
    x, y = rise[clear], answer[clear]
    slope = float(np.sum(x * y) / np.sum(x * x))
    return StepResponse(slope, float(np.sum(x * y) / np.sqrt(np.sum(x * x) * np.sum(y * y))))


def clearest_step_response(columns: Columns) -> StepResponse | None:
    """`step_response` for the one of STRIDES with the strongest correlation: loggers may write current and voltage
    some rows apart."""
    found = [each for each in map(step_response, strides_of(columns)) if each is not None]
    return max(found, key=lambda each: abs(each.correlation), default=None)


def step_resistance_ohm(columns: Columns) -> float | None:
    """Resistance at the steps of the current, ohm, > 0; None where their correlation with the voltage is not clear."""
    found = step_response(columns)
    return -found.slope_ohm if found is not None and found.correlation < -CLEAR_CORRELATION else None


def strides_of(columns: Columns) -> list[Columns]:
    """The columns with every 1st, 3rd and 10th row (STRIDES)."""
    return [{name: column[::stride] for name, column in columns.items()} for stride in STRIDES]


def charge_as(columns: Columns) -> Array:
    """(n,) A s, charge since the first row, with the current constant since the row before."""
    return np.append(0.0, np.cumsum(columns["current_a"][1:] * np.diff(columns["time_s"])))


def moved_ah(columns: Columns) -> float:
    """Range of the charge over the record, Ah."""
    return float(np.ptp(charge_as(columns))) / SECONDS_PER_HOUR


def constant_stretches(columns: Columns) -> list[slice]:
    """Stretches of more than ENOUGH_ROWS rows, without gaps, of a constant current that is not small: within STEP_SHARE
    of the largest current from that of their first row, which excludes a slowly falling current."""
    size = np.abs(columns["current_a"])
    largest = float(np.max(size))
    same = (np.abs(np.diff(size)) <= STEP_SHARE * largest) & (size[1:] > SMALL_SHARE * largest)
    same[find_gaps(columns)] = False
    ends = np.concatenate([[-1], np.flatnonzero(~same), [len(same)]])
    long = [(int(first) + 1, int(last) + 1) for first, last in pairwise(ends) if last - first > ENOUGH_ROWS]
    cuts = [cut for first, last in long for cut in pairwise(_cuts(size, first, last, STEP_SHARE * largest))]
    return [slice(first, last) for first, last in cuts if last - first > ENOUGH_ROWS]


def _cuts(size: Array, first: int, last: int, band: float) -> list[int]:
    """Limits of pieces of rows `first` to `last`; in each the current is within `band` of that of its first row."""
    cuts, begun = [first], float(size[first])
    for row, here in enumerate(size[first:last].tolist(), first):
        if abs(here - begun) > band:
            cuts.append(row)
            begun = here
    return [*cuts, last]
