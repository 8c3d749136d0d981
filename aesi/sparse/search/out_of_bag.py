"""Out-of-bag errors of the members of an ensemble, made comparable.

Every resample leaves out different rows, so that a member whose rows happen to be easy would win. The rows are cut into
pieces of a block; s[p, b] is the squared error of member b on the u[p, b] rows of piece p that it did not draw, with
the weights of the fits. A member's error is divided by the typical error of all members on the same pieces:

    L_b = [ sum_p s[p, b] / sum_p m_p u[p, b] ] [ sum_p m_p n_p / sum_p n_p ] / bare
    m_p = median over b of s[p, b] / u[p, b]                                                            (1)

n_p is the number of rows of the piece and `bare` the mean squared error of the physics model. (1) estimates the
member's error relative to the physics on all rows, as if it had drawn none of them.
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.sparse.search.judge import drive_of, free_predictions, one_step_predictions
from aesi.sparse.search.problem import Problem

_ROWS_AT_ONCE = 1024
"""Rows that are worked on at once; it bounds the memory, and no result depends on it."""


def out_of_bag(problem: Problem, active: IntArray, fits: Array, resamples: IntArray) -> Array:
    """(models,) equation (1) of the fits (models, m) of these resamples; infinite where one diverges."""
    out_of_bag_counts = problem.out_of_bag_counts[:, resamples]
    squares = _squares(problem, active, fits, resamples)
    bare = float(problem.row_weights @ problem.target**2) / len(problem.target)
    return comparable_losses(squares, out_of_bag_counts, problem.piece_sizes) / bare


def comparable_losses(squares: Array, rows: Array, sizes: Array) -> Array:
    """(models,) mean squared error of each model on all rows, as estimated from those it was judged on.

    squares : (pieces, models) summed over the `rows` (pieces, models) on which a model is judged; `sizes`
    (pieces,) are all rows of a piece. Pieces on which no model with finite errors is judged are left out.
    """
    judged = (rows > 0) & np.isfinite(squares)
    piece_means = np.full(squares.shape, np.nan)
    np.divide(squares, rows, out=piece_means, where=judged)
    judged_pieces = judged.any(axis=1)
    if not judged_pieces.any():
        return np.full(squares.shape[1], np.inf)
    typical = np.nanmedian(piece_means[judged_pieces], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = squares[judged_pieces].sum(axis=0) / (typical @ rows[judged_pieces])
    losses = ratio * float(typical @ sizes[judged_pieces]) / float(sizes[judged_pieces].sum())
    return np.where(np.isfinite(squares).all(axis=0) & np.isfinite(losses), losses, np.inf)


def _squares(problem: Problem, active: IntArray, fits: Array, resamples: IntArray) -> Array:
    """(pieces, models) squared error on the rows that each model has not seen, weighted as in the fits."""
    squares = np.zeros((len(problem.piece_sizes), len(fits)))
    state = np.zeros(len(fits))
    all_resamples = len(resamples) == problem.out_of_bag_rows.shape[1]
    for a in range(0, len(problem.target), _ROWS_AT_ONCE):
        rows = slice(a, min(a + _ROWS_AT_ONCE, len(problem.target)))
        drive, functions = drive_of(problem, active, fits, rows)
        if problem.options.regime == "free_run":
            prediction = free_predictions(problem, drive, functions, rows, problem.restart[rows], state)
        else:
            prediction = one_step_predictions(problem, drive, functions, rows)
        out_of_bag_rows = (
            problem.out_of_bag_rows[rows] if all_resamples else problem.out_of_bag_rows[rows][:, resamples]
        )
        weights, pieces = problem.row_weights[rows], problem.piece_of_row[rows]
        _add_squares(problem.target[rows], prediction, weights, out_of_bag_rows, pieces, squares)
    return squares


@kept_njit()
def _add_squares(
    target: Array,
    prediction: Array,
    weights: Array,
    out_of_bag_rows: BoolArray,
    pieces: IntArray,
    squares: Array,
) -> None:
    """Add weights * (target - prediction)**2 of the out-of-bag rows to the pieces they belong to."""
    for k in range(len(target)):
        of_piece = squares[pieces[k]]
        for j in range(prediction.shape[1]):
            if out_of_bag_rows[k, j]:
                of_piece[j] += weights[k] * (target[k] - prediction[k, j]) ** 2
