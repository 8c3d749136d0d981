"""`aesi bench drift`: do adaptive intervals keep their coverage at every current while the error of a cell drifts?

The residuals are normal, with a standard deviation that depends on the range of the current. The intervals begin with
the right width for each range. Over the record the standard deviation then grows linearly to twice its value: at no
current (`none`), at all currents (`all`), or in the range of the highest current alone (`hardest`). Only the adaptive
step of the intervals is tested, without the method that sets their first width. `score_ratio` is the interval score
over that of the best intervals, which know the drift.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench.intervals.spci import NORMAL_95
from aesi.conformal.online.scale import GROUP_LEVELS
from aesi.conformal.online.tracker import replay
from aesi.conformal.registry import RATE
from aesi.conformal.scores import interval_score
from aesi.numerics.typing import Array, IntArray

ALPHA = 0.1
"""Nominal share of misses: intervals for 90 %."""
SIZE_V = 1e-3
"""Standard deviation of a residual in the range of the lowest current, V. A convention."""
GROWTH = 4.0
"""Ratio of the standard deviations in the ranges of the highest and the lowest current. A convention."""
HOLD = 30
"""Number of samples for which the current stays in one range. A convention."""
DRIFTS = ("none", "all", "hardest")
"""Ranges of the current in which the standard deviation grows."""


def run(
    records: PositiveInt = 100, n: PositiveInt = 3000, seed: NonNegativeInt = 0
) -> Iterator[dict[str, Any]]:
    """One row per kind of drift, with means over `records` records of n samples each.

    `short_pct` is the share of records with less than nominal coverage, `worst_range_coverage_pct` the coverage in the
    range of the current where it is lowest (mean over the records).  seed : of the residuals.
    """
    rng = np.random.default_rng(seed)
    for drift in DRIFTS:
        figures = np.array([_record(drift, n, rng) for _ in range(records)])
        coverage, worst, ratio = figures.mean(axis=0)
        yield {
            "drift": drift,
            "records": records,
            "coverage_pct": round(100 * float(coverage), 2),
            "short_pct": round(100 * float(np.mean(figures[:, 0] < 1 - ALPHA)), 1),
            "worst_range_coverage_pct": round(100 * float(worst), 2),
            "score_ratio": round(float(ratio), 4),
        }


def _record(drift: str, n: int, rng: np.random.Generator) -> tuple[float, float, float]:
    """(coverage; coverage of the range of the current where it is lowest; interval score over that of the best
    intervals) of one record. Coverages are shares, 0 to 1."""
    groups = _ranges(n, rng)
    last = len(GROUP_LEVELS)
    sizes = SIZE_V * (1.0 + (GROWTH - 1.0) * groups / last)
    grown = {"none": np.zeros(n, bool), "all": np.ones(n, bool), "hardest": groups == last}[drift]
    true = sizes * (1.0 + grown * np.linspace(0.0, 1.0, n))
    residuals = true * rng.standard_normal(n)
    low, high = -NORMAL_95 * sizes, NORMAL_95 * sizes
    replay(low, high, np.ones(n, bool), residuals, groups, np.zeros(last + 1), RATE, ALPHA, 0.0)
    covered = (residuals >= low) & (residuals <= high)
    worst = min(float(covered[groups == g].mean()) for g in np.unique(groups))
    best: Array = NORMAL_95 * true
    score = interval_score(low, high, residuals, ALPHA) / interval_score(-best, best, residuals, ALPHA)
    return float(covered.mean()), worst, score


def _ranges(n: int, rng: np.random.Generator) -> IntArray:
    """(n,) range of the current of each sample, 0 the lowest. Ranges occur with the frequencies by which GROUP_LEVELS
    divides the currents of a record."""
    drawn = np.searchsorted(GROUP_LEVELS, rng.uniform(size=-(-n // HOLD)))
    return np.repeat(drawn, HOLD)[:n].astype(np.int64)
