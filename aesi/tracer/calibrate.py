"""Fit the model's own parameters to measurements of the cell: low-rate, pulse and drive data together."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.errors import FitError
from aesi.numerics.typing import Array
from aesi.physics.balance import aged_range, same_rest
from aesi.physics.cell import Cell
from aesi.physics.effects import CATALOGUE
from aesi.physics.simulation import model_with
from aesi.records import Measurement
from aesi.tracer.candidate_effects import Estimate
from aesi.tracer.cell_start import one_branch, sized, with_activation
from aesi.tracer.checks import check_measurement, check_record
from aesi.tracer.cycler_zero import OFFSET, ZERO, ZERO_ERROR, zero_noted
from aesi.tracer.fit import Fitter, summarise
from aesi.tracer.knobs import SOC0
from aesi.tracer.ocp_correction import correction
from aesi.tracer.problem import Problem
from aesi.tracer.records import Record, prepare_all

MODEL_ERROR_V = 3e-3
"""What a calibrated single-particle model is expected to miss: the weight of a sample."""
_PLACES = np.linspace(1.0, 0.0, 23)
OCP_CORRECTION = correction((_PLACES - 0.7 * np.sin(2.0 * np.pi * _PLACES) / (2.0 * np.pi)).tolist())
"""Its knots are denser at both ends, where a potential bends most."""
OCP_TOLERANCE_V = 0.05
SOC_TOLERANCE = 0.01
"""Of a state of charge from a rest voltage, where the open-circuit potential itself is in doubt; one that was given is
believed."""
BALANCE = ("active_material_loss_negative", "active_material_loss_positive", "lithium_inventory_loss")
RESISTANCE = "series_resistance"
RATES = ("solid_diffusivity", "charge_transfer_kinetics", "electrolyte_transport", RESISTANCE)
OWN = (*BALANCE, *RATES)
STEPS = 4
ROUNDS = 20
ENOUGH = 0.003
"""A round of steps that gains less than this share of what is left is the last."""
OUTLIER_V = 0.015
"""Beyond this an error counts by its size and no longer by its square: start parameters that run a record empty, a
pulse near the end of a discharge, or a row in the middle of a step must not outweigh all the rest."""
STARTS = 3
SPREAD = 0.35
"""Random starts move each rate by this many e-folds."""
CHARGED_V = 0.03
"""A record that starts this close below the upper voltage starts from a full charge."""
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
    kept = [one_branch(start, data) for data in measurements]
    measurements = [data for data, _ in kept]
    notes = (*notes, *(note for _, more in kept for note in more))
    start, more = with_activation(start)
    notes = (*notes, *more)
    records = tuple(with_model_error(r) for r in prepare_all(start, measurements, soc0, 0.0))
    for record in records:
        check_record(start, record)
    effects = {OCP_CORRECTION.id: OCP_CORRECTION} | {n: CATALOGUE[n] for n in OWN}
    problem = Problem(
        start,
        records,
        effects,
        tolerances={OCP_CORRECTION.id: OCP_TOLERANCE_V},
        model_error_v=MODEL_ERROR_V,
        outlier_v=OUTLIER_V,
        zero_sd_a=zero_sd_a(records),
    )
    fitter = Fitter(problem, OWN)
    x = _best(fitter, np.random.default_rng(seed))
    residual = fitter.residual(x)
    jacobian = None if residual is None else fitter.jacobian(x, residual)
    if residual is None or jacobian is None:
        raise FitError(
            f"{cell.name}: the fit left what can be simulated; start from a cell of the same chemistry."
        )
    fit = summarise(fitter, x, residual, jacobian, fitter.white(residual))
    values = {owner: given for owner, given in fit.values.items() if owner not in (SOC0, ZERO.id)}
    found = _rewound(problem, settled(problem, values), fit.values[SOC0])
    if start.nominal_capacity_ah != cell.nominal_capacity_ah:
        found = replace(found, nominal_capacity_ah=found.capacity_ah)
    leniency = problem.leniency(residual)
    counted = leniency * residual
    inflation = float(np.sqrt(np.mean(counted**2))) / MODEL_ERROR_V
    parameters = {}
    for index, knob in enumerate(fit.knobs):
        if knob.owner in OWN:
            low, high = fit.interval(index, 1.96 * max(inflation, 1.0) * _redundancy(counted))
            parameters[f"{knob.owner}.{knob.name}"] = Estimate(
                knob.to_value(float(x[index])), low, high, knob.unit
            )
    rms = [float(np.sqrt(np.mean(residual[rows] ** 2))) for rows in problem.slices]
    old = [_declared_error_v(cell, problem, record) for record in records]
    return Calibration(
        cell=found,
        declared=cell,
        parameters=parameters,
        undetermined=_undetermined(fitter, leniency[:, None] * jacobian),
        at_bounds=fit.at_bounds,
        files=tuple(FileError(r.name, b, a) for r, b, a in zip(records, old, rms, strict=True)),
        notes=(
            *notes,
            *(n for r in records for n in r.notes),
            *zero_noted(start, records, fit.values[ZERO.id][OFFSET]),
        ),
        seconds=time.perf_counter() - began,
    )


def with_model_error(record: Record) -> Record:
    """The record as a fit of the model's own parameters sees it: no surer than the model is, nor of a state of charge
    that the potential in doubt gave."""
    soc0_sd = record.soc0_sd if record.soc0_given else max(record.soc0_sd, SOC_TOLERANCE)
    return replace(record, noise_v=max(record.noise_v, MODEL_ERROR_V), soc0_sd=soc0_sd)


def zero_sd_a(records: Sequence[Record]) -> float:
    """What the zero of the currents is uncertain by, A."""
    return ZERO_ERROR * max(float(np.max(np.abs(r.data.current_a))) for r in records)


def _best(fitter: Fitter, rng: np.random.Generator) -> Array:
    """Where the best of several descents ended."""
    first = np.zeros(len(fitter.knobs))
    rates = np.array([k.owner in RATES for k in fitter.knobs])
    reach = np.array([SPREAD / k.scale if k.log and k.owner in RATES else 0.0 for k in fitter.knobs])
    best: tuple[float, Array] | None = None
    for attempt in range(STARTS):
        moved = first + (reach * rng.normal(size=len(reach)) if attempt else 0.0)
        cost, x = _descended(fitter, np.clip(moved, fitter.low, fitter.high))
        if np.isfinite(cost) and (best is None or cost < best[0]):
            best = cost, x
            first = np.where(rates, first, x)
        if 2.0 * cost < len(fitter.measured):
            break  # what is left is what the model is expected to miss
    if best is None:
        raise FitError(
            "no start of the calibration can be simulated; start from a cell of the same chemistry."
        )
    return best[1]


def _descended(fitter: Fitter, x: Array) -> tuple[float, Array]:
    """Cost and place after as many rounds of a few steps as gain something."""
    noise = fitter.white(fitter.measured)
    best = fitter.cost(x, noise)
    for _ in range(ROUNDS):
        x = fitter.descend(x, noise, STEPS)
        cost = fitter.cost(x, noise)
        if not best - cost > ENOUGH * cost:
            return min(cost, best), x
        best = cost
    return best, x


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


def _rewound(problem: Problem, cell: Cell, soc0: Mapping[str, float]) -> Cell:
    """The cell with full where its charged records rested, and empty at the rest voltage declared for it.

    A potential and a scale of the charge that moved with it leave no state of charge where it was.
    """
    charged = [
        same_rest(problem.cell, cell, soc0[str(i)])
        for i, record in enumerate(problem.records)
        if record.data.voltage_v[0] > cell.upper_voltage_v - CHARGED_V and not record.soc0_given
    ]
    declared = problem.cell.rest_voltage_v(np.array([0.0, 1.0]))
    full = float(np.mean(charged)) if charged else _state_at(cell, float(declared[1]))
    n_1, p_1 = cell.stoichiometries(full)
    n_0, p_0 = cell.stoichiometries(_state_at(cell, float(declared[0])))
    cell = cell.with_negative(theta_min=n_0, theta_max=n_1).with_positive(theta_min=p_1, theta_max=p_0)
    return cell


def _state_at(cell: Cell, voltage_v: float) -> float:
    """State of charge, by the cell's present windows, at which it rests at a voltage, or the nearer end."""
    soc = np.linspace(*aged_range(cell), 2001)
    return float(np.interp(voltage_v, np.maximum.accumulate(cell.rest_voltage_v(soc)), soc))


def _undetermined(fitter: Fitter, jacobian: Array) -> tuple[str, ...]:
    """Directions of the free parameters along which the data hardly curve, from the singular vectors."""
    free = np.flatnonzero(fitter.prior == 0)
    if not len(free):
        return ()
    width = (fitter.high - fitter.low)[free]
    _, sizes, vectors = np.linalg.svd(jacobian[:, free] * width / MODEL_ERROR_V, full_matrices=False)
    sentences: dict[frozenset[str], str] = {}
    for size, vector in zip(sizes, vectors, strict=True):
        uncertainty = 1.0 / max(float(size), 1e-12)
        if uncertainty < LOOSE_SHARE / np.sqrt(12.0):
            continue
        heavy = [j for j in np.argsort(-np.abs(vector)) if abs(vector[j]) > 0.3]
        names = [f"{fitter.knobs[free[j]].owner}.{fitter.knobs[free[j]].name}" for j in heavy]
        sentences.setdefault(frozenset(names), f"the data do not determine {' with '.join(names)}")
    return tuple(sentences.values())
