"""The leverage of a sample: its distance from the rows of a regression's fit.

    h(x)**2 = theta(x)' (Theta' W Theta + lambda1 1)^-1 theta(x), the leverage                           (1)
    excess  = max(h / h_u - 1, 0),     h_u the upper quartile of h over the training rows                 (2)

h is the standard error of the fitted value at x, in units of the noise. It detects combinations that the ranges of the
single inputs do not: a high current at a state of charge where no fitted current was high. The error of a wrong model
grows with h too. W are the weights of the rows, lambda1 is the ridge. (2) has no unit, so that models with different
rows can be compared. Where h is zero in three quarters of the rows, h_u is that of the others. Hoaglin & Welsch, Am.
Stat. 32 (1978) 17, doi:10.1080/00031305.1978.10479237.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.linalg import solve_triangular

from aesi.numerics.files.restored import LEAST_POSITIVE, saved_array, saved_number
from aesi.numerics.typing import Array
from aesi.sparse.stridge import triangle

UPPER_QUARTILE = 0.75
"""Quantile of h over the fitted rows above which a row counts as extreme."""
LEAST_RIDGE = 1e-12
"""Least ridge, as a share of the largest squared diagonal: collinear terms without a ridge leave directions without
any information."""


@dataclass(frozen=True, eq=False)
class Leverage:
    """root : (m, m) upper triangle R with R'R the matrix inverted in (1).  upper_quartile : h_u of (2)."""

    root: Array
    upper_quartile: float

    @classmethod
    def of(cls, factor: Array, lambda1: float, theta: Array) -> Self:
        """factor : (any, m) F with F'F = Theta' W Theta.  theta : (m, n) the terms along the training rows."""
        top = float(np.max(np.sum(factor**2, axis=0)))
        ridge = np.sqrt(max(lambda1, LEAST_RIDGE * top)) * np.eye(len(theta))
        root = triangle(np.vstack([factor, ridge]))
        error = _standard_error(root, theta)
        upper_quartile = float(np.quantile(error, UPPER_QUARTILE))
        if upper_quartile == 0.0:  # no term is other than zero in most rows: those of rests between pulses
            upper_quartile = float(np.quantile(error[error > 0.0], UPPER_QUARTILE))
        return cls(root, upper_quartile)

    def excess(self, theta: Array) -> Array:
        """(n,) of (2), >= 0; theta : (m, n)."""
        return np.asarray(np.maximum(_standard_error(self.root, theta) / self.upper_quartile - 1.0, 0.0))

    def to_dict(self) -> dict[str, Any]:
        """Plain values and an array."""
        return {"root": self.root, "upper_quartile": self.upper_quartile}

    @classmethod
    def from_dict(cls, data: dict[str, Any], n_terms: int) -> Self:
        """Inverse of `to_dict`, for so many terms; the array may come back as lists.  Raises ValueError for anything
        else."""
        upper_quartile = saved_number(data["upper_quartile"], "upper_quartile", LEAST_POSITIVE)
        return cls(saved_array(data["root"], "root", (n_terms, n_terms)), upper_quartile)


def _standard_error(root: Array, theta: Array) -> Array:
    """(n,) h of (1), the root of the leverage: standard error of the fitted value over that of the noise."""
    return np.asarray(np.linalg.norm(solve_triangular(root, theta, trans="T"), axis=0))
