"""Triangular factors of the library along the training rows, once for all candidates of a search.

All candidates are judged on the same resamples (common random numbers), so their Gram matrices can be computed once for
the whole library and sliced. Three kinds of row weights are fitted:

- moving-block bootstrap resamples, for the ensemble and its out-of-bag loss;
- folds: all rows but one contiguous piece, for out-of-fold residuals, and for the validation loss where there
  are no validation records;
- all rows, for the refit after stability selection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.numerics.blocks import CountArray, Span, leave_out_weights
from aesi.numerics.typing import Array
from aesi.numerics.weighted_grams import orthonormal, triangular_factors, weighted_grams
from aesi.sparse.search.rows import TrainingRows


@dataclass(frozen=True, eq=False)
class Factors:
    """factors : (resamples, any, m + 1).  fold_factors : (n_folds, any, m + 1).  full_factor : (any, m + 1).

    A factor is an F with F' F = [Theta y]' W [Theta y]. W is the weight of each row times its count in the resample (or
    in all rows except the fold), y the target (or that of the fold).
    """

    factors: Array
    fold_factors: Array
    full_factor: Array


def factored(
    rows: TrainingRows, own_targets: Array, row_weights: Array, counts: CountArray, folds: Sequence[Span]
) -> Factors:
    """The factors of all resamples, folds and of all rows.

    own_targets : (n_folds, n) target of each fold, or (0, n) where all folds have the target of the rows.
    row_weights : (n,).  counts : (resamples, n) of each row.
    """
    m = len(rows.library)
    columns = _columns(rows, (rows.target, *own_targets))
    columns *= np.sqrt(row_weights)[:, None]
    q_rows, r = orthonormal(columns)
    weights = np.vstack([counts, leave_out_weights(folds, len(rows.target))])
    all_factors = triangular_factors(weighted_grams(q_rows, weights), r)
    return Factors(
        factors=all_factors[: len(counts), :, : m + 1],
        fold_factors=_of_own_target(all_factors[len(counts) :], m, len(own_targets)),
        full_factor=r[:, : m + 1],
    )


def _columns(rows: TrainingRows, targets: Sequence[Array]) -> Array:
    """(n, m + n_targets), stored by columns: the terms along the training rows, then the targets."""
    m = len(rows.library)
    columns = np.empty((rows.products.shape[1], m + len(targets)), order="F")
    for j, (product, q) in enumerate(zip(rows.product_of_term, rows.library.feedbacks, strict=True)):
        columns[:, j] = rows.products[product] * rows.error_functions[q]
    for j, target in enumerate(targets, start=m):
        columns[:, j] = target
    return columns


def _of_own_target(factors: Array, m: int, targets: int) -> Array:
    """(n_folds, any, m + 1) factors of the m terms and each fold's own target.

    factors : (n_folds, any, m + 1 + targets), the common target before those of the folds, if any.
    """
    if not targets:
        return factors[:, :, : m + 1]
    return np.stack([factor[:, [*range(m), m + 1 + k]] for k, factor in enumerate(factors)])
