"""Stamps that a record may have and that more likely are in another unit."""

from __future__ import annotations

import numpy as np

from aesi.constants import MILLI
from aesi.data.channels.checks import Columns

QUICKEST_S = 5e-3
"""Between rows, in the median: the measured records come at 10 rows a second at most. Rows a second apart whose time is
in hours come every 0.28 ms, rows ten seconds apart every 2.8 ms."""


def time_doubts(data: Columns) -> list[str]:
    """A sentence on rows that come quicker than cyclers write them; none of others."""
    step_s = float(np.median(np.diff(data["time_s"]))) if len(data["time_s"]) > 1 else np.inf
    if step_s >= QUICKEST_S:
        return []
    return [
        f"Its rows come every {MILLI * step_s:.3g} ms, quicker than cyclers write them; if the time is in hours: "
        "--unit time_s=h."
    ]
