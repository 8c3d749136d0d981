"""Fit the model's own parameters to measurements of the cell: low-rate, pulse and drive data together."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.errors import FitError
from aesi.numerics.coloured import ColouredNoise
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.constants import SECONDS_PER_HOUR
from aesi.physics.effects import CATALOGUE
from aesi.physics.espm import model_with
from aesi.records import Measurement
from aesi.tracer.candidates import Estimate
from aesi.tracer.checks import check_measurement, check_record
from aesi.tracer.fit import Fitter, summarise
from aesi.tracer.knobs import SOC0
from aesi.tracer.ocp_correction import EFFECT as OCP_CORRECTION
from aesi.tracer.problem import Problem
from aesi.tracer.records import Record, prepare_all

MODEL_ERROR_V = 3e-3
"""What a calibrated single-particle model is expected to miss: the weight of a sample."""
OCP_TOLERANCE_V = 0.05
SOC_TOLERANCE = 0.01
"""Of a state of charge from a rest voltage, where the open-circuit potential itself is in doubt; one that was given is
believed."""
BALANCE = ("active_material_loss_negative", "active_material_loss_positive", "lithium_inventory_loss")
RESISTANCE = "series_resistance"
RATES = ("solid_diffusivity", "charge_transfer_kinetics", "electrolyte_transport", RESISTANCE)
TYPICAL_SOLID_EA_J_MOL = 30e3
TYPICAL_RATE_EA_J_MOL = 35e3
TYPICAL_ELECTROLYTE_EA_J_MOL = 17.1e3
"""Where the file declares none: a cell answers to temperature, and data at one temperature cannot say how much.
Diffusion and rates as in the parametrisation of O'Regan et al., Electrochim. Acta 425 (2022) 140700, rounded; the
electrolyte as in the BPX example cell."""
STEPS = 10
STARTS = 3
SPREAD = 0.35
"""Random starts move each rate by this many e-folds."""
FULL_WINDOW_V = 0.15
LOOSE_SHARE = 0.5
"""A combination whose uncertainty is more than this share of the admissible range is called undetermined."""


@dataclass(frozen=True)
class FileError:
    """RMSE of one measurement before and after, V."""

    name: str
    before_v: float
    after_v: float


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated cell.

    parameters : effect.parameter -> what it was moved by, with its interval.  undetermined : one sentence for each
    combination that the data leave open.  at_bounds : parameters that ended on a bound.
    """

    cell: Cell
    declared: Cell
    parameters: dict[str, Estimate]
    undetermined: tuple[str, ...]
    at_bounds: tuple[str, ...]
    files: tuple[FileError, ...]
    notes: tuple[str, ...]
    seconds: float


def calibrate(
    cell: Cell, measurements: Sequence[Measurement], *, soc0: float | None = None, seed: int = 0
) -> Calibration:
    """Capacities, stoichiometry windows, open-circuit potential, diffusivities, rates, electrolyte and resistance.

    measurements : at least one; a slow full discharge fixes capacity and potential, pulses and drives the rest.
    soc0 : of every record that does not say otherwise by its rest voltage.
    Raises DataError for data that do not fit a cell; FitError where nothing can be simulated.
    """
    began = time.perf_counter()
    for data in measurements:
        check_measurement(cell, data)
    start, notes = sized(cell, measurements)
    start, more = with_activation(start)
    notes = (*notes, *more)
    records = tuple(with_model_error(r) for r in prepare_all(start, measurements, soc0, 0.0))
    for record in records:
        check_record(start, record)
    effects = {OCP_CORRECTION.id: OCP_CORRECTION} | {n: CATALOGUE[n] for n in (*BALANCE, *RATES)}
    problem = Problem(start, records, effects, tolerances={OCP_CORRECTION.id: OCP_TOLERANCE_V})
    fitter = Fitter(problem, (*BALANCE, *RATES))
    noise = [ColouredNoise(MODEL_ERROR_V, 1e-9, 100.0)] * len(records)
    x = _best(fitter, noise, np.random.default_rng(seed))
    residual = fitter.residual(x)
    jacobian = None if residual is None else fitter.jacobian(x, residual)
    if residual is None or jacobian is None:
        raise FitError(
            f"{cell.name}: the fit left what can be simulated; start from a cell of the same chemistry."
        )
    fit = summarise(fitter, x, residual, jacobian, noise)
    values = {owner: given for owner, given in fit.values.items() if owner != SOC0}
    inflation = float(np.sqrt(np.mean(residual**2))) / MODEL_ERROR_V
    parameters = {}
    for index, knob in enumerate(fit.knobs):
        if knob.owner in RATES + BALANCE:
            low, high = fit.interval(index, 1.96 * max(inflation, 1.0) * _redundancy(residual))
            parameters[f"{knob.owner}.{knob.name}"] = Estimate(
                knob.to_value(float(x[index])), low, high, knob.unit
            )
    rms = [float(np.sqrt(np.mean(residual[rows] ** 2))) for rows in problem.slices]
    old = [_declared_error_v(cell, problem, record) for record in records]
    return Calibration(
        cell=settled(problem, values),
        declared=cell,
        parameters=parameters,
        undetermined=_undetermined(fitter, fit.jacobian),
        at_bounds=fit.at_bounds,
        files=tuple(FileError(r.name, b, a) for r, b, a in zip(records, old, rms, strict=True)),
        notes=(*notes, *(n for r in records for n in r.notes)),
        seconds=time.perf_counter() - began,
    )


