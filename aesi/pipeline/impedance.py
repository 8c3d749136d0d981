"""`aesi impedance` as plain functions, and measured spectra held against a cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from aesi.calibration.records.spectra import BAND_HZ, comparable_spectra, degc_of, in_band, state_of
from aesi.data.channels.spectrum_columns import find_frequency
from aesi.data.readers import open_table
from aesi.data.readers.table import names_listed
from aesi.errors import DataError, InputError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, ComplexArray
from aesi.physics import Cell, ModelName, impedance
from aesi.physics.cell import Soh
from aesi.physics.effect import ActiveEffect
from aesi.physics.impedance import slowest_diffusion_hz
from aesi.physics.simulation import model_with
from aesi.pipeline.notes import other_model_sentences, soh_sentences, temperature_range_sentences
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.product.hybrid import id_in
from aesi.pipeline.simulation import SayNotes, write_table
from aesi.pipeline.simulation_words import INFERRING
from aesi.records import Spectrum

INSTANT_HZ = 10.0
"""Above it a note says that a model has no double layers. A convention: at half charge and 25 degC the effect of that
name lowers |Z| at 10 Hz by a factor of 1.08 (Panasonic NCR18650PF) to 6.4 (the virtual NMC cell), at 1 Hz of 1.01 to
1.5."""
NO_DOUBLE_LAYER = (
    f"neither the cell's file nor an effect brings double layers (--effect double_layer does), so that kinetics answer "
    f"at once: above some {INSTANT_HZ:g} Hz there is no arc, and |Z| is too large."
)

MOST_FREQUENCIES, HIGHEST_HZ = 100_000, 1e9
"""Limits of `--frequencies`. Sweeps have some tens to hundreds and end at some megahertz, beyond which they see
leads and no cell. Conventions: far more frequencies than these fill the memory and take hours."""


def impedance_file(
    cell: Path,
    soc: float,
    frequencies: str,
    out: Path,
    temperature_degc: float = 25.0,
    effects: Sequence[ActiveEffect] = (),
    model: ModelName | None = None,
    soh: Soh | None = None,
    say_notes: SayNotes | None = None,
) -> ComplexArray:
    """Write frequency_hz, z_real_ohm, z_imag_ohm to `out`, and return the impedance (n,) ohm.

    cell : a BPX file, or a folder of a saved model, whose effects are taken.  effects : added to those.
    frequencies : LOW:HIGH:N in Hz, log-spaced, or a CSV with a column frequency_hz, or an instrument's (freq/Hz).
    model : "espm" or "dfn"; None takes that of a saved model, or that the cell's file was fitted with, else "espm".
    soh : share of the file's capacity that the cell had then, or the day of the test; None takes all of it.
    say_notes : is given sentences on what of the file was not read, on another model than the cell was fitted with, the
    share of capacity on a day, a temperature that it was not fitted at, effects that an impedance lacks, a double layer
    that is missing at frequencies at which that shows, and frequencies that are too low or too high for the model, or
    there more than once.
    """
    given = declared_model(cell)
    declared = given.with_soh(soh)
    hz = read_frequencies(frequencies)
    active = (*declared.effects, *effects)
    z = impedance(declared.cell, hz, soc, temperature_degc, active, model=model or declared.model)
    write_table(out, {"frequency_hz": hz, "z_real_ohm": z.real, "z_imag_ohm": z.imag})
    if say_notes is not None:
        cold = temperature_range_sentences(declared.cell, [temperature_degc])
        say_notes(
            [
                *declared.cell.unread,
                *other_model_sentences(declared, model),
                *soh_sentences(given, soh),
                *cold,
                *_missing_effect_sentences([one for one in active if not one.vanishes], declared.held),
            ]
        )
        say_notes(_repeated_sentences(hz, soc, temperature_degc))
        if hz.max() > INSTANT_HZ and not _has_double_layer(declared.cell, active):
            say_notes([NO_DOUBLE_LAYER])
        say_notes(
            _frequency_sentences(hz, slowest_diffusion_hz(declared.cell, soc, temperature_degc, active))
        )
    return z


def _repeated_sentences(hz: Array, soc: float, temperature_degc: float) -> list[str]:
    """A sentence where frequencies are there more than once, as in a file of spectra of several states."""
    different = len(np.unique(hz))
    if different == len(hz):
        return []
    return [
        f"the file has {len(hz):,} rows and {different:,} different frequencies: if it holds spectra of several "
        f"states, the impedance of all rows is that at a state of charge of {soc:g} and {temperature_degc:g} degC."
    ]


def _frequency_sentences(hz: Array, slowest_hz: float) -> list[str]:
    """Sentences on frequencies that are too low or too high for the model.  slowest_hz : of its diffusion."""
    below, above, said = int(np.sum(hz < slowest_hz)), int(np.sum(hz > BAND_HZ[1])), []
    if below:
        said.append(
            f"{_count_clause(below)} below {slowest_hz:.2g} Hz, where the slowest diffusion in the model "
            "keeps up: Z tends to the slope of the open-circuit voltage alone, and |Z| to 1/f without end."
        )
    if above:
        said.append(
            f"{_count_clause(above)} above {BAND_HZ[1]:g} Hz, where a measured spectrum is of leads and "
            "windings, too: the model has no inductance."
        )
    return said


def _count_clause(count: int) -> str:
    return f"{count:,} of the frequencies {'lies' if count == 1 else 'lie'}"


def _missing_effect_sentences(effects: Sequence[ActiveEffect], held: Sequence[str]) -> list[str]:
    """Sentences on the effects that an impedance lacks, in whole or in part: those that act on a record, a reading
    or a given temperature alone, and those on the voltage, which may go on to answer after the current is there, as
    `ohmic` ones do not.

    held : effects in the values of the cell, in words; of these a temperature alone is not in the impedance.
    """
    warm = [one.id for one in effects if one.effect.infers == "temperature"]
    acting = (one for one in effects if one.id not in warm)
    names = [one.id for one in acting if one.effect.on_model is None and one.effect.on_voltage is None]
    said = [f"{', '.join(names)}: of a record, not of the cell, and not in its impedance."] if names else []
    later = [one.id for one in effects if one.effect.on_voltage is not None and not one.effect.ohmic]
    if later:
        said.append(f"{', '.join(later)}: only what it answers to a current at once is in the impedance.")
    stated = dict.fromkeys([*warm, *(id for id in map(id_in, held) if id in INFERRING)])
    if stated:
        said.append(f"{', '.join(stated)}: not in the impedance, which is at the temperature that is given.")
    return said


def _has_double_layer(cell: Cell, effects: Sequence[ActiveEffect]) -> bool:
    model = model_with(cell, effects)
    layers = (model.cell.negative, model.cell.positive, model.negative, model.positive)
    return any(layer.double_layer_f_m2 > 0.0 for layer in layers)


def read_frequencies(text: str) -> Array:
    """Hz, of LOW:HIGH:N or of a file.  Raises InputError or DataError for what is neither."""
    if not Path(text).exists():
        try:
            lowest, highest, count = text.split(":")
            low, high, n = float(lowest), float(highest), int(count)
        except ValueError:
            raise InputError(
                f"--frequencies {text}: has to read LOW:HIGH:N, as in 0.001:1000:61, or to be a file that is there."
            ) from None
        if not 0.0 < low < high < np.inf or n < 2:
            raise InputError(f"--frequencies {text}: needs 0 < LOW < HIGH in Hz and at least two of them.")
        if high > HIGHEST_HZ or n > MOST_FREQUENCIES:
            raise InputError(
                f"--frequencies {text}: at most {MOST_FREQUENCIES:,} frequencies up to {HIGHEST_HZ:g} Hz are worked "
                "out; give a smaller N or HIGH."
            )
        return np.geomspace(low, high, n)
    table = open_table(text)
    found = find_frequency(table)
    if found is None:
        raise DataError(
            f"{table.path.name} has no column frequency_hz, and none as instruments name it with its unit (freq/Hz); "
            f"it has {names_listed(table.header)}."
        )
    place, factor = found
    hz = factor * table.read((place,))[0]
    bad = np.flatnonzero(~(np.isfinite(hz) & (hz > 0.0)))
    if bad.size or not hz.size:
        what = f"row {bad[0] + 1}: frequency_hz is {hz[bad[0]]:g}" if bad.size else "no row below its header"
        raise DataError(f"{table.path.name}, {what}; give positive numbers in Hz.")
    return hz


@dataclass(frozen=True, eq=False)
class SpectrumError:
    """A measured spectrum beside the model's.

    soc : at which the model was taken.  z_ohm : (n,) the model's.  ratio_error : root mean square of |Z_model|/|Z| - 1
    within `BAND_HZ`, None where no frequency lies in it.  fitted : whether the cell was fitted to it.
    """

    measured: Spectrum
    soc: float
    z_ohm: ComplexArray
    ratio_error: float | None
    fitted: bool


def compared_spectra(
    cell: Cell,
    spectra: Sequence[Spectrum],
    model: ModelName = "espm",
    fitted: Sequence[Spectrum] = (),
) -> tuple[tuple[SpectrumError, ...], tuple[str, ...]]:
    """Each spectrum beside the cell's, and sentences on those below empty or above full, which are left out, and on
    those whose temperature is not known.

    fitted : those that the cell was fitted to, which come first.
    """
    kept, sentences = comparable_spectra(cell, [*fitted, *spectra])
    out = []
    for spectrum in kept:
        soc, seen = state_of(cell, spectrum), in_band(spectrum)
        z = impedance(cell, spectrum.frequency_hz, soc, degc_of(spectrum), model=model)
        ratio = np.abs(z[seen]) / np.abs(spectrum.z_ohm[seen]) - 1.0
        ratio_error = rms(ratio) if seen.any() else None
        out.append(SpectrumError(spectrum, soc, z, ratio_error, any(spectrum is one for one in fitted)))
    return tuple(out), sentences
