"""Independent checks: reference quantities measured beside a record, against the written model of a discovery.

The quantities are the temperature of the thermocouple that was withheld from the tracer, the capacity from a check-up,
and two resistances from an impedance spectrum:

    R_ohm = Re Z at the frequency where Im Z crosses zero        R_ct = Re Z(1 Hz) - R_ohm               (1)

R_ohm is that of the conductors and the electrolyte, R_ct that of the charge transfer and of what follows it down to
1 Hz. The model has no double layer, which would bypass the charge transfer at high frequencies. Its R_ohm is therefore
Re Z at a high frequency with rate constants so large that the kinetics have no resistance. The inductance of the leads,
above the crossing, is part of the measurement and not of the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from aesi.calibration.records.spectra import degc_of, state_of
from aesi.constants import MILLI, PERCENT, ZERO_CELSIUS_K
from aesi.errors import DataError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, impedance, simulate
from aesi.physics.effect import ActiveEffect
from aesi.physics.model import case_k
from aesi.physics.simulation import model_with
from aesi.records import Hold, Measurement, Spectrum
from aesi.tracer import Discovery

AT_HZ = 1.0
"""Frequency at which the charge-transfer resistance of (1) is read, Hz. A convention."""
HIGH_HZ = 1e5
"""Frequency at which the diffusion of the model contributes nothing to its resistance, Hz. A convention."""
HALF_CHARGE = 0.5
"""State of charge at which spectra are compared."""
FAST = 1e6
"""Factor on the rate constants that makes the resistance of the kinetics negligible. A convention."""


@dataclass(frozen=True)
class Resistances:
    """The two resistances of (1), ohm: R_ohm and R_ct."""

    ohmic_ohm: float
    transfer_ohm: float


@dataclass(frozen=True, eq=False)
class Witness:
    """The measured spectrum that a written model is compared with, and its resistances."""

    spectrum: Spectrum
    measured: Resistances


def witness_of(spectra: Sequence[Spectrum], declared: Cell) -> Witness:
    """The spectrum nearest to half charge.

    Raises DataError if the resistances cannot be read from it (`measured_resistances`).
    """
    spectrum = nearest_half_charge(spectra, declared)
    return Witness(spectrum, measured_resistances(spectrum))


def case_kelvin(
    cell: Cell, record: Measurement, soc0: float | None, effects: Sequence[ActiveEffect], hold: Hold
) -> Array:
    """(n,) K, simulated temperature of the case, where a thermocouple is; that of the winding where the model's cooling
    leaves no case between it and the surroundings (`case_k`). A measured temperature of the record is not used."""
    run = simulate(cell, record.time_s, record.current_a, soc0, effects, None, hold, on_depletion="clip")
    winding_k = run.series["temperature_k"]
    at_case = case_k(model_with(cell, effects), winding_k)
    return winding_k if at_case is None else at_case


def temperature_row(found: Discovery, record: Measurement, measured_degc: Array) -> dict[str, float]:
    """Comparison of the temperature in the written model with the measured one.

    record : as the tracer had it, without the temperature.  measured_degc : (n,) degC, the thermocouple.
    Returns the mean of the measured temperature, degC, and the mean and the RMS of the difference model minus measured,
    K.
    """
    hold = found.hold or record.hold_taken
    kelvin = case_kelvin(found.cell, record, found.soc0, found.model_effects, hold)
    difference = kelvin - ZERO_CELSIUS_K - measured_degc
    return {
        "measured_mean_degc": float(np.mean(measured_degc)),
        "mean_off_k": float(np.mean(difference)),
        "course_rms_k": rms(difference),
    }


def capacity_row(found: Discovery, declared: Cell, lost: float) -> dict[str, float]:
    """The capacity loss as measured and in the written model, per cent of the declared capacity, and their absolute
    difference, percentage points.

    declared : the cell as its file declares it.  lost : measured loss as a share, 0 to 1.
    """
    capacity_ah = model_with(found.cell, found.model_effects).cell.capacity_ah
    by_model = 1.0 - capacity_ah / declared.capacity_ah
    return {
        "lost_measured_pct": PERCENT * lost,
        "lost_found_pct": PERCENT * by_model,
        "lost_off_pp": PERCENT * abs(by_model - lost),
    }


def resistance_row(found: Discovery, declared: Cell, witness: Witness) -> dict[str, float]:
    """The resistances (1) of the measured spectrum, of the written model and of the declared one, mohm, and the
    relative errors of those of the written model."""
    spectrum, measured = witness.spectrum, witness.measured
    ours, before = (
        model_resistances(cell, effects, state_of(declared, spectrum), degc_of(spectrum))
        for cell, effects in ((found.cell, found.model_effects), (declared, ()))
    )
    return {
        "ohmic_measured_mohm": MILLI * measured.ohmic_ohm,
        "ohmic_found_mohm": MILLI * ours.ohmic_ohm,
        "ohmic_declared_mohm": MILLI * before.ohmic_ohm,
        "ohmic_off": abs(ours.ohmic_ohm / measured.ohmic_ohm - 1.0),
        "transfer_measured_mohm": MILLI * measured.transfer_ohm,
        "transfer_found_mohm": MILLI * ours.transfer_ohm,
        "transfer_declared_mohm": MILLI * before.transfer_ohm,
        "transfer_off": abs(ours.transfer_ohm / measured.transfer_ohm - 1.0),
    }


def nearest_half_charge(spectra: Sequence[Spectrum], cell: Cell) -> Spectrum:
    """The spectrum whose state of charge is nearest to one half; without a stated one it follows from the charge passed
    since the full charge."""
    return min(spectra, key=lambda spectrum: abs(state_of(cell, spectrum) - HALF_CHARGE))


def measured_resistances(spectrum: Spectrum) -> Resistances:
    """The resistances (1) of a measured spectrum, with linear interpolation between its frequencies.

    Raises DataError if the imaginary part does not cross zero, or if the frequencies do not include 1 Hz in their
    range.
    """
    order = np.argsort(spectrum.frequency_hz)
    hz, z = spectrum.frequency_hz[order], spectrum.z_ohm[order]
    below = np.flatnonzero((z.imag[:-1] < 0.0) & (z.imag[1:] >= 0.0))
    if not len(below) or not hz[0] <= AT_HZ <= hz[-1]:
        raise DataError(
            f"{spectrum.name} shows no ohmic resistance: its imaginary part has to cross zero, and its frequencies to "
            f"reach down to {AT_HZ:g} Hz."
        )
    k = int(below[-1])
    share = -z.imag[k] / (z.imag[k + 1] - z.imag[k])
    ohmic = float(z.real[k] + share * (z.real[k + 1] - z.real[k]))
    return Resistances(ohmic, float(np.interp(np.log(AT_HZ), np.log(hz), z.real)) - ohmic)


def model_resistances(cell: Cell, effects: Sequence[Any], soc: float, degc: float) -> Resistances:
    """The resistances (1) of a model cell with effects at rest, at a state of charge, 0 to 1, and a temperature."""
    fast = replace(
        cell,
        negative=replace(cell.negative, rate_constant=FAST * cell.negative.rate_constant),
        positive=replace(cell.positive, rate_constant=FAST * cell.positive.rate_constant),
    )
    ohmic = float(impedance(fast, np.array([HIGH_HZ]), soc, degc, effects).real[0])
    whole = float(impedance(cell, np.array([AT_HZ]), soc, degc, effects).real[0])
    return Resistances(ohmic, whole - ohmic)
