"""State of charge at the start of a record, where the record itself tells."""

from __future__ import annotations

from aesi.errors import DataError
from aesi.physics import Cell, initial_soc
from aesi.records import Measurement

REST_C_RATE = 0.02
"""A first current below this C-rate counts as rest, and the first voltage as a rest voltage."""


def rest_soc(cell: Cell, measurement: Measurement) -> float:
    """State of charge from the first voltage of a record that starts at rest.

    Raises DataError where the first current is above `REST_C_RATE`: the voltage then says nothing exact.
    """
    limit = REST_C_RATE * cell.capacity_ah
    first = float(measurement.current_a[0])
    if abs(first) > limit:
        raise DataError(
            f"{measurement.name} starts under {first:.3g} A, not at rest (below {limit:.2g} A), so its first voltage "
            "does not give the state of charge; give soc0."
        )
    return initial_soc(cell, float(measurement.voltage_v[0]))
