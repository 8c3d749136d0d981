"""Sequentially thresholded ridge regression, the paper's equations (11) and (12).

    xi = argmin |y - Theta xi|**2 + lambda1 |xi|**2,    then xi_j = 0 where |xi_j| < lambda2,

repeated on the remaining terms until none is dropped. The norms are squared, as in ridge regression. It is solved
through triangular factors: the normal equations would lose the accuracy of cancelling coefficients in a collinear
library, all the more as lambda1 goes down to 1e-13.

Rudy, Alla, Brunton & Kutz, SIAM J. Appl. Dyn. Syst. 18 (2019) 643, doi:10.1137/18M1191944.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np
from scipy.linalg import lapack

from aesi.errors import DataError, ParameterError, in_words
from aesi.numerics.typing import Array, IntArray, Numbers
from aesi.records.checked import numbers, row_words

COLLINEAR = 1e-12
"""Share of a term's size that the terms before it have to leave of it; with less it is their sum, and what is left is
round-off: at most 1e-15 of a term that is the sum of five others, along 200 to 100,000 rows. The least ridge of a
search, 1e-13, leaves 1e-9 of a term along 100,000 rows, so that none in a search is told so."""


@dataclass(frozen=True)
class STRidge:
    """The solver.  lambda1 : ridge weight, >= 0.  lambda2 : smallest coefficient kept, >= 0, in scaled units.
    max_iter : most solves, >= 1.  Raises ParameterError for others, and for a weight without end."""

    lambda1: float
    lambda2: float
    max_iter: int = 20

    def __post_init__(self) -> None:
        for name in ("lambda1", "lambda2"):
            if not isinstance(getattr(self, name), Real):
                raise ParameterError(f"{name} = {in_words(getattr(self, name))} is not a number; give one.")
        if not isinstance(self.max_iter, int | np.integer):
            raise ParameterError(f"max_iter = {in_words(self.max_iter)} is not a whole number; give one.")
        if not (0 <= self.lambda1 < np.inf and 0 <= self.lambda2 < np.inf and self.max_iter >= 1):
            raise ParameterError(
                f"lambda1 = {self.lambda1:g} and lambda2 = {self.lambda2:g} must not be negative and must be finite, "
                f"and max_iter = {self.max_iter} must be at least 1."
            )

    def fit(self, theta: Numbers, y: Numbers, weights: Numbers | None = None) -> Array:
        """Coefficients (m,) of the weighted problem; theta (n, m), y (n,), weights (n,) >= 0.

        Raises DataError for other shapes, for a value that is not finite or no real number, and for a negative weight.
        """
        theta, y = numbers(theta, "theta"), numbers(y, "y")
        if theta.ndim != 2 or y.shape != theta.shape[:1] or not theta.size:
            raise DataError(
                f"theta and y have shapes {theta.shape} and {y.shape}; give (n, m) and (n,), n at least 1 and m too."
            )
        if not (np.isfinite(theta).all() and np.isfinite(y).all()):
            raise DataError("theta or y holds a value that is not finite; drop such rows first.")
        augmented = np.column_stack([theta, y])
        if weights is not None:
            augmented *= np.sqrt(_checked_weights(weights, len(y)))[:, None]
        return self.fit_factor(triangle(augmented))

    def fit_factor(self, factor: Array) -> Array:
        """Coefficients (m,) from a factor F (any rows, m + 1) with F' F = [Theta y]' W [Theta y]."""
        m = factor.shape[1] - 1
        r = self._with_ridge(factor)
        coefficients = np.zeros(m)
        kept: IntArray = np.arange(m)
        for _ in range(self.max_iter):
            solution = _solve(r, len(kept))
            stays = np.abs(solution) >= self.lambda2
            coefficients[:] = 0.0
            coefficients[kept[stays]] = solution[stays]
            if stays.all() or not stays.any():
                break
            kept = kept[stays]
            # R' R holds the ridge, which is diagonal, so its columns pose the smaller problem exactly.
            r = triangle(r[:, np.append(stays, True)])
        return coefficients

    def _with_ridge(self, factor: Array) -> Array:
        m = factor.shape[1] - 1
        ridge = np.zeros((m, m + 1))
        np.fill_diagonal(ridge, np.sqrt(self.lambda1))
        if len(factor) == m + 1 and not np.tril(factor, -1).any():
            return _merge_triangles(factor, ridge)
        return triangle(np.vstack([factor, ridge]))


def _checked_weights(weights: Numbers, n: int) -> Array:
    """(n,) of the rows.  Raises DataError for another shape, and for a weight that is negative or not finite."""
    given = numbers(weights, "weights")
    if given.shape != (n,):
        raise DataError(
            f"weights have the shape {given.shape}, and theta has {n} rows; give one weight a row."
        )
    wrong = ~((given >= 0) & (given < np.inf))  # this way round, NaN is wrong too
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError(f"weights is {given[row]:g} in {row_words(row)}; give finite weights from 0 on.")
    return given


def triangle(matrix: Array) -> Array:
    """R (m, m) of a QR factorisation of a (n, m) matrix, padded with zero rows where n < m."""
    n, m = matrix.shape
    packed, _, _, _ = lapack.dgeqrf(matrix, lwork=64 * m)
    r = np.triu(packed[:m])
    return r if n >= m else np.vstack([r, np.zeros((m - n, m))])


def _merge_triangles(upper: Array, ridge: Array) -> Array:
    """R of two upper triangles stacked, at a fifth of the cost of the general case."""
    m = upper.shape[1]
    below = np.zeros((m, m), order="F")
    below[: m - 1] = ridge
    merged, _, _, _ = lapack.dtpqrt(m, min(32, m), np.asfortranarray(upper), below)
    return np.triu(merged)


def _solve(r: Array, m: int) -> Array:
    square = r[:m, :m]
    if np.all(np.abs(np.diag(square)) > COLLINEAR * np.linalg.norm(square, axis=0)):
        solution, info = lapack.dtrtrs(square, r[:m, m])
        if info == 0 and np.isfinite(solution).all():
            return solution
    # Collinear terms and no ridge: the shortest of the many solutions.
    return np.asarray(np.linalg.lstsq(square, r[:m, m], rcond=COLLINEAR)[0], dtype=float)
