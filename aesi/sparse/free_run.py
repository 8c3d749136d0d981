"""Compiled free runs: the predicted error is fed back, with no measured voltage after the start.

The terms of a sparse model are grouped by their function q of the error, e'[k+1] = sum_q q(e'[k]) g_q[k]. g_q depends
on the inputs alone and is known for the whole record before the loop starts, so that a step is a sum over at most
twelve functions.
"""

from __future__ import annotations

import numpy as np

from aesi.errors import DataError
from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.sparse.terms.basis import FUNCTIONS, clipped_values, value

LIMIT = 10.0
"""A prediction beyond this many times the trained half-range counts as diverged."""


def check_steps(name: str, steps: object) -> None:
    """Raises DataError, naming the model, for what is no number of steps ahead: no whole number, or none above 0."""
    if not (isinstance(steps, int | np.integer) and steps >= 1):
        raise DataError(f"{name}: a prediction {steps} steps ahead is none; give a whole number, at least 1.")


@kept_njit()
def run_with_feedback(drive: Array, functions: IntArray, start: float) -> tuple[Array, int]:
    """One model along one record, in scaled error, which is fed back held within [-1, 1].

    drive : (n_functions, n), g_q at each sample.  functions : (n_functions,) number of each q.  start : scaled error of
    sample 0.  Returns (n,) predictions of samples 1 to n, and the index of the first beyond LIMIT (-1: none); from
    there on the last value within is held.
    """
    n = drive.shape[1]
    out = np.empty(n)
    x = start
    for k in range(n):
        inside = min(1.0, max(-1.0, x))
        predicted = 0.0
        for q in range(len(functions)):
            predicted += value(functions[q], inside) * drive[q, k]
        if not abs(predicted) <= LIMIT:
            out[k:] = x
            return out, k
        x = predicted
        out[k] = x
    return out, -1


@kept_njit()
def run_ensemble(
    drive: Array, functions: IntArray, measured: Array, restart: BoolArray, state: Array
) -> Array:
    """Several models along the same rows, each piece started from its measured error; what is fed back is held within
    [-1, 1].

    drive : (n_functions, n, models).  measured : (n,) scaled error at each row.  restart : (n,) where a piece
    starts.  state : (models,) the running prediction, updated in place.  Returns (n, models): the prediction
    of the sample after each row; infinite from a divergence to the end of its piece.
    """
    n, models = drive.shape[1], drive.shape[2]
    out = np.empty((n, models))
    at = np.empty((len(FUNCTIONS), models))
    x = np.empty(models)
    for k in range(n):
        if restart[k]:
            state[:] = measured[k]
        for j in range(models):
            x[j] = min(1.0, max(-1.0, state[j]))
        clipped_values(functions, x, at)
        predicted = out[k]
        predicted[:] = 0.0
        for i in range(len(functions)):
            values, weights = at[functions[i]], drive[i, k]
            for j in range(models):
                predicted[j] += values[j] * weights[j]
        for j in range(models):
            if not (abs(state[j]) <= LIMIT and abs(predicted[j]) <= LIMIT):
                predicted[j] = np.inf
            state[j] = predicted[j]
    return out


@kept_njit()
def ahead_with_feedback(drive: Array, functions: IntArray, measured: Array, steps: int) -> Array:
    """Predictions `steps` samples ahead of each measured error; where one is beyond LIMIT on its way, the last value
    within.

    drive, functions : as for `run_with_feedback`.  measured : (n or more,) scaled errors from sample 0 on.
    Returns (n,): entry k predicts sample k + 1 from the measured sample max(0, k + 1 - steps).
    """
    n = drive.shape[1]
    out = np.empty(n)
    for k in range(n):
        first = max(0, k + 1 - steps)
        x = measured[first]
        for i in range(first, k + 1):
            inside = min(1.0, max(-1.0, x))
            predicted = 0.0
            for q in range(len(functions)):
                predicted += value(functions[q], inside) * drive[q, i]
            if not abs(predicted) <= LIMIT:
                break
            x = predicted
        out[k] = x
    return out


def autoregressive_run(by_inputs: Array, memory: float, start: float) -> Array:
    """(n,) free run of a model without feedback: the prediction by the inputs, and the first residual, which decays.

    by_inputs : (n,) scaled g(U[k]), the prediction of sample k + 1 by the inputs alone.  memory : share of a residual
    that is left after a step, 0 to 1.  start : scaled error at sample 0.
    """
    return np.asarray(by_inputs + memory ** np.arange(1, len(by_inputs) + 1) * (start - by_inputs[:1]))


def autoregressive_ahead(by_inputs: Array, memory: float, measured: Array, steps: int) -> Array:
    """(n,) as `ahead_with_feedback`, for a model without feedback.

    by_inputs, memory : as for `autoregressive_run`.  measured : (n or more,) scaled errors from sample 0 on.
    """
    n = len(by_inputs)
    residual = measured[:n] - np.append(by_inputs[:1], by_inputs[:-1])
    samples = np.arange(1, n + 1)
    start = np.maximum(samples - steps, 0)
    return np.asarray(by_inputs + memory ** (samples - start) * residual[start])


def held_at_divergence(scaled: Array, by_inputs: Array, start: float) -> tuple[Array, int]:
    """(a free run without feedback, its last value held from where the prediction by the inputs is beyond LIMIT, index
    of that sample or -1).

    scaled : the run.  by_inputs : as for `autoregressive_run`.  start : the value before the run.
    """
    beyond = np.flatnonzero(~(np.abs(by_inputs) <= LIMIT))
    if not len(beyond):
        return scaled, -1
    first = int(beyond[0])
    last = scaled[first - 1] if first else start
    return np.append(scaled[:first], np.full(len(scaled) - first, last)), first
