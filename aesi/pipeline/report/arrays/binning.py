"""Voltage error over the operating range: maps over (current, SOC) and profiles over one variable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array

LEAST_SAMPLES = 3
"""Bins with fewer samples stay blank: their mean says more about the record than about the model."""


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """Mean over bins: current_a (n_current,), soc (n_soc,) at the centres; mean (n_soc, n_current), NaN where
    a bin has too few samples; count (n_soc, n_current)."""

    current_a: Array
    soc: Array
    mean: Array
    count: Array


@dataclass(frozen=True, eq=False)
class BinnedQuartiles:
    """Quartiles of y in bins of x, (n_bins,) each; empty bins are left out."""

    x: Array
    low: Array
    median: Array
    high: Array


def error_map(current_a: Array, soc: Array, error: Array, bins: int = 24) -> ErrorMap:
    """Mean of `error` (any unit, sign as given) in bins over (current, SOC); all arguments (n,).

    Rows with a value that is not finite (a simulation that stopped early) are left out.
    """
    current_a, soc, error = _finite(current_a, soc, error)
    edges_current, edges_soc = _edges(current_a, bins), _edges(soc, bins)
    box = (edges_soc, edges_current)
    count, _, _ = np.histogram2d(soc, current_a, bins=box)
    total, _, _ = np.histogram2d(soc, current_a, bins=box, weights=error)
    mean = np.full_like(total, np.nan)
    enough = count >= LEAST_SAMPLES
    mean[enough] = total[enough] / count[enough]
    return ErrorMap(_centres(edges_current), _centres(edges_soc), mean, count)


def profile(x: Array, y: Array, bins: int = 30) -> BinnedQuartiles:
    """Median and quartiles of `y` in equal bins of `x`; (n,) each; rows that are not finite are left out."""
    x, y = _finite(x, y)
    edges = _edges(x, bins)
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    order = np.argsort(index, kind="stable")
    starts = np.searchsorted(index[order], np.arange(bins + 1))
    full = [i for i in range(bins) if starts[i + 1] - starts[i] >= LEAST_SAMPLES]
    groups = [y[order[starts[i] : starts[i + 1]]] for i in full]
    low, median, high = (np.array([np.percentile(g, q) for g in groups]) for q in (25, 50, 75))
    return BinnedQuartiles(_centres(edges)[full], low, median, high)


def _finite(*columns: Array) -> tuple[Array, ...]:
    keep = np.all([np.isfinite(c) for c in columns], axis=0)
    return tuple(c[keep] for c in columns)


def _edges(x: Array, bins: int) -> Array:
    low, high = float(np.min(x)), float(np.max(x))
    if low == high:  # a constant current still makes one column
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, bins + 1)


def _centres(edges: Array) -> Array:
    return (edges[:-1] + edges[1:]) / 2
