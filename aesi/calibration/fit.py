"""Calibrate: one descent from the start file, then what the data determine and what they leave open."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from aesi.calibration.heat import with_heat
from aesi.calibration.model import AGEING_SD, Model
from aesi.calibration.parameters import SPAN_K, Shapes, free_parameters
from aesi.calibration.records import Prepared, prepared, with_temperatures
from aesi.calibration.start import one_branch, sized, with_activation
from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import DataError, FitError
from aesi.numerics.typing import Array
from aesi.physics.balance import aged_range
from aesi.physics.cell import Cell
from aesi.physics.simulation import ModelName
from aesi.records import Measurement

EVALUATIONS = 40
GAIN = 1e-4
BOUND_SHARE = 0.02
VOLTAGE_MARGIN_V = 0.3
NOTED_ZERO = 0.02
"""Of a record's typical current."""
NOTED_AGE = 0.01


@dataclass(frozen=True)
class Interval:
    """A parameter with its 95 % interval, its unit and where its prior is from."""

    value: float
    low: float
    high: float
    unit: str
    source: str


@dataclass(frozen=True)
class RecordError:
    """RMSE of one record's rows, V: as the start file declares the cell, and calibrated."""

    name: str
    temperature_degc: float | None
    before_v: float
    after_v: float


@dataclass(frozen=True)
class Open:
    """A combination of parameters that the data do not determine.

    weights : of the parameters in it, in deviations of their priors.  narrowed : what the data leave of the prior's
    deviation along it (1: nothing was learnt).
    """

    weights: tuple[tuple[str, float], ...]
    narrowed: float

    @property
    def sentence(self) -> str:
        """For a reader."""
        names = " with ".join(f"{name} ({weight:+.2f})" for name, weight in self.weights)
        return f"the data do not determine {names}: {100 * self.narrowed:.0f} % of the prior's width is left"


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated cell, and how sure it is.

    parameters : name -> value with its interval.  undetermined : combinations that the data leave open.
    at_bounds : parameters that ended on a bound.  errors : of each record.  capacities : share of the cell's capacity
    that each record's has.  x, covariance : working vector and its covariance, for the posterior.
    """

    cell: Cell
    declared: Cell
    parameters: Mapping[str, Interval]
    undetermined: tuple[Open, ...]
    at_bounds: tuple[str, ...]
    errors: tuple[RecordError, ...]
    capacities: Mapping[str, float]
    notes: tuple[str, ...]
    seconds: float
    model: Model
    x: Array
    covariance: Array


def calibrate(
    cell: Cell,
    records: Sequence[Measurement],
    *,
    soc0: float | None = None,
    temperatures_degc: Mapping[str, float] | None = None,
    evaluations: int = EVALUATIONS,
    physics: ModelName = "espm",
) -> Calibration:
    """Capacities, stoichiometry windows, potential, diffusion, kinetics, electrolyte and contacts, with temperature.

    records : at least one, of any temperatures: their column, or `temperatures_degc` by name, or the cell file's.
    soc0 : of every record that its voltage does not contradict.  physics : the model that is fitted.
    Raises DataError for records that do not fit a cell; FitError where the start cannot be simulated.
    """
    began = time.perf_counter()
    model, notes = problem(cell, records, soc0, temperatures_degc or {}, physics)
    x = descended(model, evaluations)
    jacobian, errors = model.jacobian(x), model.errors(x)
    weights = np.concatenate([*(information_weights(model, errors)), np.ones(model.layout.size)])
    scaled = jacobian * weights[:, None]
    covariance = np.linalg.inv(scaled.T @ scaled)
    declared = _declared_errors(cell, model)
    rms = [float(np.sqrt(np.mean(e**2))) for e in errors]
    found, warmth = with_heat(rewound(model, x), model.records)
    return Calibration(
        cell=found,
        declared=cell,
        parameters=intervals(model, x, covariance),
        undetermined=undetermined(model, scaled),
        at_bounds=_at_bounds(model, x),
        errors=tuple(
            RecordError(r.name, _degc(r), b, a) for r, b, a in zip(model.records, declared, rms, strict=True)
        ),
        capacities={
            r.name: float(np.exp(AGEING_SD * x[model.layout.age(i)])) / usual_share(model, x)
            for i, r in enumerate(model.records)
        },
        notes=(*notes, *_told(model, x), *warmth),
        seconds=time.perf_counter() - began,
        model=model,
        x=x,
        covariance=covariance,
    )


def problem(
    cell: Cell,
    records: Sequence[Measurement],
    soc0: float | None,
    temperatures_degc: Mapping[str, float],
    physics: ModelName = "espm",
) -> tuple[Model, tuple[str, ...]]:
    """What is fitted, and sentences on how it was set up."""
    if not records:
        raise DataError("give at least one record to calibrate with.")
    for record in records:
        _check_voltage(cell, record)
    start, notes = sized(cell, records)
    kept = [one_branch(start, data) for data in records]
    placed, told = with_temperatures([data for data, _ in kept], temperatures_degc)
    start, typical = with_activation(start)
    ready = prepared(start, placed, soc0, physics)
    for one in ready:
        _check_charge(start, one)
    span = _span_k(start, ready)
    if span <= SPAN_K:
        told = (*told, f"the records span {span:.1f} K: activation energies and entropy stay as they are.")
    model = Model(start, ready, free_parameters(start, span), Shapes.over(start, span), physics)
    starts = tuple(r.start.sentence for r in ready)
    return model, (*notes, *(n for _, more in kept for n in more), *told, *typical, *starts)


def descended(model: Model, evaluations: int, x0: Array | None = None) -> Array:
    """Where bounded least squares ends."""
    x = np.zeros(model.layout.size) if x0 is None else x0
    if not np.isfinite(model.residual(x)).all():
        raise FitError(
            f"{model.cell.name}: the start file cannot be simulated on these records; start from a cell of the same "
            "chemistry."
        )
    found = least_squares(
        model.residual, x, model.jacobian, (model.low, model.high), ftol=GAIN, xtol=1e-5, gtol=1e-8,
        max_nfev=evaluations,
    )  # fmt: skip
    return np.asarray(found.x, dtype=float)


def information_weights(model: Model, errors: Sequence[Array]) -> list[Array]:
    """Factor on each row's weight that makes a record count as many rows as say something of their own.

    What is left after the fit repeats itself: n rows of first autocorrelation rho are n (1 - rho)/(1 + rho).
    """
    out = []
    for record, error, weight in zip(model.records, errors, model.weights, strict=True):
        seen = error[record.trusted]
        rms = max(float(np.sqrt(np.mean(seen**2))), 1e-6)
        centred = seen - seen.mean()
        rho = float(np.dot(centred[1:], centred[:-1]) / max(float(np.dot(centred, centred)), 1e-30))
        share = (1.0 - np.clip(rho, 0.0, 0.999)) / (1.0 + np.clip(rho, 0.0, 0.999))
        out.append(np.sqrt(share) / rms / np.where(weight > 0.0, weight, 1.0))
    return out


def intervals(model: Model, x: Array, covariance: Array) -> dict[str, Interval]:
    """Value and 95 % interval of every global parameter."""
    out = {}
    for j, free in enumerate(model.free):
        reach = 1.96 * float(np.sqrt(covariance[j, j]))
        out[free.name] = Interval(
            free.value(float(x[j])), free.value(float(x[j]) - reach), free.value(float(x[j]) + reach),
            free.unit, free.source,
        )  # fmt: skip
    return out


def undetermined(model: Model, jacobian: Array) -> tuple[Open, ...]:
    """Combinations of global parameters along which the records say less than the priors.

    Eigenvectors of the information of the records on the global parameters, with all others marginalised, in units of
    the priors: an eigenvalue below one is less than the prior's own.
    """
    n = len(model.free)
    information = jacobian.T @ jacobian
    here, rest = information[:n, :n], information[n:, n:]
    marginal = here - information[:n, n:] @ np.linalg.solve(rest, information[n:, :n])
    values, vectors = np.linalg.eigh(marginal - np.eye(n))
    out = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value >= 1.0:
            break
        vector = vector * np.sign(vector[np.argmax(np.abs(vector))])
        heavy = [j for j in np.argsort(-np.abs(vector)) if abs(vector[j]) > 0.3]
        weights = tuple((model.free[j].name, float(vector[j])) for j in heavy)
        out.append(Open(weights, float(1.0 / np.sqrt(1.0 + max(value, 0.0)))))
    return tuple(out)


def _at_bounds(model: Model, x: Array) -> tuple[str, ...]:
    width = BOUND_SHARE * (model.high - model.low)
    return tuple(
        f.name
        for j, f in enumerate(model.free)
        if model.high[j] - x[j] < width[j] or (x[j] - model.low[j] < width[j] and f.low != 0.0)
    )


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


def _declared_errors(cell: Cell, model: Model) -> list[float]:
    """RMSE of the start file as it is, V."""
    x = np.zeros(model.layout.size)
    runs = [model.run(i, cell, x)[0] for i in range(len(model.records))]
    return [
        float(np.sqrt(np.mean((r.rows.voltage_v - v) ** 2))) for r, v in zip(model.records, runs, strict=True)
    ]


def _told(model: Model, x: Array) -> tuple[str, ...]:
    """Sentences on what a record's cycler and its age were found to be."""
    out = []
    zero_a = model.zero_a * float(x[model.layout.zero])
    for i, record in enumerate(model.records):
        typical = float(np.median(np.abs(record.rows.current_a[record.flows > 0.0])))
        if record.slow and abs(zero_a) > NOTED_ZERO * typical:
            out.append(
                f"{record.name}: its charge fits if its current reads {1e3 * abs(zero_a):.2g} mA too "
                f"{'high' if zero_a > 0 else 'low'} ({100 * abs(zero_a) / typical:.1f} % of it); that is taken out."
            )
        share = float(np.exp(AGEING_SD * x[model.layout.age(i)])) - 1.0
        if abs(share) > NOTED_AGE:
            out.append(
                f"{record.name}: fits with {100 * share:+.1f} % of capacity; its cell may be of another age."
            )
    return tuple(out)


