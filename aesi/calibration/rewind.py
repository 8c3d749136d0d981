"""The cell that is written: full and empty where the records show them, and as little aged as in the freshest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.calibration.model import Model
from aesi.calibration.shapes import SPAN_K
from aesi.numerics.typing import Array
from aesi.physics.balance import aged_range
from aesi.physics.cell import Cell


def rewound(model: Model, x: Array) -> Cell:
    """The cell with full where its charged records started, and empty where it rests at its lower voltage."""
    return _as_aged(model, x, *_freshest(model, x))


def capacities(model: Model, x: Array) -> dict[str, float]:
    """Record -> share of the written cell's capacity that the cell had then."""
    written_ah = rewound(model, x).capacity_ah
    return {
        r.name: _as_aged(model, x, model.material(i, x), model.silicon(i, x)).capacity_ah / written_ah
        for i, r in enumerate(model.records)
    }


def _as_aged(model: Model, x: Array, material: float, silicon: float) -> Cell:
    """`rewound`, with these shares of active material and silicon left."""
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


def _freshest(model: Model, x: Array) -> tuple[float, float]:
    """Shares of active material and silicon of the record near the reference temperature that has most capacity.

    A file is that of a cell before the tests aged it; what a record has less is its share in `capacities`.
    """
    cell = model.cell
    near = [
        (model.material(i, x), model.silicon(i, x))
        for i, r in enumerate(model.records)
        if abs((r.mean_kelvin or cell.initial_temperature_k) - cell.reference_temperature_k) <= SPAN_K
    ]
    return max(near, key=lambda shares: _as_aged(model, x, *shares).capacity_ah, default=(1.0, 1.0))
