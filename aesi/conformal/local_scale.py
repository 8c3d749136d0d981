"""How the size of a free-run error depends on current and state of charge.

    s = a + b (LOW_SOC - soc)+ + u |I| + v |mean of I over the last minute|,     a, b, u, v >= 0      (1)

The error of a cell model grows with the current and towards the steep end of its discharge. Few terms on
purpose: a free function of the state of charge follows the calibration drive and fails on the next one.
Fitted to |error| by non-negative least squares, so that s never turns negative where it extrapolates; a floor
keeps it positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.optimize import nnls
from scipy.signal import lfilter

from aesi.conformal.band import State
from aesi.numerics.typing import Array

LOW_SOC = 0.25
MEMORY_S = 60.0
RELATIVE_FLOOR = 0.1
"""s stays above this share of the mean |error|: a scale near zero would promise a perfect model."""


@dataclass(frozen=True, eq=False)
class LocalScale:
    """weights : (4,) a, b in V and u, v in V/A.  floor : V."""

    weights: Array
    floor: float

    @classmethod
    def fit(cls, covariates: Array, sizes: Array) -> Self:
        """covariates : (n, p) of `covariates`.  sizes : (n,) V, |error|."""
        weights, _ = nnls(covariates, sizes)
        return cls(weights, max(RELATIVE_FLOOR * float(np.mean(sizes)), float(np.finfo(float).tiny)))

    def __call__(self, covariates: Array) -> Array:
        """(n,) V, > 0."""
        return np.asarray(np.maximum(covariates @ self.weights, self.floor))

    def to_state(self) -> State:
        """Weights and floor."""
        return {"weights": self.weights, "floor": self.floor}

    @classmethod
    def from_state(cls, state: State) -> Self:
        """Inverse of `to_state`."""
        return cls(np.asarray(state["weights"], dtype=float), float(state["floor"]))


def covariates(current_a: Array, soc: Array, dt_s: float) -> Array:
    """Columns of (1) for one continuous record: current_a (n,) A, soc (n,), dt_s in s; (n, p)."""
    keep = np.exp(-dt_s / MEMORY_S)
    mean, _ = lfilter(
        [1 - keep], [1, -keep], current_a, zi=[keep * current_a[0]] if len(current_a) else [0.0]
    )
    low = np.maximum(LOW_SOC - soc, 0.0)
    return np.column_stack([np.ones(len(soc)), low, np.abs(current_a), np.abs(mean)])
