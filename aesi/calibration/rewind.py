"""The cell that is written: full and empty where the records show them, of the age that serves its records best.

A cell ages between its tests, and a file has one capacity. A file is mostly simulated without a state of health, on
currents as they were measured: so its age is that of one of its records, of the one with whose age all of them cost
least as they were measured. What each record has more or less is its share in `capacities`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.calibration.model import Model
from aesi.numerics.typing import Array
from aesi.physics.balance import aged_range
from aesi.physics.cell import Cell


def serving(model: Model, x: Array) -> int:
    """The record of whose age the file is: as aged as in it, all records as measured together cost least."""
    return min(range(len(model.records)), key=lambda index: _cost(model, _all_as_aged(model, x, index)))


def rewound(model: Model, x: Array, like: int) -> Cell:
    """The cell with full where its charged records started, and empty where it rests at its lower voltage.

    like : the record of whose age it is.
    """
    return _as_aged(model, x, model.material(like, x), model.silicon(like, x))


def capacities(model: Model, x: Array, like: int) -> dict[str, float]:
    """Record -> share of the written cell's capacity that the cell had then.  like : see `rewound`."""
    written_ah = rewound(model, x, like).capacity_ah
    return {
        r.name: _as_aged(model, x, model.material(i, x), model.silicon(i, x)).capacity_ah / written_ah
        for i, r in enumerate(model.records)
    }


def _as_aged(model: Model, x: Array, material: float, silicon: float) -> Cell:
    """The written cell with these shares of active material and silicon left."""
    cell = model.aged(model.cell_at(x), 1.0, silicon)
    charged = [
        r.start.soc + r.soc_sd * float(x[model.layout.soc(i)])
        for i, r in enumerate(model.records)
        if r.start.basis == "full charge"
    ]
    full = float(np.mean(charged)) if charged else 1.0
    soc = np.linspace(*aged_range(cell), 4001)
    ocv = np.maximum.accumulate(cell.rest_voltage_v(soc))
    empty = float(np.interp(cell.lower_voltage_v, ocv, soc))
    n_1, p_1 = cell.stoichiometries(full)
    n_0, p_0 = cell.stoichiometries(empty)
    cell = cell.with_negative(theta_min=n_0, theta_max=n_1).with_positive(theta_min=p_1, theta_max=p_0)
    return replace(model.aged(cell, material, 1.0), nominal_capacity_ah=model.cell.nominal_capacity_ah)


def _all_as_aged(model: Model, x: Array, like: int) -> Array:
    """The working vector with the age of one record in all, and the cycler's zero left in."""
    out = x.copy()
    out[model.layout.zero] = model.zero.nought
    for index in range(len(model.records)):
        out[model.layout.own(index)[1:]] = x[model.layout.own(like)[1:]]
    return out


def _cost(model: Model, x: Array) -> float:
    """Of the records alone, without the priors."""
    return float(sum(np.sum(misfit**2) for misfit in model.misfits(x)))
