"""The cell that a calibration writes: in one state of health, with full and empty as the records show them.

A file is mostly simulated without a state of health. The fit is therefore of a cell in one state, from which each
record may differ in active material and silicon within a prior. `capacities` has the capacity of the cell in each
record, relative to the file's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.calibration.model import FitState, Model
from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.physics.balance import aged_range, same_rest
from aesi.physics.cell import Cell
from aesi.physics.initial_state import initial_state

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


def fit_states(model: Model, declared: Cell, x: Array) -> dict[FitState, tuple[Cell, Array]]:
    """State -> (cell, working vector for the simulation of its records), for a fit that ended at `x`.

    The declared cell has lost nothing, and takes currents as measured, like a file in a simulation.
    """
    return {
        "declared": (declared, model.as_simulated(np.zeros(model.layout.size))),
        "simulated": _with_read_starts(model, model.as_simulated(x)),
        "fitted": (model.cell_at(x), x),
    }


def _with_read_starts(model: Model, x: Array) -> tuple[Cell, Array]:
    """(cell of a working vector, the vector with the starts that the written file reads from the voltages).

    Under load that may be far from where the fit put it: the file of a 1C discharge of a Panasonic that began at 0.78
    in the fit reads 1.00, and errs by 304 mV where the fit errs by 7.
    """
    cell, written, out = model.cell_at(x), written_cell(model, x), x.copy()
    for index, record in enumerate(model.records):
        if record.start.basis not in ("rest", "load"):
            continue
        try:
            read = initial_state(written, record.data, hold=record.data.hold_taken, model=model.model_name)
        except DataError:  # a simulation has to be given the start
            continue
        soc = same_rest(written, cell, read.soc)
        out[model.layout.soc(index)] = (soc - record.start.soc) / record.soc_sd
    return cell, out


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
