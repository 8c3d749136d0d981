"""How good intervals are: coverage on average, in bins and in time; width; and the score that weighs both.

    S = (u - l) + 2/alpha (l - e)+ + 2/alpha (e - u)+                                              (1)

S, the interval (Winkler) score, is least in expectation for the true quantiles: it cannot be bettered by
trading width against coverage. Gneiting & Raftery, J. Am. Stat. Assoc. 102 (2007) 359, eq. (43).
Samples whose residual is missing (NaN) are left out of every score.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.conformal.intervals import Intervals
from aesi.numerics.typing import Array, IntArray

CURRENT_BINS = 8
"""Bins over the range of the current. Conventions of the tables, as are the width of a bin in state of charge, the rows
from which a bin counts, and windows of a minute."""
SOC_BIN_WIDTH = 0.1
MIN_BIN_SAMPLES = 200
"""At 200 rows a coverage of 90 % scatters by 2 %, were they independent."""
MINUTE_S = 60.0
LOW_MINUTE_COVERAGE = 0.70
"""A minute in which fewer than these are inside is one in which the interval failed."""


@dataclass(frozen=True)
class Scores:
    """Of one replay. Shares in [0, 1], widths and score in V.

    worst_bin_coverage is NaN where no current and state of charge were given or no bin has more than 200
    samples; low_minutes (the share of minute-long windows with under 70 % coverage) is NaN where the sampling
    interval is unknown or the record shorter than a minute.
    """

    n: int
    coverage: float
    mean_width_v: float
    interval_score_v: float
    worst_bin_coverage: float
    low_minutes: float


def scores_of(
    intervals: Intervals,
    residuals: Array,
    alpha: float,
    current_a: Array | None = None,
    soc: Array | None = None,
    dt_s: float | None = None,
) -> Scores:
    """All scores of one record: intervals and residuals of the same (n,) samples.

    current_a : (n,) A and soc : (n,) for the bins.  dt_s : s, for the minute-long windows.
    """
    seen = np.isfinite(residuals)
    covered = np.where(seen, intervals.covers(residuals), np.nan)
    worst = np.nan
    if current_a is not None and soc is not None:
        worst = worst_bin_coverage(covered, current_a, soc)
    return Scores(
        n=int(seen.sum()),
        coverage=float(np.mean(covered[seen])) if seen.any() else np.nan,
        mean_width_v=float(np.mean(intervals.width_v[seen])) if seen.any() else np.nan,
        interval_score_v=interval_score(intervals.lower_v, intervals.upper_v, residuals, alpha),
        worst_bin_coverage=worst,
        low_minutes=low_minute_share(covered, dt_s) if dt_s is not None else np.nan,
    )


def interval_score(lower: Array, upper: Array, residuals: Array, alpha: float) -> float:
    """Mean of equation (1), V; lower, upper, residuals : (n,) V."""
    seen = np.isfinite(residuals)
    e, low, high = residuals[seen], lower[seen], upper[seen]
    misses = np.maximum(low - e, 0) + np.maximum(e - high, 0)
    return float(np.mean(high - low + 2 / alpha * misses)) if seen.any() else np.nan


def bin_numbers(current_a: Array, soc: Array) -> IntArray:
    """(n,) number of the (current, SOC) bin of each sample: equal steps over the range of the current,
    and steps of SOC_BIN_WIDTH in state of charge."""
    low, high = float(np.min(current_a)), float(np.max(current_a))
    step = (high - low) / CURRENT_BINS or 1.0
    column = np.minimum((current_a - low) / step, CURRENT_BINS - 1).astype(np.int64)
    row = np.floor(soc / SOC_BIN_WIDTH).astype(np.int64)
    return np.asarray(row * CURRENT_BINS + column)


def worst_bin_coverage(
    covered: Array, current_a: Array, soc: Array, min_samples: int = MIN_BIN_SAMPLES
) -> float:
    """Least coverage among the (current, SOC) bins with more than `min_samples` samples; NaN without any.

    covered : (n,) 1, 0, or NaN where the residual is missing.
    """
    seen = np.isfinite(covered)
    _, number = np.unique(bin_numbers(current_a, soc)[seen], return_inverse=True)
    counts = np.bincount(number)
    shares = np.bincount(number, weights=covered[seen]) / np.maximum(counts, 1)
    large = counts > min_samples
    return float(shares[large].min()) if large.any() else np.nan


def low_minute_share(covered: Array, dt_s: float) -> float:
    """Share of the sliding minute-long windows with under 70 % coverage; NaN for less than a minute.

    covered : (n,) 1, 0, or NaN where missing; a window counts where half of it is seen.
    """
    length = max(1, round(MINUTE_S / dt_s))
    if len(covered) < length:
        return np.nan
    seen = np.isfinite(covered)
    hits = _sliding_sum(np.where(seen, covered, 0.0), length)
    counts = _sliding_sum(seen.astype(float), length)
    use = counts >= length / 2
    if not use.any():
        return np.nan
    # The sums of ones are exact, the product with 0.7 is not: the slack is for that.
    return float(np.mean(hits[use] < LOW_MINUTE_COVERAGE * counts[use] - 1e-9))


def _sliding_sum(values: Array, length: int) -> Array:
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray(total[length:] - total[:-length])
