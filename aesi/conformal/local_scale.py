"""How the size of a free-run error depends on current and state of charge.

    q = a + b (LOW_SOC - soc)+ + u |I| + v |mean of I over the last minute|,     a, b, u, v >= 0      (1)
    s = m (q / m)**TRUST,     m the 1 - alpha quantile of all |error|                                  (2)

The error of a cell model grows with the current and towards the steep end of its discharge. Few terms on
purpose: a free function of the state of charge follows the calibration drive and fails on the next one.
q is the 1 - alpha quantile of |error|, by linear quantile regression; a term whose weight would be negative is
left out, so that q does not turn negative where it extrapolates, and a floor keeps it positive. (2) shrinks it
towards one width for all, because a handful of pieces cannot tell how errors grow from how they happen to differ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.signal import lfilter

from aesi.conformal.band import State
from aesi.numerics.quantile_regression import fit_quantiles
from aesi.numerics.typing import Array

LOW_SOC = 0.25
MEMORY_S = 60.0
TRUST = 0.7
"""A judgement between one width for all (0) and the fitted size as it is (1). `aesi bench bands` shows what it gives,
beside one width for all."""
RELATIVE_FLOOR = 0.1
"""q stays above this share of the mean |error|: a scale near zero would promise a perfect model."""
MOST_ROWS = 6000
"""Rows the regression looks at, evenly spread: neighbouring errors of a free run say nearly the same."""


@dataclass(frozen=True, eq=False)
class LocalScale:
    """weights : (4,) a, b in V and u, v in V/A.  middle, floor : V, m of (2) and the least q."""

    weights: Array
    middle: float
    floor: float

    @classmethod
    def fit(cls, covariates: Array, sizes: Array, alpha: float) -> Self:
        """covariates : (n, p) of `covariates`.  sizes : (n,) V, |error|.  alpha : share of sizes above q."""
        step = -(-len(sizes) // MOST_ROWS)
        weights = _nonnegative_quantile(covariates[::step], sizes[::step], 1 - alpha)
        least = float(np.finfo(float).tiny)
        middle = max(float(np.quantile(sizes, 1 - alpha)), least)
        return cls(weights, middle, max(RELATIVE_FLOOR * float(np.mean(sizes)), least))

    def __call__(self, covariates: Array) -> Array:
        """(n,) V, > 0."""
        size = np.maximum(covariates @ self.weights, self.floor)
        return np.asarray(self.middle * (size / self.middle) ** TRUST)

    def to_state(self) -> State:
        """Plain values and numpy arrays only."""
        return {"weights": self.weights, "middle": self.middle, "floor": self.floor}

    @classmethod
    def from_state(cls, state: State) -> Self:
        """Inverse of `to_state`."""
        return cls(np.asarray(state["weights"], dtype=float), float(state["middle"]), float(state["floor"]))


def covariates(current_a: Array, soc: Array, dt_s: float) -> Array:
    """Columns of (1) for one continuous record: current_a (n,) A, soc (n,), dt_s in s; (n, p)."""
    keep = np.exp(-dt_s / MEMORY_S)
    mean, _ = lfilter(
        [1 - keep], [1, -keep], current_a, zi=[keep * current_a[0]] if len(current_a) else [0.0]
    )
    low = np.maximum(LOW_SOC - soc, 0.0)
    return np.column_stack([np.ones(len(soc)), low, np.abs(current_a), np.abs(mean)])


def _nonnegative_quantile(columns: Array, sizes: Array, level: float) -> Array:
    """(p,) weights >= 0: the regression without the columns whose weight came out negative, worst first."""
    spread = columns.std(axis=0)
    spread[0] = 1.0  # the constant
    kept = np.flatnonzero(spread > 0)
    weights = np.zeros(columns.shape[1])
    while kept.size:
        found = fit_quantiles(columns[:, kept], sizes, np.array([level]))[:, 0]
        if (found >= 0).all():
            weights[kept] = found
            return weights
        kept = np.delete(kept, np.argmin(found * np.maximum(spread[kept], 1e-300)))
    return weights
