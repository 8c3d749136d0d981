"""White noise on top of a slowly wandering error: likelihood and whitening in one pass.

    y_k = x_k + v_k,   x an Ornstein-Uhlenbeck process of deviation `slow` and memory `tau`,   v white
    (1)

The Kalman filter of (1) is linear in y, so that it whitens a residual and its sensitivities alike: samples
that repeat one another count for what they add. Uneven sampling enters through exp(-gap / tau).
Durbin & Koopman, Time Series Analysis by State Space Methods, 2nd ed. (2012), chapters 4 and 7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.optimize import minimize

from aesi.numerics.typing import Array

TAU_RANGE_S = (2.0, 5000.0)
"""Memories that are told apart from white noise and from an offset at one sample a second."""


@dataclass(frozen=True)
class ColouredNoise:
    """Deviation of the white part and of the slow part (same unit), and the memory of the slow part in s."""

    white: float
    slow: float
    tau_s: float


@njit(cache=True, nogil=True)
def _filter(columns, gap_s, white, slow, tau_s):  # type: ignore[no-untyped-def]
    n, m = columns.shape
    out = np.empty((n, m))
    state = np.zeros(m)
    p = slow * slow
    log_variance = 0.0
    last_gap = -1.0
    phi = 0.0
    for k in range(n):
        if k > 0:
            if gap_s[k] != last_gap:
                last_gap = gap_s[k]
                phi = np.exp(-last_gap / tau_s)
            p = phi * phi * p + slow * slow * (1.0 - phi * phi)
            for j in range(m):
                state[j] *= phi
        variance = p + white * white
        scale = 1.0 / np.sqrt(variance)
        gain = p / variance
        for j in range(m):
            innovation = columns[k, j] - state[j]
            out[k, j] = innovation * scale
            state[j] += gain * innovation
        p *= 1.0 - gain
        log_variance += np.log(variance)
    return out, log_variance


def whiten(columns: Array, time_s: Array, noise: ColouredNoise) -> tuple[Array, float]:
    """Whitened columns, and the log-determinant of the covariance.

    columns : (n, m), the unit of `noise`.  time_s : (n,) s.  Returns ((n, m) of unit variance, log det).
    """
    gap = np.diff(time_s, prepend=time_s[0])
    table = np.ascontiguousarray(columns, dtype=float)
    whitened, log_variance = _filter(table, gap, noise.white, noise.slow, noise.tau_s)
    return whitened, float(log_variance)


def log_likelihood(residual: Array, time_s: Array, noise: ColouredNoise) -> float:
    """Gaussian log-likelihood of a residual (n,) under (1)."""
    whitened, log_variance = whiten(residual[:, None], time_s, noise)
    return -0.5 * float(np.sum(whitened**2) + log_variance + len(residual) * np.log(2 * np.pi))


def fit_noise(
    residual: Array, time_s: Array, white_floor: float, start: ColouredNoise | None = None
) -> ColouredNoise:
    """Maximum-likelihood parameters of (1) for one residual.

    white_floor : smallest white deviation admitted, the unit of `residual` (the sensor's own noise).
    """
    spread = max(float(np.sqrt(np.mean(residual**2))), white_floor)
    low = np.log([white_floor, 1e-3 * white_floor, TAU_RANGE_S[0]])
    high = np.log([max(spread, 1.01 * white_floor), 5 * spread, TAU_RANGE_S[1]])

    def cost(v: Array) -> float:
        inside = np.clip(v, low, high)
        white, slow, tau = np.exp(inside)
        penalty = 10.0 * float(np.sum((v - inside) ** 2))
        return -log_likelihood(residual, time_s, ColouredNoise(white, slow, tau)) + penalty

    starts = [start] if start else [ColouredNoise(white_floor, 0.7 * spread, t) for t in (10.0, 200.0)]
    best = None
    for guess in starts:
        x0 = np.log([max(guess.white, white_floor) * 1.02, max(guess.slow, 1e-2 * white_floor), guess.tau_s])
        found = minimize(
            cost,
            np.clip(x0, low, high),
            method="Nelder-Mead",
            options={"xatol": 0.02, "fatol": 0.1, "maxfev": 160},
        )
        if best is None or found.fun < best.fun:
            best = found
    assert best is not None
    white, slow, tau = np.exp(np.clip(best.x, low, high))
    return ColouredNoise(float(white), float(slow), float(tau))
