"""Heat capacity and conductance of a cell, from the temperature measured on its case.

    C dT/dt = Q - (T - T_case)/R,   (T - T_case)/R = G (T_case - T_amb)
    Q = I (U - V) - I T dU/dT        I > 0 on discharge; V as measured, U of the fit in its mean state

The heat capacity of the case is left out. R is that of the calibrated cell (`Cell.winding_resistance_k_w`). Each record
has surroundings of its own, within `AMBIENT_SD_K` of the cell's first temperature. A temperature is used only where the
losses explain it: one that a chamber or a noisy sensor changes is followed as well without them.

Source: Bernardi, Pawlikowski & Newman, J. Electrochem. Soc. 132 (1985) 5, doi:10.1149/1.2113792.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from aesi.calibration.model import Model
from aesi.calibration.written_cell import cell_in_record
from aesi.data.thinning import Averaged
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.effects.self_heating import PARAMETERS

LEAST_CHANGE_K = 2.0
"""Least range of the temperatures of a record that is used, K."""
LOSSES_LEAVE = 0.5**0.5
"""Largest ratio of the RMS error with losses to that with the surroundings alone: the losses then explain half of the
variance. A convention. The Panasonic's and the HG2's records with their files: 0.49 to 0.67 of five and 0.15 to 0.29 of
two, 0.47 of the five together. Own records of the Panasonic's file in a chamber that goes 15 to 25 K up or down at
C/10, at rest after C/3 or before C/2.5, or swings by 4 K at C/20, or with 1 K of noise: 0.77 to 1.08."""
AMBIENT_SD_K = 5.0
"""Standard deviation of the surroundings' temperature about the first temperature of the cell, K; each record counts as
one reading. It is wide: with a tenth of it the measured temperatures (LG HG2, Panasonic) are missed by 0.15 and 0.32 K
instead of 0.12 and 0.31."""
SURROUNDINGS_UNIT = 0.1
"""Unit of the surroundings in the descent, as a share of their standard deviation: half a kelvin."""
READING_K = 0.3
"""Standard deviation of a thermocouple, K."""
TYPICAL_W_K = 0.1
"""Start of the fit: a small cylindrical cell in still air."""


@dataclass(frozen=True, eq=False)
class CaseRecord:
    """A record with a temperature of the case.

    time_s, kelvin : (rows,) s and K, as measured.  watts : (rows,) W that the cell released by the fit.
    """

    name: str
    time_s: Array
    kelvin: Array
    watts: Array


@dataclass(frozen=True)
class HeatFit:
    """Fitted heat capacity (J/K), conductance from case to surroundings (W/K), and RMS error of the temperatures (K) of
    the records, by name, that were used."""

    heat_capacity_j_k: float
    conductance_w_k: float
    rmse_k: float
    records: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """The fit as a sentence."""
        return (
            f"heat: a heat capacity of {self.heat_capacity_j_k:.3g} J/K and a conductance from case to surroundings of "
            f"{self.conductance_w_k:.3g} W/K reproduce the measured temperature of {', '.join(self.records)} within "
            f"{self.rmse_k:.2f} K RMS; they are in the file."
        )

    def by(self, cell: Cell, records: Sequence[CaseRecord]) -> HeatFit:
        """The same thermal data with the error that they leave where the cell and what it released are others, as of
        the end of a fit."""
        used = [one for one in records if one.name in self.records]
        return fit_heat(cell, used, self.heat_capacity_j_k, conductance_w_k=self.conductance_w_k)


def case_records(model: Model, x: Array) -> tuple[CaseRecord, ...]:
    """The records of a fit that have a temperature, at a working vector."""
    return tuple(
        CaseRecord(record.name, record.rows.time_s, record.kelvin, _heat_w(model, x, index, record.kelvin))
        for index, record in enumerate(model.records)
        if record.kelvin is not None
    )


def with_fitted_heat(
    cell: Cell, records: Sequence[CaseRecord]
) -> tuple[Cell, HeatFit | None, tuple[str, ...]]:
    """(cell with its thermal data fitted, the fit, sentences on what was not used). The same cell object and no fit are
    returned where no record determines the heat, or where the file lacks thermal data; a sentence then says so."""
    warming = [r for r in records if float(np.ptp(r.kelvin)) > LEAST_CHANGE_K]
    declared, lacks = cell.heat_capacity_j_k, _lacking(cell)
    if not warming:
        stays = f"the start file has no {lacks}" if lacks else "they stay as in the start file"
        sentence = (
            f"heat: no record has a measured temperature that changes by more than {LEAST_CHANGE_K:g} K, so that heat "
            f"capacity and cooling are not fitted; {stays}."
        )
        return cell, None, (sentence,)
    if declared is None or cell.specific_heat_j_kg_k is None or lacks:
        sentence = (
            f"heat: the start file has no {lacks}, so that the temperature of {', '.join(r.name for r in warming)} "
            "tells no heat capacity and no cooling."
        )
        return cell, None, (sentence,)
    explained = (
        warming if _losses_explain(cell, warming) else [r for r in warming if _losses_explain(cell, [r])]
    )
    unexplained = [r.name for r in warming if r not in explained]
    notes = (
        (
            f"heat: the losses of the cell do not explain the temperature of {', '.join(unexplained)}; it is not used.",
        )
        if unexplained
        else ()
    )
    if not explained:
        return cell, None, notes
    fit = fit_heat(cell, explained, declared)
    specific = cell.specific_heat_j_kg_k * fit.heat_capacity_j_k / declared
    changed = replace(_with_conductance(cell, fit.conductance_w_k), specific_heat_j_kg_k=specific)
    return changed, fit, notes


def _lacking(cell: Cell) -> str:
    """The fields of the cell's file without which no heat can be fitted, in words; '' where it has all."""
    fields = {
        "'Density [kg.m-3]'": cell.density_kg_m3,
        "'Specific heat capacity [J.K-1.kg-1]'": cell.specific_heat_j_kg_k,
        "'Volume [m3]'": cell.volume_m3,
        "'External surface area [m2]'": cell.surface_area_m2,
    }
    return " and no ".join(name for name, value in fields.items() if value is None)


