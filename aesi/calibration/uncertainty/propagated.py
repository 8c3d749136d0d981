"""The covariance of a fit, propagated to quantities of the cell that it writes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aesi.calibration.result import Calibration
from aesi.calibration.written_cell import written_cell
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell

STEP = 1e-2
"""Step of the slopes, in standard deviations of the priors."""


def propagated_variance(found: Calibration, quantities: Callable[[Cell], Array]) -> Array:
    """Variance of each quantity, to first order. A parameter on an upper bound has its slope taken towards the inside.

    quantities : of a written cell, an array of any shape, which the variances have too.
    """
    model, x = found.model, found.x
    at = quantities(written_cell(model, x))
    slopes = np.zeros((len(x), *at.shape))
    for j in range(len(x)):
        h = STEP if x[j] + STEP <= model.high[j] else -STEP
        there = x.copy()
        there[j] += h
        slopes[j] = (quantities(written_cell(model, there)) - at) / h
    return np.asarray(np.einsum("i...,ij,j...->...", slopes, found.covariance, slopes))
