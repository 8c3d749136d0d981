"""Records that do not fit a cell, refused before anything is fitted."""

from __future__ import annotations

import numpy as np

from aesi.calibration.records import Prepared
from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import DataError
from aesi.physics.cell import Cell
from aesi.records import Measurement

VOLTAGE_MARGIN_V = 0.3
"""Beyond the voltage limits of the file that a record may go."""
SOC_MARGIN = 0.12
"""Beyond full and empty, by the declared capacity: new cells hold more than they are sold for."""


def check_voltage(cell: Cell, data: Measurement) -> None:
    """Refuse voltages that this cell cannot have."""
    low, high = cell.lower_voltage_v - VOLTAGE_MARGIN_V, cell.upper_voltage_v + VOLTAGE_MARGIN_V
    outside = np.flatnonzero((data.voltage_v < low) | (data.voltage_v > high))
    if len(outside):
        row = int(outside[0])
        raise DataError(
            f"{data.name}: {data.voltage_v[row]:.3f} V at {data.time_s[row]:g} s (row {row}) is outside the range of "
            f"{cell.name} ({cell.lower_voltage_v:g} to {cell.upper_voltage_v:g} V); the data belong to another cell, "
            "or the voltage is not in volts."
        )


def check_charge(cell: Cell, record: Prepared) -> None:
    """Refuse charge that takes the cell far beyond full or empty."""
    rows = record.rows
    mean = (
        rows.current_a[1:] if record.hold == "backward" else 0.5 * (rows.current_a[1:] + rows.current_a[:-1])
    )
    moved_ah = np.concatenate([[0.0], np.cumsum(mean * np.diff(rows.time_s))]) / SECONDS_PER_HOUR
    soc = record.start.soc - moved_ah / cell.capacity_ah
    wrong = (soc < -SOC_MARGIN) | (soc > 1.0 + SOC_MARGIN)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError(
            f"{record.name}: the charge moved takes the cell to a state of charge of {100 * soc[row]:.0f} % at "
            f"{rows.time_s[row]:g} s, from {100 * record.start.soc:.0f} % at the start and with {cell.capacity_ah:.3g} "
            "Ah; check the cell file, --soc0 and the sign and unit of the current."
        )
