"""Effects that are not in the catalogue, which a finder must call unknown.

Each changes the noise-free voltage by a structured amount that no effect of the catalogue describes: at magnitude
m, roughly m times the stated size in mV.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.laboratory.simulator import TrueRun
from aesi.numerics.typing import Array


@dataclass(frozen=True)
class Stranger:
    """An unknown effect.  shift : (trace, capacity in Ah, generator) -> (n,) V added to the voltage at magnitude 1."""

    shift: Callable[[TrueRun, float, np.random.Generator], Array]


def _throughput(trace: TrueRun) -> Array:
    """(n,) Ah, charge throughput in both directions."""
    step = 0.5 * (np.abs(trace.current_a[1:]) + np.abs(trace.current_a[:-1])) * np.diff(trace.time_s)
    return np.concatenate([[0.0], np.cumsum(step)]) / SECONDS_PER_HOUR


def _lagged(values: Array, time_s: Array, constant_s: float) -> Array:
    """First-order lag of (n,) values that are linear between rows."""
    decay = np.exp(-np.diff(time_s) / constant_s)
    out = np.empty_like(values)
    out[0] = 0.0
    for k, factor in enumerate(decay):
        out[k + 1] = factor * out[k] + (1 - factor) * 0.5 * (values[k] + values[k + 1])
    return out


def _breathing(trace: TrueRun, capacity_ah: float, rng: np.random.Generator) -> Array:
    """Waves of the open-circuit voltage along the charge throughput."""
    wave = rng.uniform(0.06, 0.12) * capacity_ah
    shift: Array = 6e-3 * np.sin(2 * np.pi * _throughput(trace) / wave)
    return shift


def _memory(trace: TrueRun, capacity_ah: float, rng: np.random.Generator) -> Array:
    """Difference of two lags of the current: a first response that decays some minutes later."""
    rate = trace.current_a / capacity_ah
    fast = _lagged(rate, trace.time_s, rng.uniform(40, 80))
    slow = _lagged(rate, trace.time_s, rng.uniform(400, 800))
    return 0.03 * (slow - fast) * np.sign(slow)


def _loose_contact(trace: TrueRun, capacity_ah: float, rng: np.random.Generator) -> Array:
    """A contact that opens a little at random for tens of seconds."""
    bad = np.zeros(len(trace.time_s))
    now_s = 0.0
    while now_s < trace.time_s[-1]:
        opens_s = now_s + rng.exponential(250) + 1.0
        now_s = opens_s + rng.exponential(60) + 5.0
        bad[(opens_s <= trace.time_s) & (trace.time_s < now_s)] = rng.uniform(0.5, 1.5)
    return -0.03 * bad * trace.current_a / capacity_ah


def _wandering(trace: TrueRun, capacity_ah: float, rng: np.random.Generator) -> Array:
    """A voltage reference that drifts with the room's air, independently of the cell."""
    period = rng.uniform(900, 2000)
    phase = rng.uniform(0, 2 * np.pi)
    shift: Array = 6e-3 * (np.sin(2 * np.pi * trace.time_s / period + phase) - np.sin(phase))
    return shift


def _uneven_converter(trace: TrueRun, capacity_ah: float, rng: np.random.Generator) -> Array:
    """A converter with unequal steps: an error that is periodic over tens of millivolts."""
    pitch = rng.uniform(0.03, 0.05)
    shift: Array = 6e-3 * np.sin(2 * np.pi * trace.voltage_v / pitch)
    return shift


def _fatigue(trace: TrueRun, capacity_ah: float, rng: np.random.Generator) -> Array:
    """A resistance that grows in the first seconds of every discharge and recovers at rest."""
    effort = _lagged(np.maximum(trace.current_a, 0.0) / capacity_ah, trace.time_s, rng.uniform(60, 120))
    shift: Array = -0.05 * effort * np.maximum(trace.current_a, 0.0) / capacity_ah
    return shift


STRANGERS: dict[str, Stranger] = {
    "breathing": Stranger(_breathing),
    "memory": Stranger(_memory),
    "loose_contact": Stranger(_loose_contact),
    "wandering": Stranger(_wandering),
    "uneven_converter": Stranger(_uneven_converter),
    "fatigue": Stranger(_fatigue),
}
