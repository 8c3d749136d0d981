"""Charge throughput from samples, in the order in which it flows."""

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.numerics.typing import Array
from aesi.physics.effect import Trace


def step_charges_ah(trace: Trace) -> tuple[Array, Array]:
    """(n - 1,) Ah each, positive on discharge: the charge of each step before its current changes sign, and after that
    (0 where it does not).

    Exact for straight lines between samples and for held rows.
    """
    dt = np.diff(trace.time_s) / SECONDS_PER_HOUR
    end = trace.current_a[1:]
    start = end if trace.backward else trace.current_a[:-1]
    crosses = start * end < 0
    span = np.where(crosses, np.abs(end - start), 1.0)
    before = np.where(crosses, 0.5 * start * np.abs(start) / span, 0.5 * (start + end))
    after = np.where(crosses, 0.5 * end * np.abs(end) / span, 0.0)
    return before * dt, after * dt


def throughput_ah(trace: Trace) -> Array:
    """(n,) Ah, integral of |I| since the first sample."""
    before, after = step_charges_ah(trace)
    return np.concatenate([[0.0], np.cumsum(np.abs(before) + np.abs(after))])
