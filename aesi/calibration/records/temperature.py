"""Records whose voltage contradicts the temperature that they are fitted at."""

from __future__ import annotations

from collections.abc import Container, Sequence
from functools import partial

from aesi.calibration.records.prepared import Prepared
from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import simulate
from aesi.physics.cell import Cell
from aesi.physics.simulation import ModelName
from aesi.physics.start.temperature import other_temperature

OTHER_CELL = "the start file is of a cell with other kinetics, and what the fit moves is right"
"""Another reason for the contradiction, where the temperature is right."""


def against_temperature(
    cell: Cell, records: Sequence[Prepared], model: ModelName, given: Container[str] = ()
) -> tuple[str, ...]:
    """A sentence for each such record: by the start file, before a fit makes up for it.

    cell : of the start file, of the size that the records tell.
    given : names of the records whose temperature no column has.
    """
    out = []
    declared_degc = cell.initial_temperature_k - ZERO_CELSIUS_K
    for record in records:
        if record.kelvin is None:
            continue
        left_v = partial(_left_v, cell, record, model)
        found = other_temperature(record.kelvin - ZERO_CELSIUS_K, declared_degc, left_v)
        if found is not None:
            out.append(found.sentence(record.name, "the start file", OTHER_CELL, given=record.name in given))
    return tuple(out)


def _left_v(cell: Cell, record: Prepared, model: ModelName, degc: Array) -> float | None:
    rows = record.rows
    try:
        run = simulate(
            cell,
            rows.time_s,
            rows.current_a,
            record.start.soc,
            (),
            degc,
            record.hold,
            on_depletion="clip",
            model=model,
        )
    except AesiError:
        return None
    return rms(rows.voltage_v - run.voltage_v)
