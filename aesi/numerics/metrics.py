"""Measures of fit: plain functions of two series."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.numerics.typing import Array


def mse(truth: Array, prediction: Array) -> float:
    """Mean squared difference, in the square of the common unit; NaN for empty series."""
    difference = np.asarray(truth, dtype=float) - prediction
    return float(np.mean(difference**2)) if difference.size else float("nan")


def rmse(truth: Array, prediction: Array) -> float:
    """Root of the mean squared difference, in the common unit."""
    return float(np.sqrt(mse(truth, prediction)))


def rms(values: Array | Sequence[float]) -> float:
    """Root mean square of values of any shape, in their own unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def mser(error: Array, prediction: Array) -> float:
    """Reduction of the mean squared error in percent, the paper's equation (27).

    error : (n,) V_measured - V_model.  prediction : (n,) the predicted error, added to the model's voltage.
    100 is a perfect correction, 0 is none, negative is worse than none. NaN where the error is all zero.
    """
    before = mse(error, np.zeros_like(error))
    return 100.0 * (1.0 - mse(error, prediction) / before) if before > 0 else float("nan")


def pearson(truth: Array, prediction: Array) -> float:
    """Correlation coefficient; 0 where either series is constant or not finite, since it explains nothing."""
    if len(truth) < 2 or not np.isfinite(prediction).all():
        return 0.0
    if np.ptp(truth) == 0.0 or np.ptp(prediction) == 0.0:  # their means have round-off, which would correlate
        return 0.0
    a, b = truth - np.mean(truth), prediction - np.mean(prediction)
    scale = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / scale if scale > 0 else 0.0
