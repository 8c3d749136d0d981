"""Gradient-boosted trees (scikit-learn) on the scaled inputs, with a memory of the measured error.

    e[k + 1] = g(U[k]) + memory (e[k] - g(U[k - 1]))

The trees have the inputs alone: a tree with e[k] learns persistence, which is useless in free run. Rows have the same
weights as in every fit of the search. The numbers of leaves and trees come from a small grid, judged like candidates of
the search: on left-out pieces, with the errors of physics that was fitted without these, and on validation records.
Where sparse corrections fade to the physics, so do the trees, without the leverage, which only a regression has. They
have no terms, so that their sparsity counts as 0 in the fitness.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import ErrorSeries, FreeRun
from aesi.sparse import free_run
from aesi.sparse.baselines.single import Judge
from aesi.sparse.fade import Fade
from aesi.sparse.search.evaluate import fitness
from aesi.sparse.search.judge import Fit, Judged, judged_on_validation, runs_without_feedback
from aesi.sparse.search.problem import Problem
from aesi.sparse.terms.inputs import model_variables
from aesi.sparse.terms.scaling import Scaling

LEAVES = (4, 15)
TREES = (25, 50, 100, 200)
"""Grid of leaves and trees, at the default learning rate. Conventions."""


@dataclass(frozen=True, eq=False)
class BoostedErrorModel:
    """A fitted regressor of the scaled next error on the scaled inputs; `fade` as in a sparse model."""

    regressor: Any
    scaling: Scaling
    input_names: tuple[str, ...]
    dt_s: float
    memory: float
    fade: Fade | None = None
    name: str = "gradient boosting"

    def one_step(self, series: ErrorSeries) -> Array:
        """(n,) V: the prediction of error_v[k] given error_v[k - 1]; the first is error_v[0]."""
        return self.k_step(series, 1)

    def free_run(self, series: ErrorSeries, error0_v: float | None = None) -> FreeRun:
        """Prediction from `error0_v` (V); None takes the measured error_v[0], or the value by the inputs where that is
        NaN."""
        start = float(series.error_v[0]) if error0_v is None else error0_v
        variables = self._variables(series)
        by_inputs = self._by_inputs(variables, series)
        if np.isnan(start):
            start = float(self.scaling.error_to_volts(by_inputs[:1])[0])
        scaled0 = float(self.scaling.error_to_scaled(np.array(start)))
        scaled = free_run.autoregressive_run(by_inputs, self.memory, scaled0)
        error_v = np.append(start, self.scaling.error_to_volts(scaled))
        variables[:, 0] = error_v
        return FreeRun(error_v, None, self.scaling.is_outside(variables))

    def k_step(self, series: ErrorSeries, steps: int) -> Array:
        """(n,) V: the prediction of error_v[k] given error_v[k - steps]; the first ones from error_v[0].

        steps : whole number, at least 1.  Raises DataError for any other.
        """
        free_run.check_steps(self.name, steps)
        measured = self.scaling.error_to_scaled(series.error_v)
        by_inputs = self._by_inputs(self._variables(series), series)
        scaled = free_run.autoregressive_ahead(by_inputs, self.memory, measured, steps)
        return np.append(series.error_v[:1], self.scaling.error_to_volts(scaled))

    def _variables(self, series: ErrorSeries) -> Array:
        return model_variables(series, self.input_names, self.dt_s)

    def _by_inputs(self, variables: Array, series: ErrorSeries) -> Array:
        scaled = self.scaling.apply(variables)[:, 1:]
        by_inputs = np.asarray(self.regressor.predict(scaled), dtype=float)
        if self.fade is not None:
            not_clipped = scaled + self.scaling.cut_off(variables)[:, 1:]
            by_inputs = by_inputs * self.fade.weight(not_clipped, series.soc, series.temperature_degc, None)
        return by_inputs[:-1]


@dataclass(frozen=True, eq=False)
class _Boosted:
    fitness: float
    model: BoostedErrorModel
    valid: Judged
    pearson_train: float


def gradient_boosting(problem: Problem, seed: int = 0, judge: Judge | None = None) -> BoostedErrorModel:
    """The best of the grid, fitted to all training rows."""
    judge = judge or Judge()
    return judge.best(one for leaves in LEAVES for one in _judged_models(problem, leaves, seed, judge)).model


def _judged_models(problem: Problem, leaves: int, seed: int, judge: Judge) -> Iterator[_Boosted]:
    """The models with these leaves, judged, one for each number of trees."""
    left_out = [_left_out_predictions(problem, fold, leaves, seed) for fold in range(len(problem.folds))]
    for place, trees in enumerate(TREES):
        predictions = np.concatenate([by_trees[place] for by_trees in left_out])
        runs = runs_without_feedback(problem, predictions[:, None])
        regressor = _regressor(leaves, trees, seed)
        model = BoostedErrorModel(
            regressor.fit(problem.inputs, problem.target, problem.row_weights),
            problem.scaling,
            problem.library.variables[1:],
            problem.dt_s,
            runs.memories[0],
            Fade(runs.amplitudes[0], problem.region) if problem.options.fade else None,
        )
        (valid,) = judged_on_validation(problem, runs, (model,))
        folds = runs.judge(problem, Fit.FOLD)
        losses = folds.loss, valid.loss, 0.0
        yield _Boosted(fitness(losses, len(problem.library), judge.weights), model, valid, folds.pearson)


def _left_out_predictions(problem: Problem, fold: int, leaves: int, seed: int) -> list[Array]:
    """Predictions of a left-out piece by a fit to the rest, for each number of trees."""
    a, b = problem.folds[fold]
    others = np.r_[0:a, b : len(problem.target)]
    regressor = _regressor(leaves, max(TREES), seed).fit(
        problem.inputs[others], problem.fold_targets[fold, others], problem.row_weights[others]
    )
    stages = enumerate(regressor.staged_predict(problem.inputs[a:b]), start=1)
    return [np.asarray(predictions, dtype=float) for trees, predictions in stages if trees in TREES]


def _regressor(leaves: int, trees: int, seed: int) -> Any:
    from sklearn.ensemble import HistGradientBoostingRegressor

    return HistGradientBoostingRegressor(
        max_iter=trees,
        max_leaf_nodes=leaves,
        l2_regularization=1.0,
        early_stopping=False,  # it judges by single rows, whose neighbours were fitted
        random_state=seed,
    )
