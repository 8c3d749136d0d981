"""The adaptive step: widen after a miss, narrow after a hit.

    r[k+1] = r[k] exp(rate (1[e[k] outside the band] - alpha))                                     (1)

r multiplies the half-width of the raw band about its middle. Whatever the residuals do, the share of misses
over n steps is within |log r[n] - log r[0]| / (rate n) of alpha: a long-run guarantee without assumptions.
The rate trades speed against jitter: after a sudden rise of the error by a factor f the band has caught up
after about log(f) / (rate (1 - alpha)) misses. rate = 0 leaves the calibrated band as it is.

This is quantile tracking on the logarithm of the score |e - middle| / half-width, which keeps every width
positive. Gibbs & Candes, NeurIPS 2021 (adaptive conformal inference); Angelopoulos, Candes & Tibshirani,
NeurIPS 2023 (conformal PID control: the P part).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from aesi.numerics.typing import Array, BoolArray

LOG_RATIO_LIMIT = 7.0
"""|log r| is held below this (a factor of 1,100): a sensor that is stuck for hours must not drive r to zero
or infinity, from where it would take as long to come back."""


@njit(cache=True)
def next_log_ratio(log_ratio: float, missed: bool, rate: float, alpha: float) -> float:
    """Equation (1), one step."""
    moved = log_ratio + rate * ((1.0 if missed else 0.0) - alpha)
    return min(max(moved, -LOG_RATIO_LIMIT), LOG_RATIO_LIMIT)


@njit(cache=True)
def scaled(low: float, high: float, log_ratio: float, floor: float) -> tuple[float, float]:
    """The raw band scaled by r about its middle, at least `floor` wide."""
    middle = 0.5 * (low + high)
    half = 0.5 * max(abs(high - low), floor) * np.exp(log_ratio)
    half = max(half, 0.5 * floor)
    return middle - half, middle + half


@njit(cache=True)
def replay(
    low: Array,
    high: Array,
    ready: BoolArray,
    residuals: Array,
    start: float,
    rate: float,
    alpha: float,
    floor: float,
) -> None:
    """Scale the raw bands in place along a record; a row that is not ready keeps its band."""
    log_ratio = start
    for k in range(low.size):
        if not ready[k]:
            continue
        low[k], high[k] = scaled(low[k], high[k], log_ratio, floor)
        if rate > 0 and np.isfinite(residuals[k]):
            missed = residuals[k] < low[k] or residuals[k] > high[k]
            log_ratio = next_log_ratio(log_ratio, missed, rate, alpha)
