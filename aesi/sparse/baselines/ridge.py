"""Plain ridge regression on the whole library: no thresholding, no ensemble.

lambda1, p_c, d and, where the problem admits it, whether the error is fed back come from a grid, judged as candidates
of the search are.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aesi.errors import FitError
from aesi.sparse.baselines.single import Judge, Single, evaluate_single
from aesi.sparse.model import SparseModel
from aesi.sparse.search.genome import Genome
from aesi.sparse.search.problem import Problem
from aesi.sparse.stridge import STRidge


def plain_ridge(problem: Problem, judge: Judge | None = None) -> SparseModel:
    """The best of the grid; nothing is random. Raises FitError where all of them diverge."""
    judge = judge or Judge()
    outcomes = [
        evaluate_single(problem, genome, STRidge(genome.lambda1, 0.0).fit_factor, "ridge", judge.weights)
        for genome in _grid(problem)
    ]
    singles = [outcome for outcome in outcomes if isinstance(outcome, Single)]
    if not singles:
        raise FitError(f"none of {len(outcomes)} ridge models runs freely without diverging.")
    return judge.best(singles).model


def _grid(problem: Problem) -> Iterator[Genome]:
    top = int(problem.library.orders.max()), int(problem.library.degrees.max())
    for p_c, d in sorted({(min(1, top[0]), min(2, top[1])), (min(2, top[0]), min(3, top[1])), top}):
        for feedback in (False, True) if problem.options.feedback else (False,):
            for lambda1 in np.geomspace(1e-6, 1e3, 10):
                yield Genome.whole(problem.library, float(lambda1), 0.0, 0.5, p_c, d, feedback)
