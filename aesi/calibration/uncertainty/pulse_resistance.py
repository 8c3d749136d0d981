"""The resistance that a calibrated file predicts over temperature and state of charge, with intervals.

    R = (V(0) - V(10 s)) / I,    I = 1C, discharge, from rest                             (1)

An interval says what the records leave open: it is of the logarithm of R, by linear propagation of the fit's covariance
and, where the records' temperatures are too close to each other for a fit to move the activation energies, of the
priors of these. It leaves out what the model itself is off by.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from aesi.calibration.parameters import with_parameters
from aesi.calibration.result import NINETY_FIVE, Calibration
from aesi.calibration.written_cell import written_cell
from aesi.errors import AesiError
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.cell.energies import energy_priors
from aesi.physics.simulation import ModelName, simulate

TEMPERATURES_DEGC = (-20.0, -10.0, 0.0, 10.0, 25.0, 40.0)
SOCS = (0.8, 0.5, 0.2)
"""A convention, as the pulse of (1): what data sheets print."""
PULSE_S = (0.0, 1e-3, 2.0, 4.0, 6.0, 8.0, 10.0)
STEP = 1e-2
"""Step of the slopes, in standard deviations of the priors."""


@dataclass(frozen=True, eq=False)
class PulseResistance:
    """Resistance (1) over temperature and state of charge.

    temperature_degc : (m,).  soc : (k,).  ohm, low_ohm, high_ohm : (m, k), value and 95 % interval; NaN where the cell
    cannot be simulated.
    """

    temperature_degc: Array
    soc: Array
    ohm: Array
    low_ohm: Array
    high_ohm: Array


def pulse_resistance(found: Calibration) -> PulseResistance:
    """The resistance (1) of a calibrated cell, with what the records leave open of it."""
    model, x, name = found.model, found.x, found.model.model_name
    at = _log_ohm(written_cell(model, x), name)
    slopes = np.zeros((len(x), *at.shape))
    for j in range(len(model.free)):  # what records have of their own is not in the file
        h = STEP if x[j] + STEP <= model.high[j] else -STEP
        there = x.copy()
        there[j] += h
        slopes[j] = (_log_ohm(written_cell(model, there), name) - at) / h
    variance = np.einsum("iab,ij,jab->ab", slopes, found.covariance, slopes)
    for slope in _energy_slopes(found, at):
        variance = variance + slope**2
    reach, ohm = NINETY_FIVE * np.sqrt(variance), np.exp(_log_ohm(found.cell, name))
    return PulseResistance(
        np.array(TEMPERATURES_DEGC), np.array(SOCS), ohm, ohm * np.exp(-reach), ohm * np.exp(reach)
    )


def _energy_slopes(found: Calibration, at: Array) -> list[Array]:
    """Change of log R by one standard deviation of the prior of each activation energy that the fit did not move."""
    cell = written_cell(found.model, found.x)
    fitted = {free.name for free in found.model.free}
    out = []
    for (part, rate), prior in energy_priors(cell).items():
        key = f"{part}.{rate}_energy"
        if key not in fitted:
            part_of: Mapping[str, float] = {key: _energy(cell, part, rate) + STEP * prior.sd_j_mol}
            out.append((_log_ohm(with_parameters(cell, part_of), found.model.model_name) - at) / STEP)
    return out


def _energy(cell: Cell, part: str, rate: str) -> float:
    return float(getattr(getattr(cell, part), f"{rate}_ea_j_mol"))


def _log_ohm(cell: Cell, model_name: ModelName) -> Array:
    """(m, k) logarithm of (1), ohm."""
    time_s, current_a = np.array(PULSE_S), np.full(len(PULSE_S), cell.capacity_ah)
    current_a[0] = 0.0
    out = np.full((len(TEMPERATURES_DEGC), len(SOCS)), np.nan)
    for a, degc in enumerate(TEMPERATURES_DEGC):
        for b, soc in enumerate(SOCS):
            try:
                run = simulate(
                    cell, time_s, current_a, soc, temperature_degc=degc, hold="backward", model=model_name
                )
            except AesiError:
                continue
            out[a, b] = np.log((run.voltage_v[0] - run.voltage_v[-1]) / cell.capacity_ah)
    return out