def sized(cell: Cell, measurements: Sequence[Measurement]) -> tuple[Cell, tuple[str, ...]]:
    """The cell with its area scaled to the charge of a full discharge among the measurements, if there is one."""
    charges = [_full_discharge_ah(cell, m) for m in measurements]
    known = max((q for q in charges if q is not None), default=None)
    if known is None:
        return cell, (
            f"no full discharge among the data: the capacity of {cell.capacity_ah:.3g} Ah is believed.",
        )
    factor = known / cell.capacity_ah
    note = f"capacity {known:.3f} Ah by a full discharge, {cell.capacity_ah:.3f} Ah declared"
    scaled = replace(cell, electrode_area_m2=cell.electrode_area_m2 * factor, nominal_capacity_ah=known)
    return scaled, (f"{note}; the electrode area is scaled by {factor:.3f}.",)


def with_activation(cell: Cell) -> tuple[Cell, tuple[str, ...]]:
    """The cell with typical activation energies where it declares none, and a sentence that names them."""
    filled = []
    changed = cell
    for side, electrode in (("negative", cell.negative), ("positive", cell.positive)):
        changes = {}
        if not electrode.diffusivity_ea_j_mol:
            changes["diffusivity_ea_j_mol"] = TYPICAL_SOLID_EA_J_MOL
        if not electrode.rate_ea_j_mol:
            changes["rate_ea_j_mol"] = TYPICAL_RATE_EA_J_MOL
        if changes:
            with_side = changed.with_negative if side == "negative" else changed.with_positive
            changed = with_side(**changes)
            filled += [
                f"{side} {name.removesuffix('_ea_j_mol')} {v / 1e3:g} kJ/mol" for name, v in changes.items()
            ]
    electrolyte = {
        name: TYPICAL_ELECTROLYTE_EA_J_MOL
        for name in ("conductivity_ea_j_mol", "diffusivity_ea_j_mol")
        if not getattr(cell.electrolyte, name)
    }
    if electrolyte:
        changed = changed.with_electrolyte(**electrolyte)
        filled += [
            f"electrolyte {n.removesuffix('_ea_j_mol')} {v / 1e3:g} kJ/mol" for n, v in electrolyte.items()
        ]
    if not filled:
        return cell, ()
    return changed, (
        f"no activation energy is declared for these, typical ones are taken: {', '.join(filled)}.",
    )


def _full_discharge_ah(cell: Cell, data: Measurement) -> float | None:
    """Charge from full to empty, or None where the record does not go from one to the other."""
    if data.voltage_v[0] < cell.upper_voltage_v - FULL_WINDOW_V:
        return None
    end = int(np.argmin(data.voltage_v))
    if data.voltage_v[end] > cell.lower_voltage_v + 2 * FULL_WINDOW_V:
        return None
    steps = data.current_a[1 : end + 1] * np.diff(data.time_s[: end + 1])
    return float(steps.sum()) / SECONDS_PER_HOUR


