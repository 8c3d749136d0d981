"""One step ahead of a record, as its rows were measured.

A step of the grid that has rows is one prediction: of the last of these rows, from what rows until the stamp before
tell (their average over a step, or the last one). Nothing that was filled in between rows is predicted, nor an average
of them, and no row is seen by its own prediction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records import ErrorModel, ErrorSeries
from aesi.records.steps import after_gap, rows_until
from aesi.sparse.yardsticks import Bare


@dataclass(frozen=True, eq=False)
class RowsAhead:
    """The p measured rows of a record that are the last of a step.

    stamps : (p,) at the end of which step each is, among the record's stamps.  predicted_v : (p,) V, of the error
    error_v.  held_v : (p,) V, the error that was known before, which persistence repeats.
    unscored : (p,) True for rows that are not predicted just so far ahead: the first, those with none a step before
    them, and the last one where it lies behind the last stamp.
    """

    dt_s: float
    stamps: IntArray
    current_a: Array
    soc: Array
    error_v: Array
    predicted_v: Array
    held_v: Array
    unscored: BoolArray

    @property
    def left_v(self) -> Array:
        """(p,) V, measured minus predicted; 0 at the first time, whose error is given."""
        return self.error_v - self.predicted_v

    @property
    def judged_v(self) -> Array:
        """(p,) V, as `left_v`; NaN for rows that are not scored."""
        return np.where(self.unscored, np.nan, self.left_v)

    @property
    def persistence_v(self) -> Array:
        """(p,) V, as `judged_v`, left by repeating the error that was known before."""
        return np.where(self.unscored, np.nan, self.error_v - self.held_v)

    def of(self, rows: slice) -> BoolArray:
        """(p,) True for those at the end of these steps."""
        start, stop, _ = rows.indices(int(self.stamps[-1]) + 1)
        return (self.stamps >= start) & (self.stamps < stop)


def rows_ahead(model: ErrorModel, series: ErrorSeries, steps: int = 1) -> RowsAhead:
    """The measured rows of a record, predicted so many steps ahead by a model of its error."""
    known, own = series.with_known_error, series if series.own is None else series.own
    until = rows_until(own.time_s, series.time_s)
    behind = until[-1] < len(own)
    until[-1] = len(own)
    first = np.append(0, until[:-1])
    stamps = np.flatnonzero(until > first)
    last = until[stamps] - 1
    unscored = (stamps < steps) | after_gap(own.time_s, series.dt_s)[first[stamps]]
    unscored[-1] |= behind
    # No measured error helps physics alone, which knows its own current at the row.
    at_rows = isinstance(model, Bare)
    predicted_v = model.k_step(own, 1)[last] if at_rows else model.k_step(known, steps)[stamps]
    return RowsAhead(
        dt_s=series.dt_s,
        stamps=stamps,
        current_a=own.current_a[last],
        soc=own.soc[last],
        error_v=own.error_v[last],
        predicted_v=np.where(stamps == 0, own.error_v[last], predicted_v),
        held_v=known.error_v[np.maximum(stamps - steps, 0)],
        unscored=unscored,
    )
