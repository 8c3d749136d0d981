"""From calibration residuals to a `Calibrated` method."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.conformal.band import Band
from aesi.conformal.calibrated import Calibrated, checked_record
from aesi.conformal.history import History, View
from aesi.conformal.marginal import FixedBand, RollingBand
from aesi.conformal.narrowest import level_pairs
from aesi.conformal.regression import QuantileModel, RegressionBand
from aesi.errors import FitError, InputError
from aesi.numerics.quantiles import conformal_quantile
from aesi.numerics.typing import Array, BoolArray

RELATIVE_FLOOR = 1e-3
"""No interval is narrower than this share of the marginal one: below it lie the quantisation of the sensor
and stretches of rest, where a width of zero would claim knowledge that nobody has."""
ROWS_A_COLUMN = 10
"""Calibration rows that a regression needs for each feature."""
N_BLOCKS = 25
N_FOLDS = 5
ENOUGH_ROWS = 20_000
"""Above it a fifth of the rows scales the band to within half a per cent of coverage."""

Fitter = Callable[[Array, Array, Array, Array, np.random.Generator], QuantileModel]
"""(rows (n, p), targets (n,), weights (n,), levels (2 B,), rng) -> fitted model."""


@dataclass(frozen=True)
class Method(ABC):
    """A way to calibrate. `rate` is that of the adaptive step (`tracker`), 0 without."""

    name: str
    rate: float = 0.0

    def fit(
        self,
        residuals: Sequence[Array],
        alpha: float = 0.1,
        window: int = 200,
        rng: np.random.Generator | None = None,
    ) -> Calibrated:
        """Calibrate on honest residuals: held out or out of bag, never those of the fit.

        residuals : one (n_i,) array a continuous record, V, all at one sampling rate; NaN is missing.
        alpha : share of misses allowed, in (0, 1).  window : samples of history.
        rng : used by randomised regressors only; default seed 0.

        Raises InputError for an impossible alpha or window, FitError for too few or constant residuals.
        """
        if not 0 < alpha < 1:
            raise InputError(f"alpha = {alpha:g} is not a share of misses; give a value between 0 and 1.")
        if window < 10:
            raise InputError(f"window = {window} samples is too short a history; give 10 or more.")
        records = [checked_record(r) for r in residuals]
        pooled = np.concatenate(records) if records else np.empty(0)
        pooled = pooled[np.isfinite(pooled)]
        marginal = marginal_interval(pooled, alpha)
        floor = width_floor(records, marginal)
        band, log_ratio = self.band(records, marginal, alpha, window, rng or np.random.default_rng(0), floor)
        return Calibrated(self.name, alpha, window, band, marginal, floor, self.rate, log_ratio)

    @abstractmethod
    def band(
        self,
        records: list[Array],
        marginal: tuple[float, float],
        alpha: float,
        window: int,
        rng: np.random.Generator,
        floor: float,
    ) -> tuple[Band, float]:
        """The raw band, and the logarithm of the factor on its half-width that calibrates it."""

    def adaptive(self, rate: float) -> Method:
        """The same method with another rate of the adaptive step."""
        return replace(self, rate=rate)


def marginal_interval(pooled: Array, alpha: float) -> tuple[float, float]:
    """Equal-tailed conformal interval of finite residuals (n,): V, V.

    Raises FitError for constant residuals, or fewer than 2/alpha - 1 of them.
    """
    if pooled.size and np.ptp(pooled) == 0:
        raise FitError(
            f"all {pooled.size} residuals equal {pooled[0]:g} V, which says nothing about the spread. "
            "Calibrate on residuals of measured voltage that the model was not fitted to."
        )
    return -conformal_quantile(-pooled, alpha / 2), conformal_quantile(pooled, alpha / 2)


def width_floor(records: Sequence[Array], marginal: tuple[float, float]) -> float:
    """V, > 0: the least width of any interval; a thousandth of the marginal width, or the smallest step that
    the residuals take (its 1 % quantile), whichever is larger."""
    steps = np.abs(np.concatenate([np.diff(r) for r in records]))
    steps = steps[np.isfinite(steps) & (steps > 0)]
    resolution = float(np.quantile(steps, 0.01)) if steps.size else 0.0
    return max(RELATIVE_FLOOR * (marginal[1] - marginal[0]), resolution)


@dataclass(frozen=True)
class SplitConformal(Method):
    """Two fixed quantiles of the calibration residuals."""

    name: str = "split"

    def band(
        self,
        records: list[Array],
        marginal: tuple[float, float],
        alpha: float,
        window: int,
        rng: np.random.Generator,
        floor: float,
    ) -> tuple[Band, float]:
        return FixedBand(*marginal), 0.0


@dataclass(frozen=True)
class EnbPI(Method):
    """Quantiles of the last `window` residuals, updated at every step; the narrowest of `n_betas` pairs."""

    name: str = "enbpi"
    n_betas: int = 5

    def band(
        self,
        records: list[Array],
        marginal: tuple[float, float],
        alpha: float,
        window: int,
        rng: np.random.Generator,
        floor: float,
    ) -> tuple[Band, float]:
        needed = int(np.ceil(2 / alpha)) - 1
        if needed > window:
            raise InputError(
                f"a window of {window} cannot hold the {needed} residuals that alpha = {alpha:g} needs."
            )
        return RollingBand(window, needed, level_pairs(alpha, self.n_betas)), 0.0


@dataclass(frozen=True)
class SPCI(Method):
    """Quantile regression on the history, then scaled by split conformal prediction on held-out runs.

    The scale is the conformal quantile of |e - middle| / half-width over the held-out rows. Neighbouring rows
    depend on each other, so its guarantee is approximate; runs longer than the memory keep it close.
    """

    name: str = "spci"
    fitter: Fitter | None = None
    view: View = "features"
    n_betas: int = 5

    def band(
        self,
        records: list[Array],
        marginal: tuple[float, float],
        alpha: float,
        window: int,
        rng: np.random.Generator,
        floor: float,
    ) -> tuple[Band, float]:
        assert self.fitter is not None
        history = History(window, self.view)
        rows, targets = stacked(records, history)
        self._check_enough(len(rows), rows.shape[1], history)
        weights = 1 / (local_scale(rows) + floor)
        levels = level_pairs(alpha, self.n_betas)
        scores, fitted = [], None
        for held in folds(len(rows)):
            model = self.fitter(rows[~held], targets[~held], weights[~held], levels, rng)
            fitted = RegressionBand(history, model)
            scores.append(half_width_scores(fitted, rows[held], targets[held], floor))
        if len(scores) > 1:
            fitted = RegressionBand(history, self.fitter(rows, targets, weights, levels, rng))
        assert fitted is not None
        return fitted, float(np.log(conformal_quantile(np.concatenate(scores), alpha)))

    def _check_enough(self, n: int, p: int, history: History) -> None:
        if n < ROWS_A_COLUMN * p:
            raise FitError(
                f"{self.name} has {n} calibration residuals with {history.needed} samples of history "
                f"before them, and needs {ROWS_A_COLUMN * p}; give more, a shorter window, or use 'split'."
            )


def stacked(records: Sequence[Array], history: History) -> tuple[Array, Array]:
    """Feature rows (n, p) and targets (n,) of all records, where both exist; no row spans two records."""
    rows, targets = [], []
    for record in records:
        features, ready = history.rows(record)
        use = ready & np.isfinite(record)
        rows.append(features[use])
        targets.append(record[use])
    return np.concatenate(rows), np.concatenate(targets)


def local_scale(rows: Array) -> Array:
    """(n,) V: mean absolute value of the features, a cheap causal scale that makes rows comparable."""
    return np.asarray(np.mean(np.abs(rows), axis=1))


def half_width_scores(band: RegressionBand, rows: Array, targets: Array, floor: float) -> Array:
    """(n,) |e - middle| / half-width of the raw band: at most one where the band covers."""
    low, high = band.from_rows(rows)
    half = 0.5 * np.maximum(np.abs(high - low), floor)
    return np.asarray(np.abs(targets - 0.5 * (low + high)) / half)


def folds(n: int) -> list[BoolArray]:
    """Rows to hold out in turn, (n,) each: of N_BLOCKS contiguous runs, every fifth. One fold where that
    holds enough rows; all five, together every row once, where calibration data are short."""
    fold = np.arange(n) * N_BLOCKS // max(n, 1) % N_FOLDS
    if n >= ENOUGH_ROWS:
        return [fold == N_FOLDS // 2]
    return [fold == i for i in range(N_FOLDS)]
