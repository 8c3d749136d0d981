"""Charge throughput from samples, by direction."""

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.numerics.typing import Array
from aesi.physics.effect import Trace


def step_throughput_ah(trace: Trace) -> tuple[Array, Array]:
    """(discharged, charged), (n - 1,) Ah each, >= 0, in each step of the record.

    Exact for straight lines between samples (also where the sign changes within a step) and for held rows.
    """
    dt = np.diff(trace.time_s) / SECONDS_PER_HOUR
    end = trace.current_a[1:]
    start = end if trace.backward else trace.current_a[:-1]
    out, into = np.maximum(end, 0.0), np.maximum(start, 0.0)
    crosses = start * end < 0
    span = np.where(crosses, np.abs(end - start), 1.0)
    discharge = np.where(crosses, 0.5 * np.maximum(start, end) ** 2 / span, 0.5 * (out + into))
    charge = discharge - 0.5 * (start + end)
    return discharge * dt, charge * dt


def throughput_ah(trace: Trace) -> Array:
    """(n,) Ah, integral of |I| since the first sample."""
    discharge, charge = step_throughput_ah(trace)
    return np.concatenate([[0.0], np.cumsum(discharge + charge)])
