"""The models behind free-run residuals: each fitted on all training rows but one long piece, and that piece.

The search may judge candidates on shorter pieces (`Options.fold`); a free run shows what it drifts by only over
a long one.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aesi.numerics.blocks import Span, pieces
from aesi.numerics.typing import Array, IntArray
from aesi.records import ErrorSeries
from aesi.sparse.evaluate import Candidate, sparse_model
from aesi.sparse.model import SparseModel
from aesi.sparse.problem import Problem, default_fold
from aesi.sparse.stridge import STRidge


def fold_models(problem: Problem, candidate: Candidate) -> Iterator[tuple[SparseModel, ErrorSeries]]:
    """A model with the candidate's genome that has not seen the piece beside it, for every training piece.

    A piece starts at the sample whose error is given. Folds in which no term survives are left out.
    """
    genome = candidate.genome
    active = np.flatnonzero(genome.active(problem.library))
    cut = tuple(pieces(problem.spans, default_fold(len(problem.target))))
    fits = _fits(problem, active, cut, STRidge(genome.lambda1, genome.lambda2))
    for (a, b), coefficients in zip(cut, fits, strict=True):
        if coefficients.any():
            model = sparse_model(problem, active, coefficients, candidate.bagging.memory, "left-out piece")
            yield model, _piece(problem, a, b)


def _fits(problem: Problem, active: IntArray, cut: tuple[Span, ...], solver: STRidge) -> Iterator[Array]:
    """(m,) the fit without each of the pieces."""
    if cut == problem.folds:
        columns = np.append(active, len(problem.library))
        yield from (solver.fit_factor(factor[:, columns]) for factor in problem.fold_factors)
        return
    theta = problem.theta(active).T
    for a, b in cut:
        weights = problem.row_weights.copy()
        weights[a:b] = 0.0
        yield solver.fit(theta, problem.target, weights)


def _piece(problem: Problem, a: int, b: int) -> ErrorSeries:
    """Samples a to b of the record that training rows a to b - 1 come from; row k predicts sample k + 1."""
    for record, (first, last) in zip(problem.split.train, problem.spans, strict=True):
        if first <= a < last:
            return record.take(slice(a - first, b - first + 1))
    raise IndexError(f"row {a} belongs to no training record")
