"""Times that are possible in s but more likely in another unit."""

from __future__ import annotations

import numpy as np

from aesi.constants import MILLI
from aesi.data.channels.checks import Columns
from aesi.numerics.typing import Array

QUICKEST_S = 5e-3
"""Median interval below which a note is given: measured records have at most 10 rows a second. With time in hours, rows
one second apart seem 0.28 ms apart, and rows ten seconds apart 2.8 ms."""
SERIAL_DAYS = (20_000.0, 80_000.0)
"""Dates as spreadsheets write them, in days since 1900: 1954 to 2119. A convention."""
LONGEST_TEST_D = 1000.0
"""Longest test with times in such days."""


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
