"""Stamps that a record may have and that more likely are in another unit."""

from __future__ import annotations

import numpy as np

from aesi.constants import MILLI
from aesi.data.channels.checks import Columns
from aesi.numerics.typing import Array

QUICKEST_S = 5e-3
"""Between rows, in the median: the measured records come at 10 rows a second at most. Rows a second apart whose time is
in hours come every 0.28 ms, rows ten seconds apart every 2.8 ms."""
SERIAL_DAYS = (20_000.0, 80_000.0)
"""Since 1900, in which spreadsheets write dates: of 1954 to 2119. A convention."""
LONGEST_TEST_D = 1000.0
"""No test of stamps in such days is longer."""


def longer_unit(time_s: Array) -> str:
    """Of stamps that are too close for seconds, the unit that they rather are in, as `--unit time_s=` takes it."""
    if _of_a_spreadsheet(time_s):
        return "d"
    return "h, min or d"


def time_doubts(data: Columns) -> list[str]:
    """A sentence on rows that come quicker than cyclers write them; none of others."""
    step_s = float(np.median(np.diff(data["time_s"]))) if len(data["time_s"]) > 1 else np.inf
    if step_s >= QUICKEST_S:
        return []
    unit = "d" if _of_a_spreadsheet(data["time_s"]) else "h"
    return [
        f"Its rows come every {MILLI * step_s:.3g} ms, quicker than cyclers write them; if the time is in "
        f"{'days' if unit == 'd' else 'hours'}: --unit time_s={unit}."
    ]


def _of_a_spreadsheet(time_s: Array) -> bool:
    low, high = SERIAL_DAYS
    return bool(low < time_s[0] < high and time_s[-1] - time_s[0] < LONGEST_TEST_D)
