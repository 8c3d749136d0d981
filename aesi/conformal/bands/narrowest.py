"""The search for beta: of all bands [Q(beta), Q(1 - alpha + beta)], the narrowest.

Every beta in (0, alpha) gives a band of the same nominal coverage; for skewed residuals the one with equal
tails, beta = alpha / 2, is not the narrowest. A quantile model may let its quantiles cross where it
extrapolates; such a pair is never taken for narrow (its width counts by its size).

Xu & Xie, ICML 2023 (SPCI), eq. (9).
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array


def level_pairs(alpha: float, n_betas: int) -> Array:
    """(2 n_betas,) levels: beta_1..beta_B, then 1 - alpha + beta_1..; one beta means alpha / 2."""
    betas = alpha * (np.arange(n_betas) + 0.5) / n_betas
    return np.concatenate([betas, 1 - alpha + betas])


@kept_njit()
def narrowest(quantiles: Array, low: Array, high: Array) -> None:
    """Fill low, high (n,) with the narrowest pair of each row of `quantiles` (n, 2 B)."""
    n_betas = quantiles.shape[1] // 2
    for k in range(quantiles.shape[0]):
        best = np.inf
        for j in range(n_betas):
            a, b = quantiles[k, j], quantiles[k, n_betas + j]
            if abs(b - a) < best:
                best = abs(b - a)
                low[k], high[k] = min(a, b), max(a, b)
