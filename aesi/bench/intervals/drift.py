"""`aesi bench drift`: does the adaptive step hold coverage at every current while the error of a cell drifts?

Normal residuals whose size depends on the range of the current, calibrated bands for them, and a record over which the
size grows linearly to twice what it was: at no current, at all of them, or at the hardest alone. Each range's coverage
and the interval score are those of the adaptive step by itself; `score_ratio` is over the score of the best band, which
knows the drift.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.conformal.online.scale import GROUP_LEVELS
from aesi.conformal.online.tracker import replay
from aesi.conformal.registry import RATE
from aesi.conformal.scores import interval_score
from aesi.numerics.typing import Array, IntArray

ALPHA, NORMAL_95 = 0.1, 1.6448536269514722
SIZE_V = 1e-3
"""Size of a residual at the mildest current, V; at the hardest it is GROWTH times as large, conventions all."""
GROWTH = 4.0
HOLD = 30
"""Samples that a current lasts. A convention."""
DRIFTS = ("none", "all", "hardest")


def run(
    records: PositiveInt = 100, n: PositiveInt = 3000, seed: NonNegativeInt = 0
) -> Iterator[dict[str, Any]]:
    """One dict a kind of drift, means over `records` records of n samples each."""
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
    """Coverage, that of the range of the current that is covered least, and the score over that of the best band."""
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
    """(n,) range of the current that each sample is in, as often as their levels say."""
    drawn = np.searchsorted(GROUP_LEVELS, rng.uniform(size=-(-n // HOLD)))
    return np.repeat(drawn, HOLD)[:n].astype(np.int64)
