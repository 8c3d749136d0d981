"""Faults that are added to a measured record, or to the file that declares the cell.

Constant offsets and gains of the current, offsets of the voltage and lags between channels are the sensor faults of the
literature on fault detection (Hu et al. 2020, Renew. Sustain. Energy Rev., doi:10.1016/j.rser.2020.110400). An added
contact resistance lowers the measured voltage by the measured current (discharge positive) times the resistance. A loss
of capacity is made by a cell file that declares more capacity than the cell has.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from aesi.physics import Cell
from aesi.records import Measurement

FaultKind = Literal[
    "current_offset",
    "current_gain",
    "voltage_offset",
    "voltage_lag",
    "wrong_soc0",
    "contact_resistance",
    "capacity_in_file",
]
"""Kind of a fault. Its size is: current_offset A; current_gain 1 (factor); voltage_offset V; voltage_lag s; wrong_soc0
1 (the given state of charge is too low by it); contact_resistance ohm; capacity_in_file 1 (share by which the file
declares too much)."""


def _offset(data: Measurement, size: float) -> Measurement:
    return replace(data, current_a=data.current_a + size)


def _gain(data: Measurement, size: float) -> Measurement:
    return replace(data, current_a=size * data.current_a)


def _voltage(data: Measurement, size: float) -> Measurement:
    return replace(data, voltage_v=data.voltage_v + size)


def _lag(data: Measurement, size: float) -> Measurement:
    """Each row gets the voltage of `size` seconds before."""
    return replace(data, voltage_v=np.interp(data.time_s - size, data.time_s, data.voltage_v))


def _contact(data: Measurement, size: float) -> Measurement:
    return replace(data, voltage_v=data.voltage_v - size * data.current_a)


IN_THE_RECORD: Mapping[FaultKind, Callable[[Measurement, float], Measurement]] = {
    "current_offset": _offset,
    "current_gain": _gain,
    "voltage_offset": _voltage,
    "voltage_lag": _lag,
    "contact_resistance": _contact,
}


def with_fault(data: Measurement, kind: FaultKind, size: float) -> Measurement:
    """The record as a faulty instrument, or a cell with a contact resistance, would have recorded it; unchanged for
    kinds that are not of the record.  size : see `FaultKind`."""
    change = IN_THE_RECORD.get(kind)
    return data if change is None else change(data, size)


def declared_with_fault(cell: Cell, kind: FaultKind, size: float) -> Cell:
    """For the kind `capacity_in_file`, the cell with an electrode area and a nominal capacity larger by the share
    `size`; for all others the cell unchanged."""
    if kind != "capacity_in_file":
        return cell
    return replace(
        cell,
        electrode_area_m2=cell.electrode_area_m2 * (1 + size),
        nominal_capacity_ah=cell.nominal_capacity_ah * (1 + size),
    )


def soc0_with_fault(soc0: float | None, kind: FaultKind, size: float) -> float | None:
    """The state of charge at the first row that the tracer is given: too low by `size` for the kind `wrong_soc0`."""
    return soc0 if soc0 is None or kind != "wrong_soc0" else soc0 - size
