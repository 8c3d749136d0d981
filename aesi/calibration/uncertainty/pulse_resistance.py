"""The resistance that a calibrated file predicts over temperature and charge, with what the records leave open of it.

    R = (V(0) - V(10 s)) / I        I of 1C, of the nominal capacity, a discharge from rest                (1)

An interval is of the logarithm of R. Its variance is that of the parameters, by linear propagation of the fit's
covariance and, where the records' temperatures are too close together for a fit to move activation energies, of the
priors of these; and that of the model, the mean square of what it is off by at the pulses (1) within the fitted
records. Without such pulses it leaves out what the model is off by.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby

import numpy as np

from aesi.calibration.parameters import with_parameters
from aesi.calibration.records.prepared import Prepared, kelvin_taken
from aesi.calibration.result import NINETY_FIVE, Calibration
from aesi.calibration.uncertainty.propagated import STEP, propagated_variance
from aesi.calibration.written_cell import written_cell
from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, Numbers
from aesi.physics.cell import Cell
from aesi.physics.cell.energies import energy_priors
from aesi.physics.simulation import ModelName, simulate
from aesi.records import Measurement

TEMPERATURES_DEGC = (-20.0, -10.0, 0.0, 10.0, 25.0, 40.0)
SOCS = (0.8, 0.5, 0.2)
"""Conventions, as the pulse of (1): data sheets print resistances of such pulses, and pulse tests have them."""
PULSE_S = (0.0, 1e-3, 2.0, 4.0, 6.0, 8.0, 10.0)
"""Rows of the pulse, s: the current steps up within the first interval."""
NEAR_1C, STEADY_C = 0.1, 0.03
"""Largest deviation of a measured pulse's current from 1C, and within rest and pulse, in C. Conventions."""
LATEST_S = 2.0
"""Longest time, s, from the last row of rest to the first of a measured pulse, which may begin anywhere between: (1) is
read low by 4 to 11 % where 5 s of its 10 s are missing, with the files of an LG M50, an LG 18650HG2 and a Panasonic
NCR18650PF at 0 and 25 degC. It is 0.1 and 1.05 s in the pulse tests of the Panasonic and the LG M50T."""


@dataclass(frozen=True, eq=False)
class PulseResistance:
    """Resistance (1) of a cell.

    temperature_degc : (m,) degC.  soc : (k,) state of charge.  ohm, low_ohm, high_ohm : (m, k), value and 95 %
    interval; NaN where the cell cannot give the pulse.  measured : the pulses within the fitted records.
    left_out : record -> number of its pulses whose beginning is not known to `LATEST_S`, of the records with such.
    model_error : RMS of ln(measured / predicted) over those of them that the cell can give; None without any, and then
    the intervals are without it.
    """

    temperature_degc: Array
    soc: Array
    ohm: Array
    low_ohm: Array
    high_ohm: Array
    measured: tuple[MeasuredPulse, ...]
    model_error: float | None
    left_out: Mapping[str, int]


@dataclass(frozen=True)
class MeasuredPulse:
    """A pulse (1) within a fitted record.

    record : its name.  temperature_degc : of the record, mean, degC.  soc : state of charge before the pulse, 0 to 1.
    ohm : measured.
    """

    record: str
    temperature_degc: float
    soc: float
    ohm: float


def pulse_resistance(
    found: Calibration, temperature_degc: Numbers = TEMPERATURES_DEGC, soc: Numbers = SOCS
) -> PulseResistance:
    """The resistance (1) of a calibrated cell, with its intervals.

    temperature_degc : (m,) or one value, degC.  soc : (k,) or one value, state of charge before the pulse, 0 to 1.
    """
    degc, socs = np.atleast_1d(temperature_degc).astype(float), np.atleast_1d(soc).astype(float)
    model = found.model
    log_ohm = partial(log_resistance, temperature_degc=degc, soc=socs, model_name=model.model_name)
    at, variance = log_ohm(written_cell(model, found.x)), propagated_variance(found, log_ohm)
    for moved in _with_other_energies(found):
        variance += ((log_ohm(moved) - at) / STEP) ** 2
    measured = tuple(pulse for record in found.model.records for pulse in _fitted_pulses(found, record))
    model_error = _model_error(found, measured)
    variance += (model_error or 0.0) ** 2
    ohm, factor = np.exp(at), np.exp(NINETY_FIVE * np.sqrt(variance))
    left_out = {one.name: count for one in model.records if (count := late_pulses(found.cell, one.data))}
    return PulseResistance(degc, socs, ohm, ohm / factor, ohm * factor, measured, model_error, left_out)


