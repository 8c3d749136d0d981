"""How the size of a free-run error depends on current and on what the model was fitted to.

    s = a + u |I| + v |mean of I over the last minute| + w x + y g,     all weights >= 0    (1)

The error of a cell model grows with the current; with x, by which the leverage of a sample exceeds that of the fitted
rows (`aesi.sparse.leverage`); and with g, which grows with the distance of the state of charge from theirs (seen.py).
No term is in the state of charge itself, since it overfits the calibration drives and fails on the next one: with one
below a quarter of the charge, the bands of AESI I over the development splits of the NMC drive in `aesi bench splits`
cover 90.6 % and 50 % of the worst drive at a Winkler score of 51.3 mV, without it 94.2 and 75 % at 47.0 mV.
s is the 1 - alpha quantile of |error|, by linear quantile regression; a term whose weight would be negative is left
out, so that s stays positive where it extrapolates, and a floor keeps it away from zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from aesi.numerics.quantile_regression import fit_quantiles
from aesi.numerics.typing import Array, SavedState

MEMORY_S = 60.0
"""Time constant of the mean current: about that of salt diffusion in the electrolyte. Over the same splits the score
moves by 0.6 mV at most with a third or three times of it."""
RELATIVE_FLOOR = 0.1
"""Least s, as a share of the mean |error|: it keeps s away from zero. With a tenth or three times of it the score moves
by 0.1 mV at most."""
MOST_ROWS = 6000
"""Rows the regression looks at, evenly spread: neighbouring errors of a free run say nearly the same."""


@dataclass(frozen=True, eq=False)
class LocalScale:
    """weights : (5,) a in V, u, v in V/A and w, y in V.  floor : V, the least s."""

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


def covariates(current_a: Array, dt_s: float, excess: Array | None = None, gap: Array | None = None) -> Array:
    """Columns of (1) for one continuous record: current_a (n,) A, dt_s in s, excess, gap (n,); (n, p)."""
    from scipy.signal import lfilter

    keep = np.exp(-dt_s / MEMORY_S)
    mean, _ = lfilter(
        [1 - keep], [1, -keep], current_a, zi=[keep * current_a[0]] if len(current_a) else [0.0]
    )
    n = len(current_a)
    beyond, apart = (np.zeros(n) if each is None else each for each in (excess, gap))
    return np.column_stack([np.ones(n), np.abs(current_a), np.abs(mean), beyond, apart])


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
