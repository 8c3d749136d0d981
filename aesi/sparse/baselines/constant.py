"""The mean error of the training rows, whatever the input: the least that a correction has to beat.

    e[k + 1] = c

A voltage sensor's offset, or a slow overpotential that the physics lacks, is mostly a constant: a correction that
takes off no more than this has learnt nothing of the physics.
"""

from __future__ import annotations

import numpy as np

from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import sparse_model
from aesi.sparse.search.problem import Problem
from aesi.sparse.stridge import STRidge
from aesi.sparse.terms.library import Term

NAME = "constant"


def constant(problem: Problem) -> SparseModel:
    """The constant of least squares over all training rows, each counting what it counts in every fit."""
    place = np.array([problem.library.terms.index(Term())])
    value = STRidge(0.0, 0.0).fit_factor(problem.full_factor[:, np.append(place, len(problem.library))])
    return sparse_model(problem, place, value, 0.0, NAME)
