"""Free-run bands of a model, from records that it was not fitted to.

Nothing here looks at `Split.test`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.conformal import WHOLE_DRIVE, FreeRunBands
from aesi.numerics.typing import Array, BoolArray
from aesi.records import ErrorModel, ErrorSeries
from aesi.sparse.yardsticks import Bare, Persistence

Unseen = tuple[ErrorModel, ErrorSeries]
"""A model and a record that it was not fitted to."""


@dataclass(frozen=True, eq=False)
class HonestErrors:
    """What predictions left of the error on records their models had not seen, one (n_i,) array a record.

    by_horizon : s (WHOLE_DRIVE: from the first sample) -> V, NaN where there is no prediction.
    current_a, soc : A and 1.  inside : True where the model had been trained on such inputs.
    """

    dt_s: float
    by_horizon: dict[float, list[Array]]
    current_a: list[Array]
    soc: list[Array]
    inside: list[BoolArray]

    @classmethod
    def of(
        cls, pairs: Sequence[Unseen], train: Sequence[ErrorSeries], horizons_s: Sequence[float]
    ) -> HonestErrors:
        """pairs : models with records; a piece of a training record comes with a model fitted without it.
        train : the training records of all these models."""
        by_horizon = {h: [error_ahead(model, series, h) for model, series in pairs] for h in horizons_s}
        by_horizon[WHOLE_DRIVE] = [error_of_free_run(model, series) for model, series in pairs]
        return cls(
            dt_s=pairs[0][1].dt_s,
            by_horizon=by_horizon,
            current_a=[series.current_a for _, series in pairs],
            soc=[series.soc for _, series in pairs],
            inside=[_inside(model, series, train) for model, series in pairs],
        )

    def bands(self, alpha: float) -> FreeRunBands:
        """Calibrated on these. Raises FitError where they are too few, or zero."""
        return FreeRunBands.fit(
            self.by_horizon, self.dt_s, self.current_a, self.soc, alpha=alpha, inside=self.inside
        )


def error_ahead(model: ErrorModel, series: ErrorSeries, horizon_s: float) -> Array:
    """(n,) V left by predictions from a measurement `horizon_s` earlier; NaN where there is none so early."""
    steps = max(1, round(horizon_s / series.dt_s))
    left = series.error_v - model.k_step(series, steps)
    left[:steps] = np.nan
    return left


def error_of_free_run(model: ErrorModel, series: ErrorSeries) -> Array:
    """(n,) V left by a free run from the first sample; NaN from a divergence on."""
    run = model.free_run(series)
    left = series.error_v - run.error_v
    if run.diverged_at is not None:
        left[run.diverged_at :] = np.nan
    return left


def _inside(model: ErrorModel, series: ErrorSeries, train: Sequence[ErrorSeries]) -> BoolArray:
    """(n,) True where the model had been trained on such inputs.

    The models behind left-out pieces share the scaling of the whole training set and cannot tell by themselves:
    for a piece of a training record, the range is that of the training rows outside it.
    """
    if isinstance(model, Bare | Persistence):  # trained on nothing
        return np.ones(len(series), dtype=bool)
    others = [record.inputs[~_is_part(record, series)] for record in train]
    low = np.min([rows.min(axis=0) for rows in others if len(rows)], axis=0)
    high = np.max([rows.max(axis=0) for rows in others if len(rows)], axis=0)
    return np.asarray(((series.inputs >= low) & (series.inputs <= high)).all(axis=1))


def _is_part(record: ErrorSeries, piece: ErrorSeries) -> BoolArray:
    """(n,) True for the rows of `record` that `piece` was cut from; a piece keeps its record's name."""
    if record.name != piece.name:
        return np.zeros(len(record), dtype=bool)
    return np.asarray((record.time_s >= piece.time_s[0]) & (record.time_s <= piece.time_s[-1]))
