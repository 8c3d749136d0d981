"""Fewer points with the same picture: the lowest and the highest sample of each bucket of a series."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from aesi.numerics.typing import Array

Keep = Literal["minmax", "min", "max"]


def envelope(y: Array, limit: int, keep: Keep = "minmax") -> NDArray[np.intp]:
    """Indices, in order, of at most `limit` samples that keep every extreme of `y`.

    y : (n,), any unit; buckets are equal in samples. All indices come back where n <= limit. The first and
    the last sample are kept. `min` and `max` keep one side only, for the edges of a band.
    """
    n = len(y)
    if n <= limit:
        return np.arange(n)
    buckets = max((limit - 2) // 2, 1)
    edges = np.linspace(0, n, buckets + 1).astype(np.intp)
    filled = np.where(np.isnan(y), np.inf, y)
    low = _first_extreme(filled, edges)
    high = _first_extreme(np.where(np.isnan(y), np.inf, -y), edges)
    sides = {"minmax": (low, high), "min": (low,), "max": (high,)}[keep]
    return np.unique(np.concatenate([[0], *sides, [n - 1]]))


def _first_extreme(y: Array, edges: NDArray[np.intp]) -> NDArray[np.intp]:
    """Index of the smallest value in each [edges[i], edges[i + 1])."""
    lowest = np.repeat(np.minimum.reduceat(y, edges[:-1]), np.diff(edges))
    hits = np.flatnonzero(y == lowest)
    return hits[np.searchsorted(hits, edges[:-1])]
