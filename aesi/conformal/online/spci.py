"""Sequential predictive conformal inference: quantile regression on the history, scaled on held-out runs.

The scale is the conformal quantile of |e - middle| / half-width over rows that the regression did not see.
Neighbouring rows are autocorrelated, so coverage is guaranteed approximately only; held-out runs longer than the
correlation length keep it close, and the adaptive step (`tracker`) holds the level in use.

Xu & Xie, ICML 2023, doi:10.48550/arXiv.2212.03463, refits at every step; here the regression is fitted once,
which its features allow: they carry the recent scale, so what changes with time is an input.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.conformal.bands.band import Band
from aesi.conformal.bands.history import History, View
from aesi.conformal.bands.narrowest import level_pairs
from aesi.conformal.bands.regression import RegressionBand
from aesi.conformal.online.method import CalibrationData, Method
from aesi.conformal.online.scale import Scale
from aesi.conformal.regressors.model import FitTask, RegressorFit
from aesi.errors import FitError
from aesi.numerics.typing import Array, BoolArray

N_BLOCKS = 25
"""Contiguous runs that the rows are cut into, each long against the correlation of neighbours. A convention."""
N_FOLDS = 5
"""Every fifth run is held out in turn, as is usual in cross-validation."""
ENOUGH_ROWS = 20_000
"""From here on one fold scales the band; a coverage of 90 % over its 4,000 rows has a standard error of 0.5 %."""


@dataclass(frozen=True, kw_only=True)
class SPCI(Method):
    """fitter : the regressor.  view : what it sees of the history.  n_betas : pairs of levels to choose from.
    use_current : whether the current, where given, is among its features and its groups.
    rows_a_column : calibration rows that the regressor needs for each feature."""

    fitter: RegressorFit
    view: View = "features"
    n_betas: int = 5
    use_current: bool = True
    rows_a_column: int = 10

    def band(self, data: CalibrationData) -> tuple[Band, Scale]:
        currents = data.currents if self.use_current else None
        history = History(data.window, self.view, currents is not None)
        rows, targets, current = stacked(data.records, currents, history)
        self._check_enough(rows, history)
        levels = level_pairs(data.alpha, self.n_betas)
        task = FitTask(rows, targets, levels, history.n_history, data.floor_v, data.rng)
        held_out = folds(len(rows))
        scores = np.full(len(rows), np.nan)
        for held in held_out:
            fitted = RegressionBand(history, self.fitter(task.only(~held)))
            scores[held] = half_width_scores(fitted, task.only(held))
        if len(held_out) > 1:
            fitted = RegressionBand(history, self.fitter(task))
        known = np.isfinite(scores)
        return fitted, Scale.fit(scores[known], data.alpha, None if current is None else current[known])

    def _check_enough(self, rows: Array, history: History) -> None:
        n, p = rows.shape
        needed = self.rows_a_column * p
        if n < needed:
            raise FitError(
                f"{self.name} has {n} calibration residuals with {history.needed} samples of history "
                f"before them, and needs {needed}; give more, a shorter window, or use 'split'."
            )


def stacked(
    records: list[Array], currents: list[Array] | None, history: History
) -> tuple[Array, Array, Array | None]:
    """Feature rows (n, p), targets (n,) V and currents (n,) A of all records, where history and residual exist;
    no row spans two records."""
    rows, targets, at = [np.empty((0, history.n_history))], [], []
    for i, record in enumerate(records):
        current = None if currents is None else currents[i]
        features, ready = history.rows(record, current)
        use = ready & np.isfinite(record)
        if i == 0:
            rows = []
        rows.append(features[use])
        targets.append(record[use])
        if current is not None:
            at.append(current[use])
    return (
        np.concatenate(rows),
        np.concatenate([*targets, np.empty(0)]),
        None if currents is None else np.concatenate([*at, np.empty(0)]),
    )


def half_width_scores(band: RegressionBand, task: FitTask) -> Array:
    """(n,) |e - middle| / half-width of the raw band: at most one where the band covers."""
    low, high = band.from_rows(task.rows)
    half = 0.5 * np.maximum(np.abs(high - low), task.floor_v)
    return np.asarray(np.abs(task.targets - 0.5 * (low + high)) / half)


def folds(n: int) -> list[BoolArray]:
    """Rows to hold out in turn, (n,) each: of N_BLOCKS contiguous runs, every fifth. One fold where that
    holds enough rows; all five, together every row once, where calibration data are short."""
    fold = np.arange(n) * N_BLOCKS // max(n, 1) % N_FOLDS
    if n >= ENOUGH_ROWS:
        return [fold == N_FOLDS // 2]
    return [fold == i for i in range(N_FOLDS)]
