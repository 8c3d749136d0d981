"""The judgement of a fit: predictions along the training rows, along left-out pieces, and on records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from aesi.numerics.metrics import mse, mser, pearson
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records import ErrorModel, ErrorSeries
from aesi.sparse import free_run
from aesi.sparse.fade import amplitude
from aesi.sparse.search.problem import Problem
from aesi.sparse.search.rows import balanced_weights, spans_of

_MAX_MEMORY = 0.9999
"""Largest share of an error that is left after a step; at 1 the first error would never be forgotten."""


@dataclass(frozen=True)
class Judged:
    """Scores of a fit.

    loss : weighted squared error over that of the bare model, in the problem's regime; not finite if it diverges. On
    left-out pieces in free run it is the mean of two runs: from the measured error, and without one.
    pearson, mser_pct : in free run from the measured error, all samples with the same weight.  one_step_rmse_v : V, one
    step ahead, the same.
    """

    loss: float
    pearson: float
    mser_pct: float
    one_step_rmse_v: float


def drive_of(problem: Problem, active: IntArray, fits: Array, rows: slice) -> tuple[Array, IntArray]:
    """(sums of the input parts of the terms by function of e (n_functions, rows, models), these functions)."""
    feedbacks = problem.library.feedbacks[active]
    products = problem.product_of_term[active]
    functions = np.unique(feedbacks)
    drive = np.empty((len(functions), rows.stop - rows.start, len(fits)))
    for part, q in zip(drive, functions, strict=True):
        of_function = feedbacks == q
        np.matmul(problem.products[products[of_function], rows].T, fits[:, of_function].T, out=part)
    return drive, functions


def free_predictions(
    problem: Problem, drive: Array, functions: IntArray, rows: slice, restart: BoolArray, state: Array
) -> Array:
    """(rows, models) scaled predictions in free run; `state` carries them from one slice to the next."""
    if not functions.any():
        return np.asarray(drive[0])
    return np.asarray(free_run.run_ensemble(drive, functions, problem.error[rows], restart, state))


def one_step_predictions(problem: Problem, drive: Array, functions: IntArray, rows: slice) -> Array:
    """(rows, models) scaled predictions from the measured errors."""
    return np.einsum("qkj,qk->kj", drive, problem.error_functions[functions, rows])


class Fit(IntEnum):
    """The fit of a column of `FoldRuns`.

    Both are fits without the fold: FOLD of all terms, STABLE of the stable ones. They represent AESI I and II.
    """

    FOLD = 0
    STABLE = 1


@dataclass(frozen=True, eq=False)
class FoldRuns:
    """Scaled predictions (n, 2) along the training rows in each regime, one column per `Fit`.

    from_unmeasured : free run without a measured error at its start; equal to `free_run` for models with feedback.
    Corrections fade in all of them by nearness and amplitude, not by leverage (fade.py).
    amplitudes : (2,) a of (2) there.  memories : (2,) memory of the residual, 0 for models with feedback.
    sums : (2, n_folds, 3) for each fit and fold the scaled sums of e**2, e p and p**2, with p the prediction
    `from_unmeasured` before the amplitude.
    """

    one_step: Array
    free_run: Array
    from_unmeasured: Array
    sums: Array
    amplitudes: tuple[float, ...] = (1.0, 1.0)
    memories: tuple[float, ...] = (0.0, 0.0)

    def judge(self, problem: Problem, column: Fit) -> Judged:
        """The scores of one of the fits over all pieces."""
        run = self.free_run if problem.options.regime == "free_run" else self.one_step
        truth = problem.unseen_target
        with np.errstate(invalid="ignore"):
            runs = (run, self.from_unmeasured) if problem.options.regime == "free_run" else (run,)
            squares = [problem.row_weights @ (truth - each[:, column]) ** 2 for each in runs]
            loss = float(np.mean(squares) / (problem.row_weights @ truth**2))
            loss_free = mse(truth, self.free_run[:, column]) / float(np.mean(truth**2))
            loss_step = mse(truth, self.one_step[:, column])
        return Judged(
            loss,
            pearson(truth, self.free_run[:, column]),
            100.0 * (1.0 - loss_free),
            problem.scaling.error_volts_per_unit * float(np.sqrt(loss_step)),
        )


def fold_runs(
    problem: Problem, active: IntArray, fits: Array, refits: Array, models: Sequence[Array]
) -> FoldRuns:
    """The runs over each piece by models fitted to the others.

    fits, refits : (n_folds, m) coefficients of the active terms by each `Fit`.  models : coefficients (m,) of the two
    models that these represent. They decide whether a fit feeds back: a genome may admit terms in the error of which
    thresholding leaves none.
    """
    feedbacks = problem.library.feedbacks[active]
    plain = [column for column in Fit if not feedbacks[models[column] != 0].any()]
    drives = [
        drive_of(problem, active, np.stack([fit, refit]), slice(a, b))
        for (a, b), fit, refit in zip(problem.folds, fits, refits, strict=True)
    ]
    if not plain:
        return _runs_with_feedback(problem, drives)
    without = runs_without_feedback(problem, np.vstack([drive[0][:, plain] for drive, _ in drives]))
    return (
        without
        if len(plain) == len(Fit)
        else _joined(_runs_with_feedback(problem, drives), without, plain[0])
    )


def _runs_with_feedback(problem: Problem, drives: Sequence[tuple[Array, IntArray]]) -> FoldRuns:
    """`fold_runs` of models with feedback.  drives : of each piece, from `drive_of`."""
    parts = []
    for (a, b), (drive, functions) in zip(problem.folds, drives, strict=True):
        rows = slice(a, b)
        one_step = one_step_predictions(problem, drive, functions, rows)
        restart = np.zeros(b - a, dtype=bool)
        restart[0] = True
        parts.append((one_step, free_predictions(problem, drive, functions, rows, restart, np.zeros(2))))
    one_step, free_runs = (np.vstack(part) for part in zip(*parts, strict=True))
    return FoldRuns(one_step, free_runs, free_runs, _fold_sums(problem, free_runs))


def _joined(feeding: FoldRuns, plain: FoldRuns, place: Fit) -> FoldRuns:
    """The runs of one fit with feedback and of one without, which has the column `place`.  plain : its one column."""

    def columns(name: str) -> Array:
        out = np.array(getattr(feeding, name))
        out[:, place] = getattr(plain, name)[:, 0]
        return out

    amplitudes, memories, sums = [1.0, 1.0], [0.0, 0.0], np.array(feeding.sums)
    amplitudes[place], memories[place], sums[place] = plain.amplitudes[0], plain.memories[0], plain.sums[0]
    return FoldRuns(
        columns("one_step"),
        columns("free_run"),
        columns("from_unmeasured"),
        sums,
        tuple(amplitudes),
        tuple(memories),
    )


def _fold_sums(problem: Problem, predictions: Array) -> Array:
    """`FoldRuns.sums` of scaled predictions (n, columns)."""
    error = problem.unseen_target[:, None]
    with np.errstate(invalid="ignore", over="ignore"):
        products = np.stack(
            [np.broadcast_to(error**2, predictions.shape), error * predictions, predictions**2], axis=-1
        )
        return np.stack([products[a:b].sum(axis=0) for a, b in problem.folds], axis=1)


def runs_without_feedback(problem: Problem, predictions: Array) -> FoldRuns:
    """`fold_runs` of models without feedback, which have the memory of the first.

    predictions : (n, columns) scaled predictions by the inputs alone, of rows that the models have not seen."""
    amplitudes = [1.0] * predictions.shape[1]
    if problem.options.fade:
        predictions = problem.nearness[:, None] * predictions
    sums = _fold_sums(problem, predictions)
    if problem.options.fade:
        amplitudes = [
            amplitude(problem.unseen_target, column, problem.folds, problem.fold_drives, problem.row_weights)
            for column in predictions.T
        ]
        predictions = predictions * amplitudes
    memory = memory_of(problem, [predictions[a:b, 0] for a, b in problem.folds])
    one_step, free_runs = np.empty_like(predictions), np.empty_like(predictions)
    for a, b in problem.folds:
        for j, column in enumerate(predictions[a:b].T):
            one_step[a:b, j] = free_run.autoregressive_ahead(column, memory, problem.unseen_error[a:b], 1)
            free_runs[a:b, j] = free_run.autoregressive_run(column, memory, problem.unseen_error[a])
    memories = (memory,) * len(amplitudes)
    return FoldRuns(one_step, free_runs, predictions, sums, tuple(amplitudes), memories)


def memory_of(problem: Problem, predictions: Sequence[Array]) -> float:
    """Lag-one autoregression coefficient of a residual on unseen rows, within [0, 1).

    predictions : one array per fold, scaled. The result is the median over the folds: a single fold in which the
    physics drifts away by volts would dominate a mean.
    """
    by_fold = []
    for (a, b), predicted in zip(problem.folds, predictions, strict=True):
        residual = problem.unseen_target[a:b] - predicted
        square = float(residual[:-1] @ residual[:-1])
        by_fold.append(float(residual[1:] @ residual[:-1]) / square if square > 0 else 0.0)
    return float(np.clip(np.median(by_fold), 0.0, _MAX_MEMORY))


def judged_on_records(model: ErrorModel, records: Sequence[ErrorSeries], problem: Problem) -> Judged:
    """The scores of a model on whole records, each started from its first measured error."""
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
    """Squared error over that of the bare model.  balance : True gives every record the same weight."""
    spans = spans_of([len(record) for record in truth])
    joined = np.concatenate(truth)
    weights = balanced_weights(spans, joined) if balance else np.ones(len(joined))
    residual = joined - np.concatenate(predictions)
    return float((weights @ residual**2) / (weights @ joined**2))


def judged_on_validation(
    problem: Problem, runs: FoldRuns, models: Sequence[ErrorModel]
) -> tuple[Judged, ...]:
    """The scores of each model on the validation records, or on left-out pieces where there are none.

    models : AESI I and II, or a single one; on pieces they are represented by the fold's fits.
    """
    if problem.split.valid:
        return tuple(judged_on_records(model, problem.split.valid, problem) for model in models)
    return tuple(runs.judge(problem, Fit(column)) for column in range(len(models)))
