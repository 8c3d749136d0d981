"""Measured impedance spectra of the cell: the choice of those that a model can be compared with, and the misfit of each
frequency where they are fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.data.channels.implausible.scale import HIGHEST_CHARGE_RESISTANCE_OHM_AH
from aesi.errors import DataError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.physics import Cell, ModelName, impedance
from aesi.records import Spectrum

BAND_HZ = (0.01, 100.0)
"""Band in which spectra are judged, and fitted: above it they show leads and sensors, below it the slope of an
open-circuit potential."""
ASSUMED_DEGC = 25.0
"""Temperature that is assumed, and noted, for a spectrum without one."""
SPECTRUM_SHARE = 0.1
"""Share of |Z| that a calibrated model is expected to miss of a spectrum. Fourteen of a Panasonic NCR18650PF at 25
degC, fitted beside its C/20, its pulses and a 1C discharge, are missed by 6 to 20 %, 10.7 % in all. Its 13 at 10
degC, which were not fitted, are missed by 13.4 % instead of 15.7, and five of its drives by between 1.0 mV less and
0.4 mV more than without them."""

MOST_SOC_SAID = 2.0
"""A state of charge above it is in percent; one a little above 1 is of a cell that was overcharged. A convention."""
MOST_CAPACITIES = 10.0
"""Most charge, in capacities of the cell, that may have been discharged where a spectrum was taken. A convention: a
record scales a start file to a cell of another size, and a charge in mAh is a thousand times too large."""


def state_of(cell: Cell, spectrum: Spectrum) -> float:
    """State of charge of a spectrum.  Raises DataError where it gives none."""
    if spectrum.soc is not None:
        return spectrum.soc
    if spectrum.discharged_ah is None:
        raise DataError(f"{spectrum.name}: the state of the cell is not known; give soc or discharged_ah.")
    return 1.0 - spectrum.discharged_ah / cell.capacity_ah


def degc_of(spectrum: Spectrum) -> float:
    """Temperature at which a model is compared with a spectrum, degC."""
    return ASSUMED_DEGC if spectrum.temperature_degc is None else spectrum.temperature_degc


def in_band(spectrum: Spectrum) -> BoolArray:
    """(n,) True for the frequencies of a spectrum in `BAND_HZ`."""
    return (spectrum.frequency_hz >= BAND_HZ[0]) & (spectrum.frequency_hz <= BAND_HZ[1])


def comparable_spectra(
    cell: Cell, spectra: Sequence[Spectrum]
) -> tuple[tuple[Spectrum, ...], tuple[str, ...]]:
    """(spectra that a model of this cell can be compared with, sentences on those left out and on those of unknown
    temperature)."""
    kept, sentences = [], []
    for spectrum in spectra:
        soc = state_of(cell, spectrum)
        if not 0.0 <= soc <= 1.0:
            sentences.append(
                f"{spectrum.name}: left out, since its state of charge of {soc:.4g} is not between 0 and 1 (50 % is "
                "0.5)."
            )
            continue
        if spectrum.temperature_degc is None:
            sentences.append(f"{spectrum.name}: no temperature; the model is taken at {ASSUMED_DEGC:g} degC.")
        kept.append(spectrum)
    return tuple(kept), tuple(sentences)


def check_spectra(cell: Cell, spectra: Sequence[Spectrum]) -> None:
    """Raises DataError, before anything is fitted, for spectra that cannot be of such a cell, and where none is usable.

    cell : a fit may change its capacity, so that a state in Ah is checked by `MOST_CAPACITIES` alone.
    A spectrum in milliohm is detected as a current in mA is, by capacity x resistance: that of its smallest |Z|.
    """
    for spectrum in spectra:
        least_ohm = float(np.min(np.abs(spectrum.z_ohm)))
        if least_ohm * cell.nominal_capacity_ah > HIGHEST_CHARGE_RESISTANCE_OHM_AH:
            raise DataError(
                f"{spectrum.name}: |Z| is {least_ohm:.3g} ohm and more, as of no cell of "
                f"{cell.nominal_capacity_ah:.3g} A.h; z_real_ohm and z_imag_ohm are in ohm, so that 30 mOhm is 0.03."
            )
        if (
            spectrum.soc is None
            and abs(spectrum.discharged_ah or 0.0) > MOST_CAPACITIES * cell.nominal_capacity_ah
        ):
            raise DataError(
                f"{spectrum.name}: {spectrum.discharged_ah:.4g} A.h were discharged of a cell of "
                f"{cell.nominal_capacity_ah:.3g} A.h; discharged_ah is in A.h, so that 500 mA.h are 0.5."
            )
    percent = [s for s in spectra if s.soc is not None and s.soc > MOST_SOC_SAID]
    if percent:
        raise DataError(
            f"{percent[0].name}: its state of charge of {percent[0].soc:.4g} is not between 0 and 1 (50 % is 0.5): "
            "it is in percent, and so are the others of its file."
        )
    beyond = [s for s in spectra if s.soc is not None and not 0.0 <= s.soc <= 1.0]
    if spectra and len(beyond) == len(spectra):
        raise DataError(
            f"{beyond[0].name}: its state of charge of {beyond[0].soc:.4g} is not between 0 and 1 (50 % is 0.5), and "
            "there is no other spectrum to be held against the cell."
        )


def fitted_spectra(cell: Cell, spectra: Sequence[Spectrum]) -> tuple[tuple[Spectrum, ...], tuple[str, ...]]:
    """(spectra that a fit from this cell uses, sentences as from `comparable_spectra` and on those outside the band).

    Raises DataError where spectra were given and none can be fitted, and for one at a state that the cell lacks.
    """
    check_spectra(cell, spectra)
    kept, sentences = comparable_spectra(cell, spectra)
    seen = tuple(spectrum for spectrum in kept if in_band(spectrum).any())
    if spectra and not seen:
        raise DataError(
            f"{spectra[0].name}: no spectrum that was given to be fitted can be; none within {BAND_HZ[0]:g} to "
            f"{BAND_HZ[1]:g} Hz is between empty and full."
        )
    for spectrum in seen:
        soc = state_of(cell, spectrum)
        if not _has_state(cell, soc):
            raise DataError(
                f"{spectrum.name}: {cell.name} has no state of charge of {soc:g}, where a stoichiometry leaves (0, 1); "
                "correct the stoichiometry limits of its file, or leave the spectrum out."
            )
    outside = (
        f"{spectrum.name}: not fitted, since it has no frequency from {BAND_HZ[0]:g} to {BAND_HZ[1]:g} Hz."
        for spectrum in kept
        if not in_band(spectrum).any()
    )
    return seen, (*sentences, *outside)


def _has_state(cell: Cell, soc: float) -> bool:
    """Whether both stoichiometries of a state of charge are those of an electrode, as `impedance` needs them."""
    return all(0.0 < theta < 1.0 for theta in cell.stoichiometries(soc))


@dataclass(frozen=True, eq=False)
class FittedSpectra:
    """Spectra that are fitted together with the records.

    The misfit of a frequency is the real and the imaginary part of (Z_model - Z) / |Z| / `SPECTRUM_SHARE`. The
    frequencies of one decade count together as one, since their errors are not independent.
    """

    spectra: tuple[Spectrum, ...]
    model: ModelName

    def misfits(self, cell: Cell) -> Array:
        """Misfits of this cell, (2 x frequencies in the band,), all spectra one after another; NaN for a spectrum at a
        state of charge that the cell does not have, so that a descent steps back from there."""
        return _joined([self._misfit(cell, spectrum) for spectrum in self.spectra])

    def information_weights(self, cell: Cell) -> Array:
        """Factors, as `misfits` in shape, that reduce the information of a spectrum with a larger misfit than expected
        accordingly."""
        parts = []
        for spectrum in self.spectra:
            misfit = self._misfit(cell, spectrum)
            parts.append(np.full(len(misfit), 1.0 / max(rms(misfit) * _by_decade(spectrum) ** 0.5, 1.0)))
        return _joined(parts)

    def _misfit(self, cell: Cell, spectrum: Spectrum) -> Array:
        seen = in_band(spectrum)
        measured = spectrum.z_ohm[seen]
        soc = min(max(state_of(cell, spectrum), 0.0), 1.0)  # a change of the capacity may move it out
        if not _has_state(cell, soc):
            return np.full(2 * len(measured), np.nan)
        z = impedance(cell, spectrum.frequency_hz[seen], soc, degc_of(spectrum), model=self.model)
        off = (z - measured) / np.abs(measured)
        return np.concatenate([off.real, off.imag]) / (SPECTRUM_SHARE * _by_decade(spectrum) ** 0.5)


def _joined(parts: Sequence[Array]) -> Array:
    return np.concatenate(parts) if parts else np.zeros(0)


def _by_decade(spectrum: Spectrum) -> float:
    """Number of a spectrum's frequencies per decade within the band, at least 1."""
    hz = spectrum.frequency_hz[in_band(spectrum)]
    decades = float(np.log10(hz.max() / hz.min()))
    return max(len(hz) / max(decades, 1.0), 1.0)
