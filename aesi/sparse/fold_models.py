"""The models behind honest residuals: each fitted on all training rows but one piece, and that piece."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import ErrorSeries
from aesi.sparse.evaluate import Candidate
from aesi.sparse.model import SparseModel
from aesi.sparse.problem import Problem
from aesi.sparse.stridge import STRidge


def fold_models(problem: Problem, candidate: Candidate) -> Iterator[tuple[SparseModel, ErrorSeries]]:
    """A model with the candidate's genome that has not seen the piece beside it, for every training piece.

    A piece starts at the sample whose error is given. Folds in which no term survives are left out.
    """
    genome = candidate.genome
    active = np.flatnonzero(genome.active(problem.library))
    columns = np.append(active, len(problem.library))
    solver = STRidge(genome.lambda1, genome.lambda2)
    for (a, b), factor in zip(problem.folds, problem.fold_factors, strict=True):
        coefficients = solver.fit_factor(factor[:, columns])
        if coefficients.any():
            yield _model(problem, active[coefficients != 0], coefficients, candidate), _piece(problem, a, b)


def _model(problem: Problem, kept: Array, coefficients: Array, candidate: Candidate) -> SparseModel:
    return SparseModel(
        "left-out piece",
        problem.library.take(kept),
        coefficients[coefficients != 0],
        problem.scaling,
        problem.dt_s,
        candidate.bagging.memory,
    )


def _piece(problem: Problem, a: int, b: int) -> ErrorSeries:
    """Samples a to b of the record that training rows a to b - 1 come from; row k predicts sample k + 1."""
    for record, (first, last) in zip(problem.split.train, problem.spans, strict=True):
        if first <= a < last:
            return record.take(slice(a - first, b - first + 1))
    raise IndexError(f"row {a} belongs to no training record")
