"""What was measured beside a record, held against the model that the loop ended with.

The thermocouple that was kept back, as mean and as course; the charge of a check-up; and the resistances of a spectrum:

    R_ohm  real part where the imaginary one crosses zero        R_ct = Re Z(1 Hz) - R_ohm

Of the model R_ohm is what is left at a high frequency with kinetics without resistance, so that both are defined
without a double layer. Leads above the crossing are of the measurement, and not in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from aesi.constants import MILLI, ZERO_CELSIUS_K
from aesi.errors import DataError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, impedance, simulate
from aesi.physics.simulation import model_with
from aesi.records import Measurement, Spectrum
from aesi.tracer import Discovery

AT_HZ = 1.0
"""Where resistances of kinetics are read from a spectrum; HIGH_HZ leaves the ohmic one alone."""
HIGH_HZ = 1e5
HALF = 0.5
"""State of charge at which spectra are held against each other."""
FAST = 1e6
"""Factor of the rate constants that leaves no resistance of kinetics."""
PERCENT = 100.0
"""Of one."""


@dataclass(frozen=True)
class Resistances:
    """Ohm: of conductors and electrolyte, and of the reaction and what follows it down to 1 Hz."""

    ohmic_ohm: float
    transfer_ohm: float


def course_row(found: Discovery, told: Measurement, measured_degc: Array) -> dict[str, float]:
    """The temperature (n,) degC that the found model runs at against the measured one: difference of the means, and
    root mean square over the record, K.  told : the record as the finder had it."""
    run = simulate(
        found.cell, told.time_s, told.current_a, found.soc0, found.model_effects, None, found.hold,
        on_depletion="clip",
    )  # fmt: skip
    difference = run.series["temperature_k"] - ZERO_CELSIUS_K - measured_degc
    return {
        "measured_mean_degc": float(np.mean(measured_degc)),
        "mean_off_k": float(np.mean(difference)),
        "course_rms_k": rms(difference),
    }


def capacity_row(found: Discovery, declared: Cell, lost: float) -> dict[str, float]:
    """Share of the capacity that is lost, measured and by the found model, per cent, and how far they are apart, in
    percentage points."""
    capacity_ah = model_with(found.cell, found.model_effects).cell.capacity_ah
    by_model = 1.0 - capacity_ah / declared.capacity_ah
    return {
        "lost_measured_pct": PERCENT * lost,
        "lost_found_pct": PERCENT * by_model,
        "lost_off_pp": PERCENT * abs(by_model - lost),
    }


def witness_row(found: Discovery, declared: Cell, spectra: Sequence[Spectrum]) -> dict[str, float]:
    """Resistances of the measured spectrum next to half charge, of the found model and of the declared one, mohm, and
    how far the found ones are off, as a share."""
    spectrum = next_to_half(spectra, declared)
    measured = of_spectrum(spectrum)
    ours, before = (
        of_model(cell, effects, _soc(spectrum, declared), spectrum.temperature_degc)
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


def next_to_half(spectra: Sequence[Spectrum], cell: Cell) -> Spectrum:
    """The spectrum whose state of charge is nearest to one half."""
    return min(spectra, key=lambda spectrum: abs(_soc(spectrum, cell) - HALF))


def _soc(spectrum: Spectrum, cell: Cell) -> float:
    if spectrum.soc is not None:
        return spectrum.soc
    return 1.0 - (spectrum.discharged_ah or 0.0) / cell.capacity_ah


def of_spectrum(spectrum: Spectrum) -> Resistances:
    """Of a measured spectrum.  Raises DataError where it does not cross zero or does not reach down to 1 Hz."""
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


def of_model(cell: Cell, effects: Sequence[Any], soc: float, temperature_degc: float | None) -> Resistances:
    """Of a cell with effects at a state of charge and a temperature."""
    degc = 25.0 if temperature_degc is None else temperature_degc
    fast = replace(
        cell,
        negative=replace(cell.negative, rate_constant=FAST * cell.negative.rate_constant),
        positive=replace(cell.positive, rate_constant=FAST * cell.positive.rate_constant),
    )
    ohmic = float(impedance(fast, np.array([HIGH_HZ]), soc, degc, effects).real[0])
    whole = float(impedance(cell, np.array([AT_HZ]), soc, degc, effects).real[0])
    return Resistances(ohmic, whole - ohmic)
