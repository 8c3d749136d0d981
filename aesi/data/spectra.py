"""Impedance spectra on disk: one row a frequency, several spectra in one file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from aesi.constants import COLDEST_DEGC, WARMEST_DEGC
from aesi.data import units
from aesi.data.channels.spectrum_columns import EXAMPLE, NEEDED, find_impedance, find_temperature
from aesi.data.readers import open_table
from aesi.data.readers.table import TableFile, names_listed
from aesi.data.reading import record_name
from aesi.errors import DataError
from aesi.numerics.typing import AnyArray, Array
from aesi.records import Spectrum
from aesi.records.checked import row_words

LABEL = "spectrum"
STATES = ("soc", "discharged_ah")
MOST_AGAIN = 1
"""Most frequencies that may occur twice in one spectrum: one of 27 measured spectra has one such frequency."""
MOST_BACK = 0.5
"""Most that the frequencies of one sweep may go back, in all, as a share of the decades it spans: one that starts again
goes back over all of them, and none of the 27 measured spectra goes back at all."""
SLOW_HZ = 10.0
"""Frequency up to which a cell is capacitive. All rows below 1,067 Hz are, in all 27 spectra of the Panasonic
NCR18650PF. In a cell a hundred times larger, with the inductance of longer leads, that limit is some decades lower."""
MOST_SOC = 0.01
MOST_OF_NEXT = 0.1
"""Most that a state may change within a sweep: MOST_SOC in state of charge, and MOST_OF_NEXT as a share of its largest
change between successive spectra where spectra have no names. Conventions: spectra are taken some per cent of the
charge apart, and one spectrum moves thousandths of it."""
DESCRIBED = ("voltage_v", "temperature_degc", *STATES)


def read_spectra(path: str | Path) -> tuple[Spectrum, ...]:
    """The spectra of a table with frequency_hz, z_real_ohm, z_imag_ohm, and soc or discharged_ah.

    The first three, and the temperature, may have an instrument's names with their units (`freq/Hz`, `Re(Z)/Ohm`,
    `-Im(Z)/Ohm`, `Temperature/°C`). A spectrum ends where its state changes and the frequencies start again, or where
    the name in a column `spectrum` changes. A coulomb-counted state changes a little within each sweep; its first row
    is taken for all. The imaginary part is negative where capacitive. voltage_v and temperature_degc are optional; the
    temperature is averaged over the rows.
    Raises DataError naming file and column.
    """
    table = open_table(path)
    columns = _columns(table)
    if not (columns["frequency_hz"] > 0.0).all():
        raise DataError(f"{table.path.name}, column frequency_hz: a frequency has to be positive.")
    _check_temperature(columns, table)
    _check_capacitive(
        columns["frequency_hz"],
        columns["z_imag_ohm"],
        lambda row: f"{table.path.name}, {table.where(row)}, column z_imag_ohm",
    )
    named = LABEL in table.header
    labels = np.array(table.read_text((table.header.index(LABEL),))[0]) if named else None
    pieces = _pieces(columns, labels)
    for name in STATES:
        if name in columns:
            _check_one_state(name, columns[name], pieces, named, table)
    if not named:
        _check_swept_once(columns["frequency_hz"], pieces, table)
    name = record_name(table.path)
    return tuple(_spectrum(f"{name} {k}", columns, rows) for k, rows in enumerate(pieces, start=1))


def _columns(table: TableFile) -> dict[str, Array]:
    """The columns NEEDED, in the units of their names, and those columns of DESCRIBED that exist, (rows,) each.

    Raises DataError for a column that is missing or exists twice, for a table without rows, and for a cell that is not
    a number.
    """
    file, header = table.path.name, list(table.header)
    found = find_impedance(table)
    missing = [name for name in NEEDED if name not in found]
    if missing or not any(name in header for name in STATES):
        wanted = ", ".join(missing) if missing else " or ".join(STATES)
        raise DataError(
            f"{file} has no column {wanted}; a file of spectra needs {', '.join(NEEDED)} (or as instruments name them, "
            f"with units: {EXAMPLE}), and {' or '.join(STATES)}. It has: {names_listed(table.header)}."
        )
    twice = [name for name in (*DESCRIBED, LABEL) if header.count(name) > 1]
    if twice:
        raise DataError(
            f"{file} has {header.count(twice[0])} columns named {twice[0]!r}; rename all but one of them."
        )
    found |= {name: (header.index(name), 1.0) for name in DESCRIBED if name in header}
    temperature = find_temperature(table)
    if temperature is not None:
        found["temperature_degc"] = temperature[0], 1.0
    numbers = table.read(tuple(place for place, _ in found.values()))
    columns = {name: factor * each for (name, (_, factor)), each in zip(found.items(), numbers, strict=True)}
    if not len(columns["frequency_hz"]):
        raise DataError(f"{file} has no row below its header; a spectrum needs at least one.")
    if temperature is not None:
        degc = units.to_si("temperature_degc", columns["temperature_degc"], temperature[1])
        columns["temperature_degc"] = degc
    for name, values in columns.items():
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise DataError(f"{file}, {table.where(row)}, column {name}: not a number.")
    return columns


def _check_temperature(columns: dict[str, Array], table: TableFile) -> None:
    """Raises DataError for a temperature that no cell has; as a spectrum's mean it would stop all later steps."""
    degc = columns.get("temperature_degc", np.empty(0))
    absurd = np.flatnonzero((degc < COLDEST_DEGC) | (degc > WARMEST_DEGC))
    if absurd.size:
        row = int(absurd[0])
        kelvin = " (in kelvin? 298.15 K is 25 degC)" if degc[row] > WARMEST_DEGC else ""
        raise DataError(
            f"{table.path.name}, {table.where(row)}, column temperature_degc: {degc[row]:.6g} degC is outside "
            f"{COLDEST_DEGC:g} to {WARMEST_DEGC:g} degC{kelvin}; correct the column or leave it out."
        )


