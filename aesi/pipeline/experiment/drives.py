"""Assignment of drives to roles: which records, or repeats of one record, train, validate and test, and which parts of
the training drives are left out in turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.recalibrate import FitRecord
from aesi.pipeline.experiment.sections import DataConfig, RepeatsConfig
from aesi.records import ROLES, ErrorSeries, Role, Split


def by_role(
    data: DataConfig, series: Mapping[str, ErrorSeries], roles: Mapping[Role, Sequence[str]]
) -> Split:
    """The error series by role: whole records, or the repeats of the only record.

    series : record -> its error series.  roles : role -> its records.
    """
    if data.repeats:
        return cut_repeats(next(iter(series.values())), data.repeats)
    train, valid, test = (tuple(series[name] for name in roles[role]) for role in ROLES)
    return Split(train, valid, test)


def training_part(
    data: DataConfig, series: Mapping[str, ErrorSeries], roles: Mapping[Role, Sequence[str]]
) -> tuple[ErrorSeries, ...]:
    """`Split.train` of `by_role`. The series of the training records are sufficient."""
    if data.repeats:
        return cut_repeats(next(iter(series.values())), data.repeats).train
    return tuple(series[name] for name in roles["train"])


def cut_repeats(series: ErrorSeries, repeats: RepeatsConfig) -> Split:
    """The repeats of a record, by role. The last `valid_share` of each training repeat validates.

    Raises DataError as `rows_of_repeat`, and where a training repeat is left fewer than two rows to train on.
    """
    train, valid = [], []
    for number in repeats.train:
        piece = _repeat(series, repeats, number)
        cut = _trained(len(piece), repeats, number)
        train.append(piece.take(slice(0, cut)))
        if cut < len(piece):
            valid.append(piece.take(slice(cut, len(piece)), f"{piece.name}, end"))
    test = [_repeat(series, repeats, number) for number in repeats.test]
    return Split(tuple(train), tuple(valid), tuple(test))


def _repeat(series: ErrorSeries, repeats: RepeatsConfig, number: int) -> ErrorSeries:
    """The repeat with a number, counted from 1, of a record."""
    rows = rows_of_repeat(series.name, series.time_s, series.dt_s, repeats, number)
    return series.take(rows, f"repeat {number}")


def rows_of_repeat(name: str, time_s: Array, dt_s: float, repeats: RepeatsConfig, number: int) -> slice:
    """The rows of the repeat with a number, counted from 1, of a record.

    name : of the record, for the sentence.  time_s : (n,) s, every dt_s (s).
    Raises DataError if the record does not contain that repeat, or if it has fewer than two rows.
    """
    period_s = repeats.period_s
    start = time_s[0] + (number - 1) * period_s
    low, high = np.searchsorted(time_s, [start, start + period_s])
    if high - low < 2 and period_s < 2 * dt_s:
        raise DataError(
            f"{name}: a repeat of {period_s:g} s holds no two rows {dt_s:g} s apart; give the period of the schedule "
            "in seconds (repeats.period_s), or shorter steps (data.dt_s)."
        )
    if high - low < 2:
        raise DataError(
            f"{name} lasts {time_s[-1] - time_s[0]:.0f} s and has no repeat {number} of {period_s:g} s; take it out of "
            "`repeats`."
        )
    return slice(int(low), int(high))


def _trained(rows: int, repeats: RepeatsConfig, number: int) -> int:
    """Number of the first rows of the training repeat with a number that train; the others validate.

    Raises DataError where fewer than two are left to train on.
    """
    trained = round(rows * (1 - repeats.valid_share))
    if trained < 2:
        raise DataError(
            f"repeat {number}: with repeats.valid_share {repeats.valid_share:g} it trains on {trained} of its {rows} "
            "rows, and needs two at least; give a smaller share."
        )
    return trained


WHOLE_REPEAT_SHARE = 0.99
"""Least share of a period that a whole repeat contains. The last rows of a record may be missing. A convention."""


def cut_short(time_s: Array, repeats: RepeatsConfig) -> list[str]:
    """One sentence for each named repeat that is incomplete because the record ends in it.

    time_s : (n,) s, of the record.
    """
    lasts = {
        number: float(time_s[-1] - time_s[0]) - (number - 1) * repeats.period_s
        for number in (*repeats.train, *repeats.test)
    }
    return [
        f"repeat {number} has {seconds:.0f} s of the {repeats.period_s:g} s of a period: the record ends in it."
        for number, seconds in lasts.items()
        if seconds < WHOLE_REPEAT_SHARE * repeats.period_s
    ]


def training_drives(
    data: DataConfig, records: Mapping[str, FitRecord], roles: Mapping[Role, Sequence[str]]
) -> list[tuple[str, slice]]:
    """(record, its rows) of each training drive, in the order of `Split.train`. Rows that validate are excluded.

    Raises DataError as `rows_of_repeat`, of a repeat that tests too: what is fitted next takes minutes.
    """
    if data.repeats is None:
        return [(name, slice(0, len(records[name].rows))) for name in roles["train"]]
    ((name, record),) = records.items()
    measured, repeats = record.measurement, data.repeats
    rows_of = partial(rows_of_repeat, measured.name, measured.time_s, data.dt_s, repeats)
    for number in repeats.test:
        rows_of(number)
    return [
        (name, slice(rows.start, rows.start + _trained(rows.stop - rows.start, repeats, number)))
        for number, rows in zip(repeats.train, map(rows_of, repeats.train), strict=True)
    ]


HALVES = 2
"""Number of parts in which a training repeat is left out (see `cuts`)."""


def cuts(data: DataConfig) -> int:
    """Number of parts into which each training drive is cut, to be left out in turn.

    It is 1 for drives that are records, and HALVES for repeats of one record, which follow each other in the state of
    charge. A test repeat lies between two training repeats, so that no row of it is further than half a repeat from a
    trained row. A left-out half of a training repeat is as far from the other half. A whole repeat that is left out
    would be further from the trained rows than the test is.
    """
    return HALVES if data.repeats is not None else 1