def _degc(record: Prepared) -> float | None:
    return None if record.mean_kelvin is None else record.mean_kelvin - ZERO_CELSIUS_K


def _span_k(cell: Cell, records: Sequence[Prepared]) -> float:
    """K between the coldest and the warmest record's mean."""
    means = [cell.initial_temperature_k if r.mean_kelvin is None else r.mean_kelvin for r in records]
    return max(means) - min(means)


def _check_voltage(cell: Cell, data: Measurement) -> None:
    low, high = cell.lower_voltage_v - VOLTAGE_MARGIN_V, cell.upper_voltage_v + VOLTAGE_MARGIN_V
    outside = np.flatnonzero((data.voltage_v < low) | (data.voltage_v > high))
    if len(outside):
        row = int(outside[0])
        raise DataError(
            f"{data.name}: {data.voltage_v[row]:.3f} V at {data.time_s[row]:g} s (row {row}) is outside the range of "
            f"{cell.name} ({cell.lower_voltage_v:g} to {cell.upper_voltage_v:g} V); the data belong to another cell, "
            "or the voltage is not in volts."
        )


SOC_MARGIN = 0.12


def _check_charge(cell: Cell, record: Prepared) -> None:
    rows = record.rows
    mean = (
        rows.current_a[1:] if record.hold == "backward" else 0.5 * (rows.current_a[1:] + rows.current_a[:-1])
    )
    moved_ah = np.concatenate([[0.0], np.cumsum(mean * np.diff(rows.time_s))]) / 3600.0
    soc = record.start.soc - moved_ah / cell.capacity_ah
    wrong = (soc < -SOC_MARGIN) | (soc > 1.0 + SOC_MARGIN)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError(
            f"{record.name}: the charge moved takes the cell to a state of charge of {100 * soc[row]:.0f} % at "
            f"{rows.time_s[row]:g} s, from {100 * record.start.soc:.0f} % at the start and with {cell.capacity_ah:.3g} "
            "Ah; check the cell file, --soc0 and the sign and unit of the current."
        )
