"""PySINDy's own ensemble: STLSQ on rows drawn one by one with replacement, and the median of its coefficients.

The library, the scaling and the rows are those of the search; the ridge and the extent of the library come from a
small grid, judged like candidates of the search, by single fits. Rows are thinned to `MOST_ROWS`: neighbouring rows
have nearly the same information.
Fasel et al., Proc. R. Soc. A 478 (2022) 20210904, doi:10.1098/rspa.2021.0904.
"""

from __future__ import annotations

import warnings
from itertools import product

import numpy as np

from aesi.errors import FitError
from aesi.sparse.baselines.single import Judge, Single, evaluate_single
from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import sparse_model
from aesi.sparse.search.genome import Genome
from aesi.sparse.search.problem import Problem
from aesi.sparse.stridge import STRidge

NAME = "PySINDy ensemble"
MEMBERS = 20
"""Models of the ensemble: the default of PySINDy."""
MOST_ROWS = 20_000
"""Rows that the ensemble is fitted to, at most."""
THRESHOLD = 1e-3
"""Coefficients below are dropped."""
_RIDGES = (1.0, 10.0, 100.0, 1000.0)
"""Weights of PySINDy's ridge that are tried."""


def pysindy_ensemble(problem: Problem, seed: int, judge: Judge | None = None) -> SparseModel:
    """The median of the ensemble. Raises FitError where no setting of the grid runs freely."""
    best = _best_single(problem, judge or Judge())
    active = np.flatnonzero(best.genome.active(problem.library))
    thinning = -(-len(problem.target) // MOST_ROWS)
    root_weights = np.sqrt(problem.row_weights[::thinning])[:, None]
    theta = problem.theta(active).T[::thinning] * root_weights
    coefficients = _median_coefficients(
        theta, problem.target[::thinning, None] * root_weights, best.genome.lambda1 / thinning, seed
    )
    if not coefficients.any():
        raise FitError(f"{NAME}: every coefficient is below the threshold of {THRESHOLD:g}.")
    return sparse_model(problem, active, coefficients, best.model.memory, NAME)


def _median_coefficients(theta: np.ndarray, target: np.ndarray, ridge: float, seed: int) -> np.ndarray:
    """(m,) median over the members.  theta : (n, m).  target : (n, 1)."""
    import pysindy

    ensemble = pysindy.EnsembleOptimizer(
        pysindy.STLSQ(threshold=THRESHOLD, alpha=ridge, unbias=False), bagging=True, n_models=MEMBERS
    )
    others = np.random.get_state()  # noqa: NPY002
    np.random.seed(seed)  # PySINDy draws its rows by the global generator  # noqa: NPY002
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            ensemble.fit(theta, target)
    finally:
        np.random.set_state(others)  # noqa: NPY002
    return np.asarray(np.median([member[0] for member in ensemble.coef_list], axis=0), dtype=float)


def _best_single(problem: Problem, judge: Judge) -> Single:
    """The best setting of the grid, by its single fit.  Raises FitError where none runs freely."""
    singles = []
    top = int(problem.library.degrees.max())
    for d, ridge in product(range(1, min(2, top) + 1), _RIDGES):
        genome = Genome.whole(problem.library, ridge, THRESHOLD, d=d, feedback=False)
        fit = STRidge(ridge, THRESHOLD).fit_factor
        single = evaluate_single(problem, genome, fit, NAME, judge.weights)
        if isinstance(single, Single):
            singles.append(single)
    if not singles:
        raise FitError(f"{NAME}: no setting of its grid runs freely without diverging.")
    return judge.best(singles)
