"""The mean error of the training rows, for any input: the baseline that every correction has to beat.

    e[k + 1] = c

The offset of a voltage sensor, or a slow overpotential that the physics lacks, is mostly constant. A correction that
removes no more than the constant has learnt nothing about the physics.
"""

from __future__ import annotations

import numpy as np

from aesi.errors import FitError
from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import sparse_model
from aesi.sparse.search.problem import Problem
from aesi.sparse.stridge import STRidge
from aesi.sparse.terms.library import Term

NAME = "constant"


def constant(problem: Problem) -> SparseModel:
    """The least-squares constant over all training rows, with the weights that rows have in every fit.  Raises FitError
    for a library without the constant term."""
    place = np.flatnonzero([term == Term() for term in problem.library.terms])
    if not len(place):
        raise FitError(
            f"{NAME} needs the constant term of the library, Term(); give a library that holds it."
        )
    value = STRidge(0.0, 0.0).fit_factor(problem.full_factor[:, np.append(place, len(problem.library))])
    return sparse_model(problem, place, value, 0.0, NAME)
