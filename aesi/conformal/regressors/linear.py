"""Linear quantile regression on the causal history.

    Q_tau(e[k] | past) = a_tau + b_tau . features[k]

The features are of degree one in the residuals, so location and scale of the band follow the recent location
and scale: an autoregression with a changing variance lies inside the model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from aesi.conformal.regressors.model import FitTask, Kinds, QuantileModel
from aesi.numerics.compiled import kept_njit
from aesi.numerics.files.restored import saved_array
from aesi.numerics.quantile_regression import fit_quantiles
from aesi.numerics.typing import Array, SavedState


@kept_njit()
def _affine(rows: Array, intercept: Array, slope: Array, out: Array) -> None:
    # Written out so that one row and many rows round alike; BLAS gives no such promise.
    for k in range(rows.shape[0]):
        for j in range(intercept.size):
            total = intercept[j]
            for i in range(rows.shape[1]):
                total += slope[i, j] * rows[k, i]
            out[k, j] = total


@dataclass(frozen=True, eq=False)
class LinearQuantiles(QuantileModel):
    """intercept : (2 B,) V.  slope : (p, 2 B)."""

    intercept: Array
    slope: Array
    kind: ClassVar[str] = "linear"

    @classmethod
    def fit(cls, task: FitTask) -> Self:
        """Rows weigh by one over their local scale, so that one smoothing width suits quiet and busy times."""
        weights = 1 / (local_scale(task) + task.floor_v)
        design = np.column_stack([np.ones(len(task.rows)), task.rows]) * weights[:, None]
        coefficients = fit_quantiles(design, task.targets * weights, task.levels)
        return cls(coefficients[0].copy(), np.ascontiguousarray(coefficients[1:]))

    def quantiles(self, rows: Array) -> Array:
        out = np.empty((len(rows), self.intercept.size))
        _affine(rows, self.intercept, self.slope, out)
        return out

    def check_columns(self, count: int) -> None:
        if len(self.slope) != count:
            raise ValueError(f"slope has {len(self.slope)} rows for {count} columns")

    def to_state(self) -> SavedState:
        return {"intercept": self.intercept, "slope": self.slope}

    @classmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        intercept = saved_array(state["intercept"], "intercept", (None,))
        return cls(intercept, saved_array(state["slope"], "slope", (None, len(intercept))))


def local_scale(task: FitTask) -> Array:
    """(n,) V: mean absolute value of the history's features, a causal scale that makes rows comparable."""
    return np.asarray(np.mean(np.abs(task.rows[:, : task.n_history]), axis=1))
