"""A state that relaxes with charge throughput: toward -1 by discharge, toward +1 by charge."""

import math

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array


def relax(discharge_ah: Array, charge_ah: Array, rate_1_ah: float, start: float) -> Array:
    """(n,) the state at the samples, exact for steps of one sign.  discharge_ah, charge_ah : (n - 1,) Ah, >= 0, in each
    step.  rate_1_ah : 1/Ah.  start : initial state, -1 to 1."""
    out = np.empty(len(discharge_ah) + 1)
    _relax(discharge_ah, charge_ah, rate_1_ah, start, out)
    return out


@kept_njit(nogil=True)
def _relax(discharge, charge, rate, start, out):  # type: ignore[no-untyped-def]
    out[0] = h = start
    for k in range(discharge.shape[0]):
        h = -1.0 + (h + 1.0) * math.exp(-rate * discharge[k])
        h = 1.0 + (h - 1.0) * math.exp(-rate * charge[k])
        out[k + 1] = h
