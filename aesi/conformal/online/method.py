"""Methods: each makes a `Calibrated` from calibration residuals."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.conformal.bands.band import Band
from aesi.conformal.bands.marginal import FixedBand, RollingBand
from aesi.conformal.bands.narrowest import level_pairs
from aesi.conformal.online.calibrated import Calibrated
from aesi.conformal.online.records import checked_currents, checked_records
from aesi.conformal.online.scale import Scale
from aesi.errors import FitError, InputError, in_words
from aesi.numerics.quantiles import check_miss_rate, conformal_quantile
from aesi.numerics.typing import Array

SHARE_OF_MARGINAL = 1e-3
"""Least width of an interval, as a share of the marginal one: at rest the residual is constant within the sensor's
resolution, and a fitted width would shrink to zero."""
MIN_WINDOW = 10
"""Shortest window, samples: the lagged features alone are ten residuals (`aesi.numerics.windows`)."""


@dataclass(frozen=True, eq=False)
class CalibrationData:
    """Data and settings of a calibration: checked records (n_i,) V, their currents (n_i,) A or None, and settings."""

    records: list[Array]
    currents: list[Array] | None
    alpha: float
    window: int
    marginal_v: tuple[float, float]
    floor_v: float
    rng: np.random.Generator


@dataclass(frozen=True)
class Method(ABC):
    """A conformal method before calibration.  name : registered name.  rate : of the adaptive step (`tracker`); 0 for
    none."""

    name: str
    rate: float = 0.0

    def fit(
        self,
        residuals: Sequence[Array],
        alpha: float = 0.1,
        window: int = 200,
        rng: np.random.Generator | int | None = None,
        current_a: Sequence[Array] | None = None,
    ) -> Calibrated:
        """The method calibrated on out-of-sample residuals: held out or out of bag, never those of the fit.

        residuals : one (n_i,) array per continuous record, V, all at one sampling rate; NaN where missing.
        alpha : miss rate, in (0, 1).  window : samples of history.
        rng : generator, or its seed, for randomised regressors only; the default has seed 0.
        current_a : one (n_i,) array per record, A, discharge positive. A method that uses it needs it to predict, too.

        Raises InputError for an inadmissible alpha, window or current; FitError for too few or constant residuals.
        """
        self.check(alpha, window)
        records = checked_records(residuals)
        marginal = marginal_interval(records, alpha)
        floor = width_floor(records, marginal)
        marginal = _widened(floor, marginal)
        currents = checked_currents(current_a, records)
        rng = np.random.default_rng(0 if rng is None else rng)
        band, scale = self.band(CalibrationData(records, currents, alpha, window, marginal, floor, rng))
        return Calibrated(self.name, alpha, window, band, scale, self.rate, marginal, floor)

    def check(self, alpha: float, window: int) -> None:
        """Raises InputError for settings that the method cannot use with any data."""
        check_settings(alpha, window)

    @abstractmethod
    def band(self, data: CalibrationData) -> tuple[Band, Scale]:
        """(raw band, factor on its half-width that calibrates it)."""


def check_settings(alpha: float, window: int) -> None:
    """Raises InputError for an alpha outside (0, 1), and for a window that is no whole number or too short."""
    check_miss_rate(alpha)
    if not isinstance(window, int | np.integer):
        raise InputError(f"window = {in_words(window)} is not a number of samples; give a whole one.")
    if window < MIN_WINDOW:
        raise InputError(f"window = {window} samples is too short a history; give {MIN_WINDOW} or more.")


def marginal_interval(records: Sequence[Array], alpha: float) -> tuple[float, float]:
    """Equal-tailed conformal interval of the finite residuals of all records: V, V.

    Raises FitError for constant residuals, or fewer than 2/alpha - 1 of them.
    """
    pooled = np.concatenate([*records, np.empty(0)])
    pooled = pooled[np.isfinite(pooled)]
    if pooled.size and np.ptp(pooled) == 0:
        raise FitError(
            f"all {pooled.size} residuals equal {pooled[0]:g} V, which says nothing about the spread. "
            "Calibrate on residuals of measured voltage that the model was not fitted to."
        )
    return -conformal_quantile(-pooled, alpha, tails=2), conformal_quantile(pooled, alpha, tails=2)


def width_floor(records: Sequence[Array], marginal_v: tuple[float, float]) -> float:
    """V, > 0: the least width of any interval; a thousandth of the marginal width, or the smallest step that
    the residuals take (its 1 % quantile), whichever is larger."""
    steps = np.abs(np.concatenate([np.diff(r) for r in records]))
    steps = steps[np.isfinite(steps) & (steps > 0)]
    resolution = float(np.quantile(steps, 0.01)) if steps.size else 0.0
    return max(SHARE_OF_MARGINAL * (marginal_v[1] - marginal_v[0]), resolution)


def _widened(width_v: float, interval_v: tuple[float, float]) -> tuple[float, float]:
    """(low, high) V: the interval, widened about its middle to at least `width_v` (most residuals may be equal)."""
    low, high = interval_v
    if high - low >= width_v:
        return interval_v
    middle = 0.5 * (low + high)
    return middle - 0.5 * width_v, middle + 0.5 * width_v


@dataclass(frozen=True)
class SplitConformal(Method):
    """Two fixed quantiles of the calibration residuals; with a rate, adaptive conformal inference."""

    name: str = "split"

    def band(self, data: CalibrationData) -> tuple[Band, Scale]:
        return FixedBand(*data.marginal_v), Scale.none()


@dataclass(frozen=True)
class EnbPI(Method):
    """Quantiles of the last `window` residuals, updated at every step; the narrowest of `n_betas` pairs."""

    name: str = "enbpi"
    n_betas: int = 5

    def check(self, alpha: float, window: int) -> None:
        super().check(alpha, window)
        if self._needed(alpha) > window:
            raise InputError(
                f"window = {window} cannot hold the {self._needed(alpha)} residuals that {self.name} needs at alpha = "
                f"{alpha:g}; give a longer one, or another method."
            )

    def band(self, data: CalibrationData) -> tuple[Band, Scale]:
        levels = level_pairs(data.alpha, self.n_betas)
        return RollingBand(data.window, self._needed(data.alpha), levels), Scale.none()

    def _needed(self, alpha: float) -> int:
        """Number of residuals before any pair of ranks exists."""
        betas = level_pairs(alpha, self.n_betas)[: self.n_betas]
        return int(np.ceil(1 / np.minimum(betas, alpha - betas).max() - 1e-9)) - 1
