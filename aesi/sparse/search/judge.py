"""How a fit is judged: predictions along the training rows, along the left-out pieces, and on records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.metrics import mse, mser, pearson
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records import ErrorSeries
from aesi.sparse import free_run
from aesi.sparse.model import SparseModel
from aesi.sparse.search.problem import Problem, balanced_weights, spans_of

_MOST_MEMORY = 0.9999


@dataclass(frozen=True)
class Judged:
    """loss : mean squared error over that of the bare model, in the problem's regime; infinite if it diverges.

    pearson, mser_pct : in free run.  one_step_rmse_v : V.
    """

    loss: float
    pearson: float
    mser_pct: float
    one_step_rmse_v: float


def drive_of(problem: Problem, active: IntArray, fits: Array, rows: slice) -> tuple[Array, IntArray]:
    """(n_functions, rows, models) sums of the input parts of the terms of each function of e; these functions."""
    feedbacks = problem.library.feedbacks[active]
    products = problem.which[active]
    functions = np.unique(feedbacks)
    drive = np.empty((len(functions), rows.stop - rows.start, len(fits)))
    for part, q in zip(drive, functions, strict=True):
        mine = feedbacks == q
        np.matmul(problem.products[products[mine], rows].T, fits[:, mine].T, out=part)
    return drive, functions


def free_predictions(
    problem: Problem, drive: Array, functions: IntArray, rows: slice, restart: BoolArray, state: Array
) -> Array:
    """(rows, models) scaled predictions in free run; `state` carries them from one slice to the next."""
    if not functions.any():
        return np.asarray(drive[0])
    clip = problem.options.outside == "clip"
    return np.asarray(free_run.run_many(drive, functions, problem.error[rows], restart, state, clip))


def one_step_predictions(problem: Problem, drive: Array, functions: IntArray, rows: slice) -> Array:
    """(rows, models) scaled predictions from the measured errors."""
    return np.einsum("qkj,qk->kj", drive, problem.error_functions[functions, rows])


@dataclass(frozen=True, eq=False)
class FoldRuns:
    """(n, 3) scaled predictions, by regime: of the fold's fit, its refit of the stable terms, and AESI I."""

    one_step: Array
    free_run: Array

    def judge(self, problem: Problem, column: int) -> Judged:
        """How one of the three did over all pieces."""
        run = self.free_run if problem.options.regime == "free_run" else self.one_step
        bare = problem.target - problem.zero
        with np.errstate(invalid="ignore"):
            left = problem.target - run[:, column]
            loss = float((problem.row_weights @ left**2) / (problem.row_weights @ bare**2))
            loss_free = mse(problem.target, self.free_run[:, column]) / float(np.mean(bare**2))
            loss_step = mse(problem.target, self.one_step[:, column])
        return Judged(
            loss,
            pearson(problem.target, self.free_run[:, column]),
            100.0 * (1.0 - loss_free),
            problem.scaling.error_volts_per_unit * float(np.sqrt(loss_step)),
        )


def fold_runs(
    problem: Problem, active: IntArray, fits: Array, refits: Array, bagging: Array
) -> tuple[FoldRuns, float]:
    """Runs over each piece by models fitted on the others; the memory of the residual where none has feedback."""
    drives = [
        drive_of(problem, active, np.stack([fit, refit, bagging]), slice(a, b))
        for (a, b), fit, refit in zip(problem.folds, fits, refits, strict=True)
    ]
    remembers = not any(functions.any() for _, functions in drives)
    memory = memory_of(problem, [drive[0][:, 0] for drive, _ in drives]) if remembers else 0.0
    parts = []
    for (a, b), (drive, functions) in zip(problem.folds, drives, strict=True):
        rows = slice(a, b)
        if remembers:
            columns = drive[0].T
            one = np.column_stack(
                [free_run.remember_ahead(given, memory, problem.error[rows], 1) for given in columns]
            )
            free = np.column_stack([free_run.remember(given, memory, problem.error[a]) for given in columns])
        else:
            one = one_step_predictions(problem, drive, functions, rows)
            restart = np.zeros(b - a, dtype=bool)
            restart[0] = True
            free = free_predictions(problem, drive, functions, rows, restart, np.zeros(3))
        parts.append((one, free))
    return FoldRuns(np.vstack([one for one, _ in parts]), np.vstack([free for _, free in parts])), memory


def memory_of(problem: Problem, given: Sequence[Array]) -> float:
    """The share of an honest residual that is left one step later: its lag-one regression, within [0, 1)."""
    product, square = 0.0, 0.0
    for (a, b), prediction in zip(problem.folds, given, strict=True):
        left = problem.target[a:b] - prediction
        product += float(left[1:] @ left[:-1])
        square += float(left[:-1] @ left[:-1])
    return float(np.clip(product / square, 0.0, _MOST_MEMORY)) if square > 0 else 0.0


def on_records(model: SparseModel, records: Sequence[ErrorSeries], problem: Problem) -> Judged:
    """How a model does on whole records, each started from its first measured error."""
    truth = [record.error_v[1:] for record in records]
    one_step = [model.one_step(record)[1:] for record in records]
    runs = [model.free_run(record) for record in records]
    free = [run.error_v[1:] for run in runs]
    chosen = free if problem.options.regime == "free_run" else one_step
    diverged = problem.options.regime == "free_run" and any(run.diverged_at is not None for run in runs)
    joined, joined_free = np.concatenate(truth), np.concatenate(free)
    return Judged(
        np.inf if diverged else _relative_loss(truth, chosen, problem.options.balance),
        pearson(joined, joined_free),
        mser(joined, joined_free),
        float(np.sqrt(mse(joined, np.concatenate(one_step)))),
    )


def _relative_loss(truth: Sequence[Array], predictions: Sequence[Array], balance: bool) -> float:
    """Squared error over that of the bare model; balanced, every record counts alike."""
    spans = spans_of([len(record) for record in truth])
    joined = np.concatenate(truth)
    weights = balanced_weights(spans, joined) if balance else np.ones(len(joined))
    left = joined - np.concatenate(predictions)
    return float((weights @ left**2) / (weights @ joined**2))


def on_validation(problem: Problem, runs: FoldRuns, models: Sequence[SparseModel]) -> Judged:
    """The first model's verdict, with the mean loss of the given ones: on validation records, or the pieces.

    models : AESI I and II, or a single one; on pieces the fold's fit and its refit stand for them.
    """
    if problem.split.valid:
        verdicts = [on_records(model, problem.split.valid, problem) for model in models]
    else:
        verdicts = [runs.judge(problem, column) for column in range(len(models))]
    return replace(verdicts[0], loss=float(np.mean([verdict.loss for verdict in verdicts])))