def check_spectrum(spectrum: Spectrum) -> None:
    """Raises DataError for a spectrum, made of arrays, of whose imaginary part a file would be refused for its sign."""
    _check_capacitive(
        spectrum.frequency_hz,
        spectrum.z_ohm.imag,
        lambda row: f"{spectrum.name}, {row_words(row)}, imaginary part of z_ohm",
    )


def _check_capacitive(frequency_hz: Array, z_imag_ohm: Array, place: Callable[[int], str]) -> None:
    """Raises DataError where the imaginary part is positive in all rows up to SLOW_HZ: it is -Im then, as in plots.

    place : row from 0 -> how the sentence calls it.
    """
    slow = np.flatnonzero(frequency_hz <= SLOW_HZ)
    if slow.size and (z_imag_ohm[slow] > 0.0).all():
        raise DataError(
            f"{place(int(slow[0]))}: it is positive in all rows up to {SLOW_HZ:g} Hz, where a cell is capacitive and "
            "it has to be negative; if it holds -Im(Z), turn its sign."
        )


def _check_swept_once(frequency_hz: Array, pieces: Sequence[slice], table: TableFile) -> None:
    """Raises DataError where frequencies repeat at one state, or their sweep starts again: spectra of several
    temperatures or days would be taken for one spectrum at their mean temperature."""
    for rows in pieces:
        _, first = np.unique(frequency_hz[rows], return_index=True)
        again = np.setdiff1d(np.arange(rows.stop - rows.start), first)
        if again.size > MOST_AGAIN:
            row = rows.start + int(again[0])
            raise DataError(
                f"{table.path.name}, {table.where(row)}: {frequency_hz[row]:g} Hz is there a second time at one state "
                f"of charge; if these are several spectra, name each in a column {LABEL}."
            )
        steps = np.diff(np.log10(frequency_hz[rows]))
        back = steps * np.sign(steps[np.flatnonzero(steps)[:1]].sum()) < 0.0
        if np.abs(steps[back]).sum() > MOST_BACK * np.ptp(np.log10(frequency_hz[rows])):
            row = rows.start + 1 + int(np.argmax(back))
            raise DataError(
                f"{table.path.name}, {table.where(row)}: the frequencies turn back from {frequency_hz[row - 1]:g} to "
                f"{frequency_hz[row]:g} Hz at one state of charge; if these are several spectra, name each in a column "
                f"{LABEL}, else put the rows in the order of their frequencies."
            )


def _check_one_state(name: str, state: Array, pieces: Sequence[slice], named: bool, table: TableFile) -> None:
    """Raises DataError where a state changes within one sweep as much as between spectra: then rows of several spectra
    are mixed, or each row belongs to a different spectrum."""
    change = np.abs(np.diff(state))
    between = max((float(change[rows.start - 1]) for rows in pieces if rows.start), default=np.inf)
    most = MOST_SOC if name == "soc" else np.inf
    for rows in pieces:
        away = np.abs(state[rows] - state[rows.start])
        far = np.flatnonzero(away > min(most, np.inf if named else MOST_OF_NEXT * between))
        if far.size:
            row = rows.start + int(far[0])
            raise DataError(
                f"{table.path.name}, {table.where(row)}, column {name}: {state[row]:g}, where this sweep of the "
                f"frequencies began at {state[rows.start]:g}; put the rows of one spectrum one after the other, at one "
                f"state of charge, or name each spectrum in a column {LABEL}."
            )


def _pieces(columns: dict[str, Array], labels: AnyArray | None) -> list[slice]:
    """The rows of each spectrum.

    labels : (rows,) name of the spectrum of each row; None where the file has no names.
    """
    way = np.sign(np.diff(columns["frequency_hz"]))
    moved = np.any([np.diff(columns[name]) != 0 for name in STATES if name in columns], axis=0)
    renamed = np.zeros(len(way), dtype=bool) if labels is None else labels[1:] != labels[:-1]
    cuts, swept = [0], 0.0  # swept: direction of the current sweep, 1 up, -1 down, 0 unknown
    for k, step in enumerate(way):
        if renamed[k] or (moved[k] and not _goes_on(way[k:], swept)):
            cuts.append(k + 1)
            swept = 0.0
        else:
            swept = swept or float(step)
    return [slice(a, b) for a, b in pairwise([*cuts, len(columns["frequency_hz"])])]


def _goes_on(way: Array, swept: float) -> bool:
    """True where the next step in frequency continues the current sweep. A frequency that is repeated within a sweep
    does not start another sweep.

    way : (n,) signs of this step and the later ones.  swept : direction of the sweep, 0 at its first row.
    """
    if way[0]:
        return not swept or bool(way[0] == swept)
    return bool(swept) and len(way) > 1 and bool(way[1] == swept)


def _spectrum(name: str, columns: dict[str, Array], rows: slice) -> Spectrum:
    def first(quantity: str) -> float | None:
        return float(columns[quantity][rows][0]) if quantity in columns else None

    temperature = columns["temperature_degc"][rows].mean() if "temperature_degc" in columns else None
    return Spectrum(
        name=name,
        frequency_hz=columns["frequency_hz"][rows],
        z_ohm=columns["z_real_ohm"][rows] + 1j * columns["z_imag_ohm"][rows],
        soc=first("soc"),
        discharged_ah=first("discharged_ah"),
        voltage_v=first("voltage_v"),
        temperature_degc=None if temperature is None else float(temperature),
    )
