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
from aesi.numerics.blocks import dealt_folds
from aesi.numerics.typing import Array, BoolArray

N_BLOCKS = 25
"""Number of contiguous runs of rows, each long against the correlation of neighbours. A convention."""
N_FOLDS = 5
"""Every fifth run is held out in turn, as is usual in cross-validation."""
ENOUGH_ROWS = 20_000
"""Number of rows from which one held-out fold scales the band: a coverage of 90 % over its 4,000 rows has a standard
error of 0.5 %."""


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
        """With fewer than ENOUGH_ROWS rows the calibration is cross-conformal: each fold is scored by a regression
        without it, and the band is that of a regression on all rows. With more rows it is split conformal: one fold is
        held out and scored, and the band is that of the regression without it."""
        currents = data.currents if self.use_current else None
        history = History(data.window, self.view, currents is not None)
        rows, targets, current = stacked(data.records, currents, history)
        self._check_enough(rows, history)
        levels = level_pairs(data.alpha, self.n_betas)
        task = FitTask(rows, targets, levels, history.n_history, data.floor_v, data.rng)
        held_out = held_out_folds(len(rows))
        fold_bands = [RegressionBand(history, self.fitter(task.only(~held))) for held in held_out]
        final_band = fold_bands[0] if len(fold_bands) == 1 else RegressionBand(history, self.fitter(task))
        scores = cross_scores(fold_bands, held_out, task)
        known = np.isfinite(scores)
        return final_band, Scale.fit(scores[known], data.alpha, None if current is None else current[known])

    def _check_enough(self, rows: Array, history: History) -> None:
        """Raises FitError for fewer feature rows (n, p) than the regressor needs."""
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
    """Feature rows (n, p), targets (n,) V and currents (n,) A of all records, at least one, where history and residual
    exist; no row spans two records."""
    rows, targets, currents_at_rows = [], [], []
    for i, record in enumerate(records):
        current = None if currents is None else currents[i]
        features, ready = history.rows(record, current)
        use = ready & np.isfinite(record)
        rows.append(features[use])
        targets.append(record[use])
        if current is not None:
            currents_at_rows.append(current[use])
    return (
        np.concatenate(rows),
        np.concatenate(targets),
        None if currents is None else np.concatenate(currents_at_rows),
    )


def cross_scores(fold_bands: list[RegressionBand], held_out: list[BoolArray], task: FitTask) -> Array:
    """(n,) `half_width_scores` of each row by the band that was fitted without it; NaN for a row in all fits.

    held_out : (n,) for each band, True for the rows that it was fitted without; no row twice.
    """
    scores = np.full(len(task.targets), np.nan)
    for band, held in zip(fold_bands, held_out, strict=True):
        scores[held] = half_width_scores(band, task.only(held))
    return scores


def half_width_scores(band: RegressionBand, task: FitTask) -> Array:
    """(n,) |e - middle| / half-width of the raw band: at most one where the band covers."""
    low, high = band.from_rows(task.rows)
    half = 0.5 * np.maximum(np.abs(high - low), task.floor_v)
    return np.asarray(np.abs(task.targets - 0.5 * (low + high)) / half)


def held_out_folds(n: int) -> list[BoolArray]:
    """Rows to hold out in turn, (n,) each: of N_BLOCKS contiguous runs, every fifth. One fold where that
    holds enough rows; all five, together every row once, where calibration data are short."""
    fold = dealt_folds(n, N_BLOCKS, N_FOLDS)
    if n >= ENOUGH_ROWS:
        return [fold == N_FOLDS // 2]
    return [fold == i for i in range(N_FOLDS)]
