"""Does a record belong to a cell?  How far beyond the file's limits it may go, for every command that fits."""

from __future__ import annotations

import numpy as np

from aesi.errors import DataError
from aesi.physics.cell import Cell
from aesi.records import Measurement

VOLTAGE_MARGIN_V = 0.3
"""Beyond the voltage limits of the file that a record may go: fast pulses and old cells do."""
SOC_MARGIN = 0.12
"""Beyond full and empty, by the declared capacity: new cells hold more than they are sold for."""


def check_voltage(cell: Cell, data: Measurement) -> None:
    """Raises DataError where the voltage leaves what the cell file admits."""
    low, high = cell.lower_voltage_v - VOLTAGE_MARGIN_V, cell.upper_voltage_v + VOLTAGE_MARGIN_V
    outside = np.flatnonzero((data.voltage_v < low) | (data.voltage_v > high))
    if len(outside):
        row = int(outside[0])
        raise DataError(
            f"{data.name}: {data.voltage_v[row]:.3f} V at {data.time_s[row]:g} s (row {row}) is outside the range of "
            f"{cell.name} ({cell.lower_voltage_v:g} to {cell.upper_voltage_v:g} V); the data belong to another cell, "
            "or the voltage is not in volts."
        )
