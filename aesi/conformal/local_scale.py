"""The size of a free-run error as a function of the uncertainty of physics and correction given the fitted rows.

    s = a + u p + w ln(1 + x),     all weights >= 0                                                        (1)

p is the standard deviation of the physics model's voltage by the posterior of its parameters (parameter_spread.py). It
follows the current, the depletion and the distance from the fitted states of charge as the model's voltage does. x, for
the correction, is the excess of a sample's leverage over that of the fitted rows (`aesi.sparse.leverage`). Its
logarithm is used, since polynomials grow without limit where the error does not.
s is the 1 - alpha quantile of |error|, by linear quantile regression. A term with a negative weight is left out, so
that s stays positive where it extrapolates; a floor keeps it away from zero.

Over the development splits of `aesi bench splits` (16 candidates) the bands of AESI I cover 95.5 % of the rows of the
NMC drive, 78.1 % of the worst test drive, at a Winkler score of 46.1 mV, those of the recalibrated model 95.7 and
80.2 % at 60.2 mV. With |I|, its mean over a minute, x and the distance in charge in place of p, and the wider of bands
calibrated on parts and on drives, it was 96.8 and 77.7 % at 57.0 mV, and 94.1 and 63.4 % at 90.5 mV. In the same order
on the other cells, mV: LG M50T 21.6, 28.9 instead of 22.1, 33.6; LG HG2 30.9, 34.0 instead of 35.9, 40.8; Panasonic
29.7, 39.2 instead of 33.1, 43.0, with an earlier file; nowhere less than 91 % of a drive is covered there. With |I|
beside p the score of the NMC drive is 4 mV higher; with x in place of its logarithm 2 mV.
With rates and diffusivities that may also change over the state of charge, as much as each may by itself, twice and
four times as much, among what p leaves open, AESI I scores 46.9, 48.9 and 52.5 mV on the NMC drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from aesi.numerics.files.restored import LEAST_POSITIVE, saved_array, saved_number
from aesi.numerics.quantile_regression import fit_quantiles
from aesi.numerics.typing import Array, SavedState

SHARE_OF_ERROR = 0.1
"""Least s, as a share of the mean |error|. With a tenth or three times of it the score changes by 0.1 mV at most."""
MOST_ROWS = 6000
"""Most rows in the regression, evenly spread: neighbouring errors of a free run have nearly the same information."""


@dataclass(frozen=True, eq=False)
class LocalScale:
    """The fitted scale (1).  weights : (3,) a in V, u, and w in V.  floor : least s, V."""

    weights: Array
    floor: float

    @classmethod
    def fit(cls, covariates: Array, sizes: Array, alpha: float) -> Self:
        """The scale fitted to errors.  covariates : (n, p) from `covariates`.  sizes : (n,) V, |error|.  alpha : share
        of sizes above s."""
        step = -(-len(sizes) // MOST_ROWS)
        weights = _nonnegative_quantile(covariates[::step], sizes[::step], 1 - alpha)
        return cls(weights, max(SHARE_OF_ERROR * float(np.mean(sizes)), float(np.finfo(float).tiny)))

    def __call__(self, covariates: Array) -> Array:
        """(n,) V, > 0: s at each row.  covariates : (n, p)."""
        return np.asarray(np.maximum(covariates @ self.weights, self.floor))

    def to_state(self) -> SavedState:
        """Plain values and numpy arrays only."""
        return {"weights": self.weights, "floor": self.floor}

    @classmethod
    def from_state(cls, state: SavedState) -> Self:
        """Inverse of `to_state`.  Raises ValueError for anything else."""
        floor = saved_number(state["floor"], "floor", LEAST_POSITIVE)
        return cls(saved_array(state["weights"], "weights", (3,), 0.0), floor)


def covariates(spread_v: Array, excess: Array | None) -> Array:
    """(n, p) columns of (1), from spread_v (n,) V and excess (n,), which is 0 where the model has no leverage."""
    n = len(spread_v)
    beyond = np.zeros(n) if excess is None else np.log1p(excess)
    return np.column_stack([np.ones(n), spread_v, beyond])


def _nonnegative_quantile(columns: Array, sizes: Array, level: float) -> Array:
    """(p,) weights >= 0 of a quantile regression; columns with a negative weight are dropped, most negative first."""
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