def _losses_explain(cell: Cell, records: Sequence[CaseRecord]) -> bool:
    """True where the losses explain the temperatures and the surroundings alone do not, with plausible thermal data."""
    declared = cell.heat_capacity_j_k
    assert declared is not None
    fit, by_surroundings = (fit_heat(cell, records, declared, losses=losses) for losses in (True, False))
    if not fit.rmse_k <= LOSSES_LEAVE * by_surroundings.rmse_k:
        return False
    (least_w_k, most_w_k), (least_factor, most_factor) = (
        PARAMETERS[name].bounds for name in ("heat_transfer_w_k", "heat_capacity_factor")
    )
    return (
        least_w_k <= fit.conductance_w_k <= most_w_k
        and least_factor <= fit.heat_capacity_j_k / declared <= most_factor
    )


def fit_heat(
    cell: Cell,
    records: Sequence[CaseRecord],
    start_j_k: float,
    *,
    losses: bool = True,
    conductance_w_k: float | None = None,
) -> HeatFit:
    """Least-squares fit to all records. Each record counts as one reading, since its errors are correlated.

    start_j_k : heat capacity at the start, J/K.  losses : False for a cell that releases no heat and only follows its
    surroundings.  conductance_w_k : W/K, with which both thermal values are known and the surroundings alone are
    fitted; None fits all.
    """
    driven = [(r, r.watts if losses else np.zeros_like(r.watts)) for r in records]
    known = np.zeros(0 if conductance_w_k is None else 2)
    start_w_k = TYPICAL_W_K if conductance_w_k is None else conductance_w_k

    def residual(fitted: Array) -> Array:
        # The logarithms of both thermal values, then the surroundings of each record.
        z = np.concatenate([known, fitted])
        capacity, conductance = start_j_k * np.exp(z[0]), start_w_k * np.exp(z[1])
        through = _with_conductance(cell, conductance).conductance_w_k
        assert through is not None
        share = through / conductance
        parts = []
        for (record, watts), shift in zip(driven, z[2:], strict=True):
            ambient = record.kelvin[0] + SURROUNDINGS_UNIT * AMBIENT_SD_K * shift
            winding = temperature_k(record.time_s, watts, record.kelvin[0], ambient, capacity, through)
            case_k = ambient + share * (winding - ambient)
            parts.append((case_k - record.kelvin) / READING_K / len(case_k) ** 0.5)
        return np.concatenate([*parts, SURROUNDINGS_UNIT * z[2:]])

    found = least_squares(residual, np.zeros(2 + len(driven) - len(known)), loss="soft_l1").x
    rows = sum(len(watts) for _, watts in driven)
    errors, z = residual(found)[:rows], np.concatenate([known, found])
    counts = np.concatenate([np.full(len(w), len(w) ** 0.5) for _, w in driven])
    rmse = rms(errors * counts * READING_K)
    return HeatFit(
        float(start_j_k * np.exp(z[0])),
        float(start_w_k * np.exp(z[1])),
        rmse,
        tuple(r.name for r, _ in driven),
    )


