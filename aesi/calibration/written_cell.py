"""The cell that a calibration writes: in one state of health, with full and empty as the records show them.

A file is mostly simulated without a state of health. The fit is therefore of a cell in one state, from which each
record may differ in active material and silicon within a prior. `capacities` has the capacity of the cell in each
record, relative to the file's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.calibration.model import Model
from aesi.numerics.typing import Array
from aesi.physics.balance import aged_range, same_rest
from aesi.physics.cell import Cell

GRID = 20001
"""States of charge between which the empty cell is interpolated, over all that both electrodes can have."""


def written_cell(model: Model, x: Array) -> Cell:
    """The cell of the file: full as in the fit, and empty at a rest voltage of its lower voltage limit.

    x : working vector, as in the others.
    """
    return _as_aged(model, x, 1.0, 1.0)


def capacities(model: Model, x: Array) -> dict[str, float]:
    """Name of a record -> capacity of the cell in it, over that of the written cell."""
    written_ah = written_cell(model, x).capacity_ah
    return {r.name: cell_in_record(model, x, i).capacity_ah / written_ah for i, r in enumerate(model.records)}


def cell_in_record(model: Model, x: Array, index: int) -> Cell:
    """The written cell with the active material and silicon that it had in a record."""
    return _as_aged(model, x, model.material(index, x), model.silicon(index, x))


def start_soc(model: Model, x: Array, index: int) -> float:
    """State of charge at the start of a record, in the windows of the written cell aged as in that record.

    It has the same rest voltage as the fitted start. The windows differ, since in those of the fit empty need not be at
    the lower voltage limit.
    """
    record = model.records[index]
    material, silicon = model.material(index, x), model.silicon(index, x)
    fitted = model.aged(model.cell_at(x), material, silicon)
    soc = record.start.soc + record.soc_sd * float(x[model.layout.soc(index)])
    return same_rest(fitted, cell_in_record(model, x, index), soc)


def _as_aged(model: Model, x: Array, material: float, silicon: float) -> Cell:
    """The written cell with these shares of active material and silicon left."""
    cell = model.aged(model.cell_at(x), 1.0, silicon)
    # The windows of a fit are as wide as the start file's capacity, and its cell may be much larger than that.
    soc = np.linspace(*aged_range(cell, beyond=np.inf), GRID)
    ocv = np.maximum.accumulate(cell.rest_voltage_v(soc))
    empty = float(np.interp(cell.lower_voltage_v, ocv, soc))
    n_1, p_1 = cell.stoichiometries(1.0)
    n_0, p_0 = cell.stoichiometries(empty)
    cell = cell.with_negative(theta_min=n_0, theta_max=n_1).with_positive(theta_min=p_1, theta_max=p_0)
    return replace(model.aged(cell, material, 1.0), nominal_capacity_ah=model.cell.nominal_capacity_ah)
