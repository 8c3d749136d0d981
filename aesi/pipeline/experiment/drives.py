"""Drives: the records, or repeats of one record, that train, validate and test; and the parts left out in turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.recalibrate import FitRecord
from aesi.pipeline.experiment.sections import DataConfig, RepeatsConfig
from aesi.records import ROLES, ErrorSeries, Role, Split


def by_role(
    data: DataConfig, series: Mapping[str, ErrorSeries], roles: Mapping[Role, Sequence[str]]
) -> Split:
    """Whole records, or the repeats of the only one, by role."""
    if data.repeats:
        return cut_repeats(next(iter(series.values())), data.repeats)
    train, valid, test = (tuple(series[name] for name in roles[role]) for role in ROLES)
    return Split(train, valid, test)


def training_part(
    data: DataConfig, series: Mapping[str, ErrorSeries], roles: Mapping[Role, Sequence[str]]
) -> tuple[ErrorSeries, ...]:
    """`Split.train` of `by_role`; the series may be those of the training records alone."""
    if data.repeats:
        return cut_repeats(next(iter(series.values())), data.repeats).train
    return tuple(series[name] for name in roles["train"])


def cut_repeats(series: ErrorSeries, repeats: RepeatsConfig) -> Split:
    """Pieces of a record that repeats a schedule; each training repeat gives its last share to validation."""
    train, valid = [], []
    for number in repeats.train:
        piece = _repeat(series, repeats.period_s, number)
        cut = round(len(piece) * (1 - repeats.valid_share))
        train.append(piece.take(slice(0, cut)))
        if cut < len(piece):
            valid.append(piece.take(slice(cut, len(piece)), f"{piece.name}, end"))
    test = [_repeat(series, repeats.period_s, number) for number in repeats.test]
    return Split(tuple(train), tuple(valid), tuple(test))


def _repeat(series: ErrorSeries, period_s: float, number: int) -> ErrorSeries:
    start = series.time_s[0] + (number - 1) * period_s
    low, high = np.searchsorted(series.time_s, [start, start + period_s])
    if high - low < 2 and period_s < 2 * series.dt_s:
        raise DataError(
            f"{series.name}: a repeat of {period_s:g} s holds no two rows {series.dt_s:g} s apart; give the period of "
            "the schedule in seconds (repeats.period_s), or shorter steps (data.dt_s)."
        )
    if high - low < 2:
        raise DataError(
            f"{series.name} lasts {series.time_s[-1] - series.time_s[0]:.0f} s and has no repeat {number} of "
            f"{period_s:g} s; take it out of `repeats`."
        )
    return series.take(slice(int(low), int(high)), f"repeat {number}")


WHOLE = 0.99
"""Share of a period from which a repeat counts as whole: a logger's last rows may be missing. A convention."""


def cut_short(time_s: Array, repeats: RepeatsConfig) -> list[str]:
    """Sentences on the repeats that the record ends in.

    time_s : (n,) s, of the record.
    """
    lasts = {
        number: float(time_s[-1] - time_s[0]) - (number - 1) * repeats.period_s
        for number in (*repeats.train, *repeats.test)
    }
    return [
        f"repeat {number} has {seconds:.0f} s of the {repeats.period_s:g} s of a period: the record ends in it."
        for number, seconds in lasts.items()
        if seconds < WHOLE * repeats.period_s
    ]


def training_drives(
    data: DataConfig, records: Mapping[str, FitRecord], roles: Mapping[Role, Sequence[str]]
) -> list[tuple[str, slice]]:
    """Record and rows of each training drive, in the order of `Split.train`."""
    if data.repeats is None:
        return [(name, slice(0, len(records[name].rows))) for name in roles["train"]]
    (name, record), repeats = next(iter(records.items())), data.repeats
    time = record.measurement.time_s
    drives = []
    for number in repeats.train:
        begin = time[0] + (number - 1) * repeats.period_s
        low, high = np.searchsorted(time, [begin, begin + repeats.period_s])
        drives.append((name, slice(int(low), int(low + round((high - low) * (1 - repeats.valid_share))))))
    return drives


HALVES = 2
"""Parts in which a repeat is left out: a row of a test repeat between two is no further from trained ones (`cuts`)."""


def cuts(data: DataConfig) -> int:
    """Number of parts that a training drive is cut into to be left out in turn.

    Repeats of one record, which lie side by side in the state of charge, are cut in two. A test repeat lies between two
    training repeats, so that no row of it is further than half a repeat from trained ones; one half of a training
    repeat is as far from its other half. To leave out whole repeats would ask for more than the test does.
    """
    return HALVES if data.repeats is not None else 1


def parts(n: int, count: int) -> list[slice]:
    """Slices of n rows in consecutive parts of like length."""
    edges = np.linspace(0, n, count + 1).round().astype(int)
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]
