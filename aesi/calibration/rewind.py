"""The cell that is written: full and empty where the records show them, and aged as a typical record's."""

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
    return _as_aged(model, x, *_usual(model, x))


def capacities(model: Model, x: Array) -> dict[str, float]:
    """Record -> share of the written cell's capacity that the cell had then."""
    usual_ah = rewound(model, x).capacity_ah
    return {
        r.name: _as_aged(model, x, model.material(i, x), model.silicon(i, x)).capacity_ah / usual_ah
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


def _usual(model: Model, x: Array) -> tuple[float, float]:
    """Shares of active material and silicon of the records near the reference temperature.

    A slow discharge gives more than a drive of the same cell does, and drives are what a file is used for: the mean of
    the logarithms by rows.
    """
    logs, rows = [], []
    for i, record in enumerate(model.records):
        kelvin = model.cell.initial_temperature_k if record.mean_kelvin is None else record.mean_kelvin
        if abs(kelvin - model.cell.reference_temperature_k) <= SPAN_K:
            logs.append(np.log([model.material(i, x), model.silicon(i, x)]))
            rows.append(float(record.trusted.sum()))
    if not logs:
        return 1.0, 1.0
    material, silicon = np.exp(np.average(logs, axis=0, weights=rows))
    return float(material), float(silicon)