def _fitted_pulses(found: Calibration, record: Prepared) -> Iterator[MeasuredPulse]:
    """The pulses in a fitted record, as its rows were measured."""
    degc = kelvin_taken(found.declared, record.rows) - ZERO_CELSIUS_K
    name = record.name
    socs, ohm = measured_pulses(found.cell, record.data, found.starts[name], found.capacities[name])
    for soc, resistance_ohm in zip(socs.tolist(), ohm.tolist(), strict=True):
        yield MeasuredPulse(name, degc, soc, resistance_ohm)


def _model_error(found: Calibration, measured: Sequence[MeasuredPulse]) -> float | None:
    """`model_error` of the calibrated cell, from measured pulses."""
    cell, off = written_cell(found.model, found.x), []
    for degc, pulses in groupby(measured, key=lambda pulse: pulse.temperature_degc):
        socs, ohm = np.array([(pulse.soc, pulse.ohm) for pulse in pulses]).T
        off.append(np.log(ohm) - log_resistance(cell, np.array([degc]), socs, found.model.model_name)[0])
    all_off = np.concatenate([np.empty(0), *off])
    told = all_off[np.isfinite(all_off)]
    return rms(told) if len(told) else None


def _with_other_energies(found: Calibration) -> Iterator[Cell]:
    """The calibrated cell with each activation energy that the fit did not move off by `STEP` of its prior."""
    cell, fitted = written_cell(found.model, found.x), {free.name for free in found.model.free}
    for (part, rate), prior in energy_priors(cell).items():
        name = f"{part}.{rate}_energy"
        if name not in fitted:
            declared_j_mol = float(getattr(getattr(cell, part), f"{rate}_ea_j_mol"))
            yield with_parameters(cell, {name: declared_j_mol + STEP * prior.sd_j_mol})


def log_resistance(cell: Cell, temperature_degc: Array, soc: Array, model_name: ModelName = "espm") -> Array:
    """(m, k) natural logarithm of (1) in ohm; NaN where the cell cannot give the pulse.

    temperature_degc : (m,) degC.  soc : (k,).
    """
    current_a = np.full(len(PULSE_S), cell.nominal_capacity_ah)
    current_a[0] = 0.0
    out = np.full((len(temperature_degc), len(soc)), np.nan)
    for a, degc in enumerate(temperature_degc):
        for b, charge in enumerate(soc):
            try:
                run = simulate(
                    cell, PULSE_S, current_a, float(charge), (), float(degc), "backward", model=model_name
                )
            except AesiError:
                continue
            out[a, b] = np.log((run.voltage_v[0] - run.voltage_v[-1]) / cell.nominal_capacity_ah)
    return out


def measured_pulses(cell: Cell, record: Measurement, soc0: float, share: float = 1.0) -> tuple[Array, Array]:
    """(states of charge (n,), resistances (1) in ohm (n,)) of the 1C discharges of 10 s and more from rest in a record
    whose beginning is known to `LATEST_S`.

    soc0 : state of charge at its first row.  share : capacity of the cell at that time over that of its file. A rate is
    of the nominal capacity all the same: a cycler's schedule does not follow the ageing of the cell.

    The 10 s count from the last row of rest.
    """
    voltage_v, nominal_ah = record.voltage_v, cell.nominal_capacity_ah
    c_rate = record.current_a / nominal_ah
    soc = soc0 - record.discharged_ah(record.hold_taken) / (share * cell.capacity_ah)
    found = []
    for k, last in _pulses(cell, record):
        if not _begins_late(record, k):
            current_a = nominal_ah * float(np.mean(c_rate[k + 1 : last + 1]))
            found.append((soc[k], (voltage_v[k] - voltage_v[last]) / current_a))
    socs, ohm = np.array(found, dtype=float).reshape(-1, 2).T
    return socs, ohm


def late_pulses(cell: Cell, record: Measurement) -> int:
    """Number of pulses that `measured_pulses` leaves out, since their beginning is not known to `LATEST_S`."""
    return sum(_begins_late(record, k) for k, _ in _pulses(cell, record))


def _begins_late(record: Measurement, k: int) -> bool:
    return bool(record.time_s[k + 1] - record.time_s[k] > LATEST_S)


def _pulses(cell: Cell, record: Measurement) -> Iterator[tuple[int, int]]:
    """(last row of rest, row nearest to 10 s after it) of each 1C discharge of 10 s and more from rest."""
    time_s, c_rate = record.time_s, record.current_a / cell.nominal_capacity_ah
    near_1c, between_s = np.abs(c_rate - 1.0) < NEAR_1C, 0.5 * (time_s[1:] + time_s[:-1])
    for k in np.flatnonzero((np.abs(c_rate[:-1]) < STEADY_C) & near_1c[1:]):
        until_s = time_s[k] + PULSE_S[-1]
        last = int(np.searchsorted(between_s, until_s))
        last -= not near_1c[last]  # where a pulse ends after 10 s, that row may show the rest already
        if until_s <= time_s[-1] and last > k + 1 and np.ptp(c_rate[k + 2 : last + 1]) < STEADY_C:
            yield int(k), last
