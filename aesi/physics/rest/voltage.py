"""The voltage of a cell at rest: as it was read, and freed of what instrument faults added to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.numerics.typing import Array
from aesi.physics.effect import ActiveEffect, Trace
from aesi.physics.model import EspmModel

CALM_ROWS = 60
"""First rows of a rest that say where a charge has ended."""
MOVING_V = 4e-3
"""A voltage that moves more over these is that of the last of them. A convention: a full cell falls by 6 to 30 mV."""


def first_rows_v(rest_v: Array) -> float:
    """V at which a rest begins: the mean of its first rows, of their last quarter where it moves."""
    calm = rest_v[:CALM_ROWS]
    part = len(calm) // 4
    moved = float(calm[-part:].mean() - calm[:part].mean()) if part > 3 else 0.0
    return float((calm[-part:] if abs(moved) > MOVING_V else calm).mean())


def freed_of_instruments(model: EspmModel, effects: Sequence[ActiveEffect], voltage_v: float) -> float:
    """A voltage without what instrument faults added to its reading."""
    true, one = np.array([voltage_v]), np.zeros(1)
    for active in effects:
        if active.effect.on_reading is not None:
            trace = Trace(model, one, one, np.array([voltage_v]), {})
            true = true - (active.act(active.effect.on_reading, trace) - voltage_v)
    return float(true[0])
