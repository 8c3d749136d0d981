"""The voltage at which a record's cell rests before the current starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.numerics.typing import Array
from aesi.physics.effect import ActiveEffect, Trace
from aesi.physics.model import EspmModel
from aesi.records import Measurement

CALM_ROWS = 60
"""First rows that are looked at for a rest."""


def calm_voltage_v(record: Measurement, limit_a: float) -> Array:
    """(k,) V of the rows before the current starts, at least the first and at most sixty."""
    calm = np.abs(record.current_a[:CALM_ROWS]) <= max(abs(float(record.current_a[0])), limit_a)
    n = len(calm) if calm.all() else max(1, int(np.argmin(calm)))
    return record.voltage_v[:n]


def moved_v(calm_v: Array) -> float:
    """V from the first quarter of a rest to its last; nought where the rows are too few to tell it from noise."""
    part = len(calm_v) // 4
    return float(calm_v[-part:].mean() - calm_v[:part].mean()) if part > 3 else 0.0


def freed_of_instruments(model: EspmModel, effects: Sequence[ActiveEffect], voltage_v: float) -> float:
    """A voltage without what instrument faults added to its reading."""
    true, one = np.array([voltage_v]), np.zeros(1)
    for active in effects:
        if active.effect.on_reading is not None:
            trace = Trace(model, one, one, np.array([voltage_v]), {})
            true = true - (active.effect.on_reading(trace, **active.parameters) - voltage_v)
    return float(true[0])
