"""SINDy with control, tuned by evolution, no ensemble: the paper's baseline, solved by PySINDy's own STLSQ.

The rows are handed to PySINDy as a triangular factor R with R' R = [Theta y]' [Theta y]. That poses STLSQ the
identical problem, |R_y - R_Theta xi|**2 = |y - Theta xi|**2 + const., in as many rows as there are terms.

Tuning: the genome, its ranges, starts, operators, losses, weights and constraint of the AESI search, with generations of 20 of
which the better half are parents. Without resamples the loss on left-out pieces stands in for out-of-bag.

da Silva et al., arXiv:2411.12935.
"""

from __future__ import annotations

import warnings
from functools import partial

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import Failed
from aesi.sparse.baselines.single import Single, evaluate_single
from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import FitnessWeights
from aesi.sparse.search.evolution import fittest
from aesi.sparse.search.genome import Genome
from aesi.sparse.search.genome_space import GenomeSpace
from aesi.sparse.search.problem import Problem

NAME = "SINDy-C"


def tuned_sindy_c(
    problem: Problem,
    seed: int = 0,
    candidates: int = 200,
    population: int = 20,
    space: GenomeSpace | None = None,
    weights: FitnessWeights | None = None,
    least_pearson: float = -1.0,
) -> SparseModel:
    """The fittest of `candidates` models; weights and the constraint on the correlation are those of the search.

    Raises FitError where none survives.
    """
    space = space or GenomeSpace.of(problem.library)
    rng = np.random.default_rng([seed, 1])
    judge = partial(evaluate_sindy_c, problem, weights=weights, least_pearson=least_pearson)
    return fittest(space, judge, candidates, population, rng).model


def evaluate_sindy_c(
    problem: Problem,
    genome: Genome,
    weights: FitnessWeights | None = None,
    least_pearson: float = -1.0,
) -> Single | Failed:
    """One candidate of the baseline."""
    solve = partial(_stlsq, genome.lambda1, genome.lambda2)
    single = evaluate_single(problem, genome, solve, NAME, weights)
    if isinstance(single, Single) and single.valid.pearson < least_pearson:
        return Failed("a correlation below its constraint")
    return single


def _stlsq(lambda1: float, lambda2: float, factor: Array) -> Array:
    from pysindy import STLSQ

    solver = STLSQ(threshold=lambda2, alpha=lambda1, unbias=False)
    with warnings.catch_warnings():
        # STLSQ warns of empty models and of ill-conditioned solves; the verdict on the model says as much.
        warnings.simplefilter("ignore")
        solver.fit(factor[:, :-1], factor[:, -1:])
    return np.asarray(solver.coef_[0], dtype=float)
