"""A voltage as the cell has it, whatever its instruments add."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.physics.effect import ActiveEffect, Trace
from aesi.physics.model import EspmModel


def freed_of_instruments(model: EspmModel, effects: Sequence[ActiveEffect], voltage_v: float) -> float:
    """A voltage without what instrument faults added to its reading."""
    true, one = np.array([voltage_v]), np.zeros(1)
    for active in effects:
        if active.effect.on_reading is not None:
            trace = Trace(model, one, one, np.array([voltage_v]), {})
            true = true - (active.effect.on_reading(trace, **active.parameters) - voltage_v)
    return float(true[0])
