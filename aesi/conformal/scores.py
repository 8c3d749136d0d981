"""Scores of intervals: coverage on average, in bins and in time; width; and the interval score, which weighs both.

    S = (u - l) + 2/alpha (l - e)+ + 2/alpha (e - u)+                                              (1)

S, the interval (Winkler) score, is least in expectation for the true quantiles: it cannot be bettered by
trading width against coverage. Gneiting & Raftery, J. Am. Stat. Assoc. 102 (2007) 359, eq. (43).
Samples whose residual is missing (NaN) are left out of every score.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.conformal.intervals import Intervals
from aesi.numerics.typing import Array, BoolArray, IntArray

CURRENT_BINS = 8
"""Bins over the range of the current. Conventions of the tables, as are the width of a bin in state of charge, the rows
from which a bin stands alone, and windows of a minute."""
SOC_BIN_WIDTH = 0.1
MIN_BIN_SAMPLES = 200
"""Bins are joined to their neighbours until they hold more samples. At 200 independent rows a coverage of 90 % has a
standard error of 2 %. If smaller bins were left out instead, a drive of 3,000 rows would count with one bin of 50, 7 %
of its rows."""
MINUTE_S = 60.0
LOW_MINUTE_COVERAGE = 0.70
"""Share of samples inside below which the interval counts as failed in a minute."""


@dataclass(frozen=True)
class Scores:
    """Scores of one replay: shares in [0, 1], widths and score in V.

    worst_bin_coverage is NaN where no current and state of charge were given or there are no more than 200
    samples.
    """

    coverage: float
    mean_width_v: float
    interval_score_v: float
    worst_bin_coverage: float


def scores_of(
    intervals: Intervals,
    residuals: Array,
    alpha: float,
    current_a: Array | None = None,
    soc: Array | None = None,
) -> Scores:
    """Scores of intervals and residuals of the same (n,) samples.

    current_a : (n,) A and soc : (n,) for the bins.
    """
    seen = np.isfinite(residuals)
    covered = np.where(seen, intervals.covers(residuals), np.nan)
    worst = np.nan
    if current_a is not None and soc is not None:
        worst = worst_bin_coverage(covered, current_a, soc)
    return Scores(
        coverage=float(np.mean(covered[seen])) if seen.any() else np.nan,
        mean_width_v=float(np.mean(intervals.width_v[seen])) if seen.any() else np.nan,
        interval_score_v=interval_score(intervals.lower_v, intervals.upper_v, residuals, alpha),
        worst_bin_coverage=worst,
    )


def interval_score(lower: Array, upper: Array, residuals: Array, alpha: float) -> float:
    """Mean of equation (1), V; lower, upper, residuals : (n,) V."""
    seen = np.isfinite(residuals)
    e, low, high = residuals[seen], lower[seen], upper[seen]
    misses = np.maximum(low - e, 0) + np.maximum(e - high, 0)
    return float(np.mean(high - low + 2 / alpha * misses)) if seen.any() else np.nan


def bin_numbers(current_a: Array, soc: Array) -> IntArray:
    """(n,) number of the (current, SOC) bin of each sample: equal steps over the range of the current,
    and steps of SOC_BIN_WIDTH in state of charge. Every other row of the grid is counted backwards, so that numbers
    that follow each other are neighbours."""
    low, high = float(np.min(current_a)), float(np.max(current_a))
    step = (high - low) / CURRENT_BINS or 1.0
    column = np.minimum((current_a - low) / step, CURRENT_BINS - 1).astype(np.int64)
    row = np.floor(soc / SOC_BIN_WIDTH).astype(np.int64)
    column = np.where(row % 2 == 0, column, CURRENT_BINS - 1 - column)
    return np.asarray(row * CURRENT_BINS + column)


def worst_bin_coverage(covered: Array, current_a: Array, soc: Array) -> float:
    """Least coverage among (current, SOC) bins of more than MIN_BIN_SAMPLES samples, smaller ones joined to their
    neighbours: every sample counts, so that it is never above the average. NaN for fewer samples than that in all.

    covered : (n,) 1, 0, or NaN where the residual is missing.
    """
    seen = np.isfinite(covered)
    if seen.sum() <= MIN_BIN_SAMPLES:
        return np.nan
    _, number = np.unique(bin_numbers(current_a, soc)[seen], return_inverse=True)
    group = _joined(np.bincount(number))[number]
    return float((np.bincount(group, weights=covered[seen]) / np.bincount(group)).min())


def _joined(counts: IntArray) -> IntArray:
    """(bins,) number of the group of each bin: neighbours are joined until a group holds more than MIN_BIN_SAMPLES;
    what is left at the end goes to the last group."""
    group = np.zeros(len(counts), dtype=np.int64)
    current, held = 0, 0
    for place, count in enumerate(counts.tolist()):
        group[place] = current
        held += count
        if held > MIN_BIN_SAMPLES:
            current, held = current + 1, 0
    return np.minimum(group, current - 1) if held and current else group


def low_minute_share(records: Sequence[Array], dt_s: float) -> float:
    """Share of the sliding minute-long windows of all records with under 70 % coverage; NaN if all are shorter than a
    minute. No window spans two records.

    records : (n_i,) each, 1, 0, or NaN where missing, every dt_s; a window counts where half of it is seen.
    """
    length = max(1, round(MINUTE_S / dt_s))
    low = [_low_windows(covered, length) for covered in records if len(covered) >= length]
    windows = np.concatenate([np.empty(0, dtype=bool), *low])
    return float(np.mean(windows)) if len(windows) else np.nan


def _low_windows(covered: Array, length: int) -> BoolArray:
    """(windows,) whether the coverage is low in each window of `length` samples of which half is seen."""
    seen = np.isfinite(covered)
    hits = _sliding_sum(np.where(seen, covered, 0.0), length)
    counts = _sliding_sum(seen.astype(float), length)
    use = counts >= length / 2
    # The sums of ones are exact, the product with 0.7 is not: the slack is for that.
    return np.asarray(hits[use] < LOW_MINUTE_COVERAGE * counts[use] - 1e-9)


def _sliding_sum(values: Array, length: int) -> Array:
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray(total[length:] - total[:-length])
