"""State of health: the share of its file's capacity that a cell had, given as that share or as the day of a test.

A cell that is tested for weeks ages on the way, so that a record is of the capacity of its day and not of the file's.
The records of a calibration each have a share of the file's capacity, and those with a date tell how it went: between
two days the share runs evenly,

    soh(t) = soh_k + (soh_{k+1} - soh_k) (t - t_k)/(t_{k+1} - t_k)                                             (1)

with the mean of the records of one day. Before the first day and after the last nothing tells it.

Leaves out that cells age by use more than by days, whatever a record itself would say of its cell's capacity, and the
day of the file's own state where no record is of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import date, datetime

import numpy as np

from aesi.errors import CellError
from aesi.numerics.typing import Array

Soh = float | date
"""A share of the file's capacity, or the day of a test."""

LEAST_SOH, MOST_SOH = 0.2, 1.5
"""Cells are followed to half of their capacity, seldom further: less than a fifth is a slip of the point, and the model
a shell. A file may be of an aged cell; beyond the other end it is of another. Conventions."""


def read_soh(text: str) -> Soh:
    """A state of health as it is written: a share (0.97) or a day (2018-11-13).

    Raises CellError for what is neither, and for a share as `checked_soh` does.
    """
    try:
        share = float(text)
    except ValueError:
        share = None
    if share is not None:
        return checked_soh(share)
    try:
        return date.fromisoformat(text.strip())
    except ValueError:
        raise CellError(
            f"a state of health of {text!r}: give the share of the cell file's capacity that the cell had, such as "
            "0.97, or the day of the test, YYYY-MM-DD."
        ) from None


def checked_soh(soh: Soh) -> Soh:
    """The state of health; a moment becomes its day.

    Raises CellError for a share outside [`LEAST_SOH`, `MOST_SOH`].
    """
    if isinstance(soh, date):
        return day_of(soh)
    if not LEAST_SOH <= soh <= MOST_SOH:
        raise CellError(
            f"a state of health of {soh:g}: it is the share of the cell file's capacity that the cell had, from "
            f"{LEAST_SOH:g} to {MOST_SOH:g}; 97 % is 0.97."
        )
    return soh


def day_of(given: date) -> date:
    """The day of a date, which in Python may also be a moment (`datetime`): two moments of one day are one day here."""
    return given.date() if isinstance(given, datetime) else given


def shares_by_day(
    shares: Iterable[tuple[str, float]], tested: Mapping[str, date]
) -> tuple[list[date], Array]:
    """Days in order, and (days,) the mean share of the records of each.

    shares : (record, share of the file's capacity).  tested : days by record; one without a day tells nothing.
    """
    by_day: dict[date, list[float]] = {}
    for name, share in shares:
        if name in tested:
            by_day.setdefault(tested[name], []).append(share)
    days = sorted(by_day)
    return days, np.array([np.mean(by_day[day]) for day in days])
