"""Smoothed quantile regression against the exact minimum of the pinball loss by linear programming."""

import numpy as np
import pytest
from scipy.optimize import linprog

from aesi.numerics.quantile_regression import fit_quantiles


def pinball(y: np.ndarray, fitted: np.ndarray, tau: float) -> float:
    r = y - fitted
    return float(np.mean(np.maximum(tau * r, (tau - 1) * r)))


@pytest.mark.parametrize("tau", [0.05, 0.5, 0.95])
def test_the_loss_is_that_of_the_exact_minimum(rng: np.random.Generator, tau: float) -> None:
    n = 800
    x = np.column_stack([np.ones(n), rng.standard_normal((n, 3))])
    y = x @ [0.0, 1.0, -2.0, 0.5] + (1 + 0.5 * np.abs(x[:, 1])) * rng.standard_normal(n)
    # min tau 1'u + (1 - tau) 1'v  subject to  x (b+ - b-) + u - v = y,  everything non-negative
    cost = np.concatenate([np.zeros(8), np.full(n, tau), np.full(n, 1 - tau)])
    exact = linprog(cost, A_eq=np.hstack([x, -x, np.eye(n), -np.eye(n)]), b_eq=y, method="highs")
    coefficients = fit_quantiles(x, y, np.array([tau]))[:, 0]
    # Smoothing costs a loss of second order in its width; in the tail the few rows beyond it weigh most.
    assert exact.fun / n <= pinball(y, x @ coefficients, tau) <= 1.02 * exact.fun / n
