"""Gradient-boosted trees (scikit-learn) on the scaled inputs, with a memory of the measured error.

    e[k + 1] = g(U[k]) + memory (e[k] - g(U[k - 1]))

The trees see the inputs alone: a tree that sees e[k] learns persistence, which is worth nothing in free run. Depth
and learning rate come from a small grid, judged on the left-out pieces.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import ErrorSeries, FreeRun
from aesi.sparse import free_run
from aesi.sparse.search.judge import memory_of
from aesi.sparse.search.problem import Problem
from aesi.sparse.terms.inputs import with_inputs
from aesi.sparse.terms.scaling import Scaling

_ITERATIONS = 200
"""Boosting rounds at most; early stopping ends them before."""


@dataclass(frozen=True, eq=False)
class BoostedErrorModel:
    """A fitted regressor of the scaled next error on the scaled inputs."""

    regressor: Any
    scaling: Scaling
    input_names: tuple[str, ...]
    memory: float
    name: str = "gradient boosting"

    def one_step(self, series: ErrorSeries) -> Array:
        """(n,) V: the prediction of error_v[k] given error_v[k - 1]; the first is error_v[0]."""
        return self.k_step(series, 1)

    def free_run(self, series: ErrorSeries, error0_v: float | None = None) -> FreeRun:
        """Prediction from `error0_v` (default: the measured error_v[0])."""
        start = float(series.error_v[0]) if error0_v is None else error0_v
        variables = self._variables(series)
        scaled0 = float(self.scaling.error_to_scaled(np.array(start)))
        scaled = free_run.remember(self._given(variables), self.memory, scaled0)
        error_v = np.append(start, self.scaling.error_to_volts(scaled))
        variables[:, 0] = error_v
        return FreeRun(error_v, None, self.scaling.is_outside(variables))

    def k_step(self, series: ErrorSeries, steps: int) -> Array:
        """(n,) V: the prediction of error_v[k] given error_v[k - steps]; the first ones from error_v[0]."""
        measured = self.scaling.error_to_scaled(series.error_v)
        given = self._given(self._variables(series))
        scaled = free_run.remember_ahead(given, self.memory, measured, steps)
        return np.append(series.error_v[:1], self.scaling.error_to_volts(scaled))

    def _variables(self, series: ErrorSeries) -> Array:
        return np.column_stack([series.error_v, with_inputs(series, self.input_names).inputs])

    def _given(self, variables: Array) -> Array:
        return np.asarray(self.regressor.predict(self.scaling.apply(variables)[:-1, 1:]), dtype=float)


def gradient_boosting(problem: Problem, seed: int = 0) -> BoostedErrorModel:
    """The best of the grid on the left-out pieces, fitted on all training rows."""
    rows = np.vstack(
        [
            problem.scaling.apply(np.column_stack([record.error_v, record.inputs])[:-1])[:, 1:]
            for record in problem.split.train
        ]
    )
    trials = []
    for leaves, rate in product((4, 15), (0.03, 0.1)):
        given = [_left_out(problem, rows, (a, b), leaves, rate, seed) for a, b in problem.folds]
        left = problem.target - np.concatenate(given)
        trials.append((float(np.mean(left**2)), leaves, rate, memory_of(problem, given)))
    _, leaves, rate, memory = min(trials)
    regressor = _regressor(leaves, rate, seed).fit(rows, problem.target)
    return BoostedErrorModel(regressor, problem.scaling, problem.library.variables[1:], memory)


def _left_out(
    problem: Problem, rows: Array, piece: tuple[int, int], leaves: int, rate: float, seed: int
) -> Array:
    a, b = piece
    others = np.r_[0:a, b : len(rows)]
    return np.asarray(
        _regressor(leaves, rate, seed).fit(rows[others], problem.target[others]).predict(rows[a:b])
    )


def _regressor(leaves: int, rate: float, seed: int) -> Any:
    from sklearn.ensemble import HistGradientBoostingRegressor

    return HistGradientBoostingRegressor(
        max_iter=_ITERATIONS,
        max_leaf_nodes=leaves,
        learning_rate=rate,
        l2_regularization=1.0,
        random_state=seed,
    )
