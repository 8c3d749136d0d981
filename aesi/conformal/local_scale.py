"""How the size of a free-run error depends on current, state of charge, and what the model was fitted to.

    s = a + b (LOW_SOC - soc)+ + u |I| + v |mean of I over the last minute| + w x + y g,     all weights >= 0    (1)

The error of a cell model grows with the current and towards the steep end of its discharge; with x, by which the
leverage of a sample exceeds that of the fitted rows (`aesi.sparse.leverage`); and with g, which grows with the distance
of the state of charge from theirs (seen.py). There are few terms because a flexible function of the state of charge
overfits the calibration drive and fails on the next one. s is the 1 - alpha quantile of |error|, by linear quantile
regression; a term whose weight would be negative is left out, so that s stays positive where it extrapolates, and a
floor keeps it away from zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.signal import lfilter

from aesi.numerics.quantile_regression import fit_quantiles
from aesi.numerics.typing import Array, SavedState

LOW_SOC = 0.25
"""Below it open-circuit potentials turn steep. A convention, like MEMORY_S; `aesi bench bands` shows what the bands
are worth."""
MEMORY_S = 60.0
"""Time constant of the mean current: about that of salt diffusion in the electrolyte."""
RELATIVE_FLOOR = 0.1
"""Least s, as a share of the mean |error|. A convention."""
MOST_ROWS = 6000
"""Rows the regression looks at, evenly spread: neighbouring errors of a free run say nearly the same."""


@dataclass(frozen=True, eq=False)
class LocalScale:
    """weights : (6,) a, b in V, u, v in V/A and w, y in V.  floor : V, the least s."""

    weights: Array
    floor: float

    @classmethod
    def fit(cls, covariates: Array, sizes: Array, alpha: float) -> Self:
        """covariates : (n, p) of `covariates`.  sizes : (n,) V, |error|.  alpha : share of sizes above s."""
        step = -(-len(sizes) // MOST_ROWS)
        weights = _nonnegative_quantile(covariates[::step], sizes[::step], 1 - alpha)
        return cls(weights, max(RELATIVE_FLOOR * float(np.mean(sizes)), float(np.finfo(float).tiny)))

    def __call__(self, covariates: Array) -> Array:
        """(n,) V, > 0."""
        return np.asarray(np.maximum(covariates @ self.weights, self.floor))

    def to_state(self) -> SavedState:
        """Plain values and numpy arrays only."""
        return {"weights": self.weights, "floor": self.floor}

    @classmethod
    def from_state(cls, state: SavedState) -> Self:
        """Inverse of `to_state`."""
        return cls(np.asarray(state["weights"], dtype=float), float(state["floor"]))


def covariates(
    current_a: Array, soc: Array, dt_s: float, excess: Array | None = None, gap: Array | None = None
) -> Array:
    """Columns of (1) for one continuous record: current_a (n,) A, soc (n,), dt_s in s, excess, gap (n,); (n, p)."""
    keep = np.exp(-dt_s / MEMORY_S)
    mean, _ = lfilter(
        [1 - keep], [1, -keep], current_a, zi=[keep * current_a[0]] if len(current_a) else [0.0]
    )
    low = np.maximum(LOW_SOC - soc, 0.0)
    beyond, apart = (np.zeros(len(soc)) if each is None else each for each in (excess, gap))
    return np.column_stack([np.ones(len(soc)), low, np.abs(current_a), np.abs(mean), beyond, apart])


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
