"""Empirical quantiles with the finite-sample correction of conformal prediction."""

from __future__ import annotations

from numbers import Real

import numpy as np

from aesi.errors import FitError, InputError
from aesi.numerics.typing import Array


def check_miss_rate(alpha: object) -> None:
    """Raises InputError for an alpha that is no share of misses, in (0, 1)."""
    if isinstance(alpha, int) or not (isinstance(alpha, Real) and 0 < float(alpha) < 1):
        raise InputError(f"alpha = {alpha} is not a share of misses; give a value between 0 and 1.")


def conformal_quantile(scores: Array, alpha: float, tails: int = 1) -> float:
    """The ceil((n + 1)(1 - a))-th smallest score, a = alpha / tails: one more exchangeable score is below with
    >= 1 - a.

    scores : (n,), finite.  tails : number of equal parts of the miss rate alpha, of which this tail has one.
    Raises FitError where n is too small for that rank to exist (n < 1/a - 1).
    Vovk, Gammerman & Shafer, Algorithmic Learning in a Random World (2005), ch. 2.
    """
    n, own = scores.size, alpha / tails
    rank = int(np.ceil((n + 1) * (1 - own) - 1e-9))  # round-off must not ask for one rank too many
    if rank > n:
        raise FitError(
            f"{n} scores cannot support a miss rate of {alpha:g}: at least {int(np.ceil(1 / own)) - 1} "
            "are needed; give more calibration data or a larger alpha."
        )
    return float(np.partition(scores, rank - 1)[rank - 1])
