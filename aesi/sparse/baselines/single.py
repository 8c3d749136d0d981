"""One model instead of an ensemble, judged as candidates of the search are: by its weights and its constraints."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import Failed
from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import FitnessWeights, faded, fitness, sparse_model
from aesi.sparse.search.evolution import HasFitness, ranked
from aesi.sparse.search.genome import Genome
from aesi.sparse.search.judge import Fit, Judged, fold_runs, judged_on_validation
from aesi.sparse.search.problem import Problem

FactorFit = Callable[[Array], Array]
"""Coefficients (m,) from a factor (any, m + 1) of the problem, see `STRidge.fit_factor`."""


class Tried(HasFitness, Protocol):
    """A tried setting of a baseline: its fitness, and the values that constraints apply to."""

    @property
    def pearson_train(self) -> float:
        """Correlation of error and prediction in free run, on left-out pieces."""
        ...

    @property
    def valid(self) -> Judged:
        """Its scores on the validation records."""
        ...


T = TypeVar("T", bound=Tried)


@dataclass(frozen=True)
class Judge:
    """Weights of the fitness and least correlations in free run, those of the search it is compared with."""

    weights: FitnessWeights = field(default_factory=FitnessWeights)
    pearson_train: float = 0.5
    pearson_valid: float = 0.5

    def admits(self, tried: Tried) -> bool:
        """Whether a candidate meets the constraints."""
        return tried.pearson_train >= self.pearson_train and tried.valid.pearson >= self.pearson_valid

    def best(self, tried: Iterable[T]) -> T:
        """The fittest of those that meet the constraints, or of all where none does; of equal ones the first."""
        return ranked(tried, self.admits)[0]


@dataclass(frozen=True, eq=False)
class Single:
    """A single fit, judged.

    losses : on left-out pieces, on validation, and the number of terms.  valid : scores on validation.
    pearson_train : correlation of error and prediction in free run, on left-out pieces.
    """

    genome: Genome
    fitness: float
    model: SparseModel
    valid: Judged
    losses: tuple[float, float, int]
    pearson_train: float


def evaluate_single(
    problem: Problem, genome: Genome, fit: FactorFit, name: str, weights: FitnessWeights
) -> Single | Failed:
    """One candidate fitted to all training rows at once, and judged.

    Without resamples there are no out-of-bag rows; the loss on pieces left out of the fit replaces their loss.
    """
    active = np.flatnonzero(genome.active(problem.library))
    columns = np.append(active, len(problem.library))
    coefficients = fit(problem.full_factor[:, columns]) if len(active) else np.zeros(0)
    if not coefficients.any():
        return Failed("no term is left")
    fits = np.stack([fit(factor[:, columns]) for factor in problem.fold_factors])
    runs = fold_runs(problem, active, fits, fits, [coefficients] * 2)
    fitted = sparse_model(problem, active, coefficients, runs.memories[0], name)
    model = faded(fitted, problem, runs.amplitudes[0])
    folds, (valid,) = runs.judge(problem, Fit.FOLD), judged_on_validation(problem, runs, (model,))
    if not np.isfinite(folds.loss + valid.loss):
        return Failed("the model diverges in free run")
    losses = (folds.loss, valid.loss, int(np.count_nonzero(coefficients)))
    score = fitness(losses, len(problem.library), weights)
    return Single(genome, score, model, valid, losses, folds.pearson)
