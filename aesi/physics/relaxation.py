"""A state that relaxes with charge throughput: toward -1 by discharge, toward +1 by charge."""

import math

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array


def relax(before_ah: Array, after_ah: Array, rate_1_ah: float, start: float) -> Array:
    """(n,) the state at the samples, exact.  before_ah, after_ah : (n - 1,) Ah in each step, positive on discharge,
    before and after its current changes sign.  rate_1_ah : 1/Ah.  start : initial state, -1 to 1."""
    out = np.empty(len(before_ah) + 1)
    _relax(before_ah, after_ah, rate_1_ah, start, out)
    return out


@kept_njit(nogil=True)
def _relax(before, after, rate, start, out):  # type: ignore[no-untyped-def]
    out[0] = h = start
    for k in range(before.shape[0]):
        for moved in (before[k], after[k]):
            branch = -math.copysign(1.0, moved)
            h = branch + (h - branch) * math.exp(-rate * abs(moved))
        out[k + 1] = h
