"""Faults put into a measured record, or into the file that describes the cell, as published practice has them.

Constant offsets and gains of the current, offsets of the voltage and lags between channels are the sensor faults of
the literature on fault detection (Hu et al. 2020, Renew. Sustain. Energy Rev., doi:10.1016/j.rser.2020.110400); an
added contact drops the measured current times its resistance; lost capacity goes into the file, as more than the cell
has.
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


def _offset(data: Measurement, size: float) -> Measurement:
    return replace(data, current_a=data.current_a + size)


def _gain(data: Measurement, size: float) -> Measurement:
    return replace(data, current_a=size * data.current_a)


def _voltage(data: Measurement, size: float) -> Measurement:
    return replace(data, voltage_v=data.voltage_v + size)


def _lag(data: Measurement, size: float) -> Measurement:
    """Each row holds the voltage of `size` seconds ago."""
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
    """The record as a faulty instrument, or a cell with a worse contact, would have written it."""
    change = IN_THE_RECORD.get(kind)
    return data if change is None else change(data, size)


def declared_with_fault(cell: Cell, kind: FaultKind, size: float) -> Cell:
    """The file as it would be if it declared a share `size` more of both electrodes than the cell has."""
    if kind != "capacity_in_file":
        return cell
    return replace(
        cell,
        electrode_area_m2=cell.electrode_area_m2 * (1 + size),
        nominal_capacity_ah=cell.nominal_capacity_ah * (1 + size),
    )


def soc0_with_fault(soc0: float | None, kind: FaultKind, size: float) -> float | None:
    """The state of charge that the finder is told."""
    return soc0 if soc0 is None or kind != "wrong_soc0" else soc0 - size