def with_model_error(record: Record) -> Record:
    """The record as a fit of the model's own parameters sees it: no surer than the model is, nor of a state of charge
    that the potential in doubt gave."""
    soc0_sd = record.soc0_sd if record.soc0_given else max(record.soc0_sd, SOC_TOLERANCE)
    return replace(record, noise_v=max(record.noise_v, MODEL_ERROR_V), soc0_sd=soc0_sd)


def _best(fitter: Fitter, noise: list[ColouredNoise], rng: np.random.Generator) -> Array:
    """The best of several descents: balance and potential first, then everything."""
    first = np.zeros(len(fitter.knobs))
    rates = np.array([k.owner in RATES for k in fitter.knobs])
    best: tuple[float, Array] | None = None
    for attempt in range(STARTS):
        x = first.copy()
        if attempt:
            x[rates] += (
                rng.normal(0.0, SPREAD, int(rates.sum()))
                / np.array([k.scale for k in fitter.knobs if k.owner in RATES])
                * np.array([1.0 if k.log else 0.0 for k in fitter.knobs if k.owner in RATES])
            )
        x = np.clip(x, fitter.low, fitter.high)
        x = fitter.descend(x, noise, STEPS if attempt == 0 else STEPS // 2)
        e = fitter.residual(x)
        if e is None:
            continue
        cost = float(np.sum(e**2)) / MODEL_ERROR_V**2 + float(np.sum((fitter.prior * x) ** 2))
        if best is None or cost < best[0]:
            best = cost, x
            first = np.where(rates, first, x)
    if best is None:
        raise FitError(
            "no start of the calibration can be simulated; start from a cell of the same chemistry."
        )
    return fitter.descend(best[1], noise, STEPS)


def _declared_error_v(cell: Cell, problem: Problem, record: Record) -> float:
    """RMSE of the cell as the file declares it, V."""
    run = replace(problem, cell=cell).run(record.thin, record.soc0, (), record.thin_hold)
    return float(np.sqrt(np.mean((record.thin.voltage_v - run.voltage_v) ** 2)))


def _redundancy(residual: Array) -> float:
    """Square root of how many samples repeat what one says, from the residual's first autocorrelation."""
    centred = residual - residual.mean()
    rho = float(np.dot(centred[1:], centred[:-1]) / max(np.dot(centred, centred), 1e-30))
    rho = float(np.clip(rho, 0.0, 0.999))
    return float(np.sqrt((1.0 + rho) / (1.0 - rho)))


def settled(problem: Problem, values: Mapping[str, Mapping[str, float]]) -> Cell:
    """One cell that says what the problem's cell and its own parameters said: a BPX file needs no effects."""
    resistance = values.get(RESISTANCE, {}).get("resistance_ohm", 0.0)
    others = {owner: given for owner, given in values.items() if owner != RESISTANCE}
    cell = model_with(problem.cell, replace(problem, fixed=()).active(others)).cell
    return replace(cell, contact_resistance_ohm=cell.contact_resistance_ohm + resistance)


def _undetermined(fitter: Fitter, jacobian: Array) -> tuple[str, ...]:
    """Directions of the free parameters along which the data hardly curve, from the singular vectors."""
    free = np.flatnonzero(fitter.prior == 0)
    if not len(free):
        return ()
    width = (fitter.high - fitter.low)[free]
    _, sizes, vectors = np.linalg.svd(jacobian[:, free] * width / MODEL_ERROR_V, full_matrices=False)
    sentences = []
    for size, vector in zip(sizes, vectors, strict=True):
        uncertainty = 1.0 / max(float(size), 1e-12)
        if uncertainty < LOOSE_SHARE / np.sqrt(12.0):
            continue
        heavy = [j for j in np.argsort(-np.abs(vector)) if abs(vector[j]) > 0.3]
        names = [f"{fitter.knobs[free[j]].owner}.{fitter.knobs[free[j]].name}" for j in heavy]
        sentences.append(f"the data do not determine {' with '.join(names)}")
    return tuple(sentences)
