"""Exact weighted Gram matrices of many resamples at once, and triangular factors of them.

For a library A with n rows, A = Q R with orthonormal Q, and for each resample with row weights w

    A' W A = R' (Q' W Q) R = F' F,    Q' W Q = L L',    F = L' R

Q' W Q is well conditioned even where A' A is not, so F keeps the digits that normal equations would lose.

Weights are whole numbers, constant over long runs of rows. Cells are groups of CELL rows. One product of the
(resamples x cells) smallest weights with the Gram matrices of the cells gives most of the sum; rows whose weight
exceeds the smallest of their cell are added one resample at a time.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh, lapack, qr
from scipy.linalg.blas import dsyrk, dtrmm

from aesi.numerics.blocks import CountArray
from aesi.numerics.typing import Array

CELL = 25
"""Rows per cell; like _CELLS_AT_ONCE and _COLUMNS_AT_ONCE it affects only the speed, by the size of the cache."""
_CELLS_AT_ONCE = 160
_COLUMNS_AT_ONCE = 64


def orthonormal(matrix: Array) -> tuple[Array, Array]:
    """(Q (n, m) stored by rows, R (m, m) upper triangular) of a matrix stored by columns, which is overwritten."""
    q, r = qr(matrix, mode="economic", overwrite_a=True, check_finite=False)
    return np.ascontiguousarray(q), r


def weighted_grams(rows: Array, weights: CountArray) -> Array:
    """(resamples, m, m): rows' diag(w) rows for each weight vector w.

    rows : (n, m) stored by rows.  weights : (resamples, n).
    """
    n, m = rows.shape
    whole = n // CELL * CELL
    by_cell = weights[:, :whole].reshape(len(weights), -1, CELL).min(axis=2)
    as_float = by_cell.astype(float)
    grams = np.zeros((len(weights), m, m))  # zero below the diagonal too, since terms are added
    cells = rows[:whole].reshape(-1, CELL, m)
    for start in range(0, m, _COLUMNS_AT_ONCE):
        stop = min(start + _COLUMNS_AT_ONCE, m)
        grams[:, :stop, start:stop] = _upper_columns(cells, as_float, start, stop)
    lower = np.tril_indices(m, -1)
    for gram, weight, smallest in zip(grams, weights, by_cell, strict=True):
        extra = weight.copy()
        extra[:whole] -= np.repeat(smallest, CELL)
        extra_rows = np.flatnonzero(extra)
        if len(extra_rows):
            scaled = rows[extra_rows]
            scaled *= np.sqrt(extra[extra_rows].astype(float))[:, None]
            gram += np.triu(dsyrk(1.0, scaled.T, lower=0))  # dsyrk leaves memory below the diagonal undefined
        gram[lower] = gram.T[lower]
    return grams


def _upper_columns(cells: Array, by_cell: Array, start: int, stop: int) -> Array:
    """(resamples, stop, stop - start): these columns, down to row stop, of the Gram matrices of the cells,
    (n_cells, CELL, m), summed with the weights by_cell (resamples, n_cells)."""
    total = np.zeros((len(by_cell), stop * (stop - start)))
    for a in range(0, len(cells), _CELLS_AT_ONCE):
        block = cells[a : a + _CELLS_AT_ONCE]
        products = np.matmul(block[:, :, :stop].transpose(0, 2, 1), block[:, :, start:stop])
        total += by_cell[:, a : a + _CELLS_AT_ONCE] @ products.reshape(len(block), -1)
    return total.reshape(len(by_cell), stop, stop - start)


def triangular_factors(grams: Array, r: Array) -> Array:
    """F with F' F = R' gram R for each gram, in place: (resamples, m, m), upper triangular where possible.

    Where a resample has no information on a direction, its Gram matrix is singular; then an eigendecomposition
    with negative round-off set to zero gives F, which is not triangular.
    """
    for k, gram in enumerate(grams):
        upper, info = lapack.dpotrf(gram, lower=0, clean=1)
        if info == 0:
            grams[k] = dtrmm(1.0, upper, r, lower=0)
        else:
            squares, vectors = eigh(gram, check_finite=False)
            grams[k] = (vectors * np.sqrt(np.maximum(squares, 0.0))).T @ r
    return grams
