"""The cell that is written: full and empty where the records show them, and the capacity of a typical record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.calibration.model import AGEING_SD, Model
from aesi.calibration.shapes import SPAN_K
from aesi.numerics.typing import Array
from aesi.physics.balance import aged_range
from aesi.physics.cell import Cell


def rewound(model: Model, x: Array) -> Cell:
    """The cell with full where its charged records started, and empty where it rests at its lower voltage."""
    cell = model.cell_at(x)
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
    share = usual_share(model, x)
    cell = cell.with_negative(c_max_mol_m3=cell.negative.c_max_mol_m3 * share)
    cell = cell.with_positive(c_max_mol_m3=cell.positive.c_max_mol_m3 * share)
    return replace(cell, nominal_capacity_ah=model.cell.nominal_capacity_ah)


def usual_share(model: Model, x: Array) -> float:
    """Capacity of the records near the reference temperature over the largest of any: that of the file.

    A slow discharge gives more than a drive of the same cell does, and drives are what a file is used for: the mean of
    the logarithms by rows.
    """
    logs, rows = [], []
    for i, record in enumerate(model.records):
        kelvin = model.cell.initial_temperature_k if record.mean_kelvin is None else record.mean_kelvin
        if abs(kelvin - model.cell.reference_temperature_k) <= SPAN_K:
            logs.append(AGEING_SD * float(x[model.layout.age(i)]))
            rows.append(float(record.trusted.sum()))
    return float(np.exp(np.average(logs, weights=rows))) if logs else 1.0