def _with_conductance(cell: Cell, conductance_w_k: float) -> Cell:
    """The cell with this conductance from its case to the surroundings, W/K; it has a surface."""
    assert cell.surface_area_m2 is not None
    return replace(cell, heat_transfer_w_m2_k=conductance_w_k / cell.surface_area_m2)


def _heat_w(model: Model, x: Array, index: int, kelvin: Array) -> Array:
    """(rows,) W released by the cell in a record: from the voltage as measured and the open-circuit voltage of the mean
    state that the fit has it in, which may be far from what the start file reads.

    kelvin : (rows,) K, of the case.
    """
    cell = cell_in_record(model, x, index)
    (empty_n, full_n) = cell.balance.window_n
    mean_n = model.run(index, model.cell_at(x), x).mean_n
    # Errors of start and capacity may take the charge beyond full or empty, where the potential of the limit is used.
    soc = np.clip((mean_n - empty_n) / (full_n - empty_n), 0.0, 1.0)
    theta_n, theta_p = cell.balance.stoichiometries(soc)
    entropic = cell.positive.entropic(np.asarray(theta_p)) - cell.negative.entropic(np.asarray(theta_n))
    open_circuit = cell.rest_voltage_v(soc) + (kelvin - cell.reference_temperature_k) * entropic
    rows, current_a = model.records[index].rows, model.current_a(index, x)
    # Current and voltage swing against each other within a row of a drive: the product of their averages lacks losses.
    electric_w = rows.power_w if isinstance(rows, Averaged) else rows.current_a * rows.voltage_v
    delivered_w = electric_w + (current_a - rows.current_a) * rows.voltage_v
    return current_a * (open_circuit - kelvin * entropic) - delivered_w


def temperature_k(
    time_s: Array, watts: Array, start_k: float, ambient_k: float, capacity_j_k: float, conductance_w_k: float
) -> Array:
    """(n,) K of one lump, exact for heat that is constant since the row before.

    watts : (n,) W released.  start_k, ambient_k : of the lump at the first row, and of its surroundings, K.
    """
    out = np.empty_like(time_s)
    out[0] = start_k
    decay = np.exp(-conductance_w_k / capacity_j_k * np.diff(time_s))
    settled = ambient_k + watts[1:] / conductance_w_k
    for k in range(len(decay)):
        out[k + 1] = settled[k] + (out[k] - settled[k]) * decay[k]
    return out
