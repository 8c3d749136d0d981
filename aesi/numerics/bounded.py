"""Levenberg-Marquardt inside a box, for residuals that cost a simulation each.

Coordinates that sit on a bound and are pushed outwards are frozen for the step; steps are clipped to the box.
Nocedal & Wright, Numerical Optimization, 2nd ed. (2006), chapters 10 and 16.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array

Linearise = Callable[[Array], tuple[Array, Array] | None]
Cost = Callable[[Array], float]


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where a descent ended: x (n,), half the sum of squares there, and how many steps it took."""

    x: Array
    cost: float
    steps: int


def descend(
    linearise: Linearise, cost: Cost, x0: Array, low: Array, high: Array, steps: int, tolerance: float
) -> Minimum:
    """Minimise half a sum of squares within low <= x <= high.

    linearise : x -> (residual (m,), jacobian of the residual (m, n)), or None where the model fails.
    cost : x -> half the sum of squares, inf where the model fails.
    Stops when a step gains less than `tolerance`, after `steps` steps, or when no step gains.
    """
    x = np.clip(x0, low, high)
    best = cost(x)
    damping = 1e-3
    for step in range(steps):
        linear = linearise(x)
        if linear is None or not np.isfinite(best):
            return Minimum(x, best, step)
        residual, jacobian = linear
        gradient = jacobian.T @ residual
        free = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
        if not free.any():
            return Minimum(x, best, step)
        normal = jacobian[:, free].T @ jacobian[:, free]
        gained = False
        for _ in range(6):
            trial = x.copy()
            lifted = normal + damping * np.diag(np.diag(normal) + 1e-12 * np.trace(normal) + 1e-300)
            trial[free] -= np.linalg.lstsq(lifted, gradient[free], rcond=None)[0]
            trial = np.clip(trial, low, high)
            value = cost(trial)
            if value < best:
                gained = True
                break
            damping *= 8.0
        if not gained:
            return Minimum(x, best, step + 1)
        gain, x, best = best - value, trial, value
        damping = max(damping / 5.0, 1e-6)
        if gain < tolerance:
            return Minimum(x, best, step + 1)
    return Minimum(x, best, steps)
