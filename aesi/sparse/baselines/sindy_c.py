"""SINDy with control, tuned by evolution, no ensemble: the paper's baseline, solved by PySINDy's own STLSQ.

The rows are handed to PySINDy as a triangular factor R with R' R = [Theta y]' [Theta y]. That poses STLSQ the
identical problem, |R_y - R_Theta xi|**2 = |y - Theta xi|**2 + const., in as many rows as there are terms.

Tuning: the genome, its ranges, starts, operators, losses, fitness and constraints of the AESI search, with generations
of 20 of which the better half are parents. Without resamples the loss on left-out pieces stands in for out-of-bag.

da Silva et al., arXiv:2411.12935.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import Failed
from aesi.sparse.baselines.single import Judge, Single, evaluate_single
from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import FitnessWeights
from aesi.sparse.search.evolution import fittest
from aesi.sparse.search.genome import Genome
from aesi.sparse.search.genome_space import GenomeSpace
from aesi.sparse.search.problem import Problem

NAME = "SINDy-C"


def tuned_sindy_c(
    problem: Problem,
    seed: int,
    candidates: int,
    population: int,
    space: GenomeSpace | None = None,
    judge: Judge | None = None,
    on_candidate: Callable[[dict[str, Any]], None] | None = None,
) -> SparseModel:
    """The fittest of `candidates` models that keep to the constraints, or of all where none does.

    seed : of the search.  population : size of a generation.  space : ranges of the genes; None takes the widest.
    on_candidate : called with each candidate, a row of plain values.  Raises FitError where none survives.
    """
    space = space or GenomeSpace.of(problem.library, problem.options.feedback)
    judge = judge or Judge()
    rng = np.random.default_rng([seed, 1])

    def evaluate(genome: Genome) -> Single | Failed:
        outcome = evaluate_sindy_c(problem, genome, judge.weights)
        if on_candidate is not None:
            on_candidate(_row(genome, outcome, judge))
        return outcome

    return fittest(space, evaluate, candidates, population, rng, judge.admits).model


def evaluate_sindy_c(problem: Problem, genome: Genome, weights: FitnessWeights) -> Single | Failed:
    """One candidate of the baseline."""
    return evaluate_single(problem, genome, partial(_stlsq, genome.lambda1, genome.lambda2), NAME, weights)


def _row(genome: Genome, outcome: Single | Failed, judge: Judge) -> dict[str, Any]:
    genes = genome.to_dict()
    if isinstance(outcome, Failed):
        return {"genome": genes, "failed": outcome.reason}
    losses = dict(zip(("loss_left_out", "loss_valid", "terms"), outcome.losses, strict=True))
    return {
        "genome": genes,
        **losses,
        "fitness": outcome.fitness,
        "pearson_train": outcome.pearson_train,
        "pearson_valid": outcome.valid.pearson,
        "admitted": judge.admits(outcome),
    }


def _stlsq(lambda1: float, lambda2: float, factor: Array) -> Array:
    from pysindy import STLSQ

    solver = STLSQ(threshold=lambda2, alpha=lambda1, unbias=False)
    with warnings.catch_warnings():
        # STLSQ warns of empty models and of ill-conditioned solves; the verdict on the model says as much.
        warnings.simplefilter("ignore")
        solver.fit(factor[:, :-1], factor[:, -1:])
    return np.asarray(solver.coef_[0], dtype=float)
