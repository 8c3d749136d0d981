"""Dynamic mode decomposition with control: the best linear map of error and inputs, by least squares.

    e[k + 1] = a e[k] + b' U[k] + c

Proctor, Brunton & Kutz, SIAM J. Appl. Dyn. Syst. 15 (2016) 142, doi:10.1137/15M1013857. With one state there is nothing
to truncate. It is fitted one step ahead, as published, and judged in free run like all others.
"""

from __future__ import annotations

import numpy as np

from aesi.errors import FitError
from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import sparse_model
from aesi.sparse.search.problem import Problem
from aesi.sparse.stridge import STRidge

NAME = "DMD with control"


def dmd_with_control(problem: Problem) -> SparseModel:
    """The fit to all training rows. Raises FitError for a library without linear terms."""
    linear = np.flatnonzero(
        [
            len(term.factors) < 2 and term.degree <= 1 and term.order == term.degree
            for term in problem.library.terms
        ]
    )
    if len(linear) < 2:
        raise FitError(f"{NAME} needs the linear terms of the library; raise p_c and d to at least 1.")
    columns = np.append(linear, len(problem.library))
    coefficients = STRidge(0.0, 0.0).fit_factor(problem.full_factor[:, columns])
    return sparse_model(problem, linear, coefficients, 0.0, NAME)
