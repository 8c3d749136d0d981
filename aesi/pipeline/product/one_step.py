"""One step ahead of a record, as its rows were measured.

Each step of the grid that holds rows gives one prediction: that of its last row, from the rows up to the stamp before
(their average over a step, or the last one where the step has none). What is predicted is always a measured row, not an
interpolated value or an average, and a prediction never uses the row that it predicts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records import ErrorModel, ErrorSeries
from aesi.records.steps import after_gap, rows_until
from aesi.sparse.bare import Bare

LEAST_ROWS = 100
"""Fewest rows that figures of test records are given of. Of as many independent rows a coverage of 90 % is uncertain by
3 points. A convention."""


@dataclass(frozen=True, eq=False)
class RowsAhead:
    """The p measured rows of a record that are the last of a step.

    stamps : (p,) number of the stamp at the end of the step of each.  error_v : (p,) V, measured error of the physics.
    predicted_v : (p,) V, its prediction.  known_v : (p,) V, the error that was known before, which persistence repeats.
    unscored : (p,) True for rows that are not exactly so far ahead of what was known: the first ones, those that are
    predicted from before a gap or within it, and the last one where it lies after the last stamp.
    """

    dt_s: float
    stamps: IntArray
    current_a: Array
    soc: Array
    error_v: Array
    predicted_v: Array
    known_v: Array
    unscored: BoolArray

    @property
    def residual_v(self) -> Array:
        """(p,) V, measured minus predicted; NaN at the first time, which nothing before it predicts."""
        return np.where(self.stamps == 0, np.nan, self.error_v - self.predicted_v)

    @property
    def scored_v(self) -> Array:
        """(p,) V, as `residual_v`; NaN for rows that are not scored."""
        return np.where(self.unscored, np.nan, self.residual_v)

    @property
    def persistence_v(self) -> Array:
        """(p,) V, as `scored_v`, for persistence: the error minus the one that was known before."""
        return np.where(self.unscored, np.nan, self.error_v - self.known_v)

    def of(self, rows: slice) -> BoolArray:
        """(p,) True for the rows at the ends of these steps of the grid."""
        start, stop, _ = rows.indices(int(self.stamps[-1]) + 1)
        return (self.stamps >= start) & (self.stamps < stop)


def rows_ahead(model: ErrorModel, series: ErrorSeries, steps: int = 1) -> RowsAhead:
    """The last measured row of each step of a record, predicted `steps` steps ahead by a model of its error."""
    known, own = series.with_known_error, series if series.own is None else series.own
    until = rows_until(own.time_s, series.time_s)
    after_last_stamp = until[-1] < len(own)
    until[-1] = len(own)
    first = np.append(0, until[:-1])
    stamps = np.flatnonzero(until > first)
    last = until[stamps] - 1
    known_at = np.maximum(stamps - steps, 0)
    unscored = (stamps < steps) | after_gap(own.time_s, series.dt_s)[until[known_at]]
    unscored[-1] |= after_last_stamp
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
        known_v=known.error_v[known_at],
        unscored=unscored,
    )
