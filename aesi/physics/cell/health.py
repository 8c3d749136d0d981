"""State of health: capacity of a cell over that in its file, given as this share or as the day of a test.

A cell that is tested for weeks ages in the meantime, so that a record has the capacity of its day and not that of the
file. Each record of a calibration has a share of the file's capacity. Between the days of dated records the share is
interpolated linearly,

    soh(t) = soh_k + (soh_{k+1} - soh_k) (t - t_k)/(t_{k+1} - t_k)                                             (1)

with the mean of the records of one day. Before the first day and after the last it is unknown.

Left out: ageing by use and not by days, information of a record itself on its cell's capacity, and the day of the
file's own state where no record has that day.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import date, datetime

import numpy as np

from aesi.errors import CellError, in_words
from aesi.numerics.typing import Array
from aesi.records.checked import is_finite_number

Soh = float | date
"""A share of the file's capacity, or the day of a test."""

LEAST_SOH, MOST_SOH = 0.2, 1.5
"""Limits of a state of health. Tests seldom go below half of the capacity, so that less than a fifth is a misplaced
decimal point. More than 1 is possible with the file of an aged cell; beyond the upper limit it is of another cell.
Conventions."""


def read_soh(text: str) -> Soh:
    """The state of health in a text: a share (0.97) or a day (2018-11-13).

    Raises CellError for any other text, and for a share as `checked_soh` does.
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
    """The state of health, checked; a `datetime` becomes its day.

    Raises CellError for a share outside [`LEAST_SOH`, `MOST_SOH`].
    """
    if isinstance(soh, date):
        return day_of(soh)
    given: object = soh
    if not (is_finite_number(given) and LEAST_SOH <= given <= MOST_SOH):
        told = f"{given:g}" if is_finite_number(given) else in_words(given)
        raise CellError(
            f"a state of health of {told}: it is the share of the cell file's capacity that the cell had, from "
            f"{LEAST_SOH:g} to {MOST_SOH:g}; 97 % is 0.97."
        )
    return soh


def day_of(given: date) -> date:
    """The day of a date; a `datetime`, which Python counts as a date too, loses its time."""
    return given.date() if isinstance(given, datetime) else given


def shares_by_day(
    shares: Iterable[tuple[str, float]], tested: Mapping[str, date]
) -> tuple[list[date], Array]:
    """(days in order, mean share (days,) of the records of each).

    shares : (record, share of the file's capacity).  tested : record -> day; records without a day are ignored.
    """
    by_day: dict[date, list[float]] = {}
    for name, share in shares:
        if name in tested:
            by_day.setdefault(tested[name], []).append(share)
    days = sorted(by_day)
    return days, np.array([np.mean(by_day[day]) for day in days])
