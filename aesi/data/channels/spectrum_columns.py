"""The columns of a file with frequency, impedance and temperature: under this project's names, or under names with
units."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

from aesi.data import units
from aesi.data.channels import headers
from aesi.data.channels.headers import UNIT
from aesi.data.readers.table import TableFile, names_listed
from aesi.errors import DataError

NEEDED = ("frequency_hz", "z_real_ohm", "z_imag_ohm")
STEMS = {
    "frequency_hz": r"(act(ual)? ?)?freq(uency|\.)?",
    "z_real_ohm": r"re ?\(z\)|real ?\(z\)|z ?re(al)?\d?|z'",
    "z_imag_ohm": r"-? ?(im(ag)? ?\(z\)|z ?im?(a?g)?\d?|z'')",
}
"""Instruments' names of the quantities, without units; a leading minus means the negative."""
UNITS = {
    "frequency_hz": {"hz": 1.0, "khz": 1e3, "mhz": 1e-3},
    "z_real_ohm": {"ohm": 1.0, "ohms": 1.0, "ω": 1.0, "mohm": 1e-3, "mω": 1e-3, "kohm": 1e3, "kω": 1e3},
}
UNITS["z_imag_ohm"] = UNITS["z_real_ohm"]
"""Unit in lower case -> factor to Hz or ohm; no unit starts with a capital M, for mega."""
EXAMPLE = "freq/Hz, Re(Z)/Ohm, -Im(Z)/Ohm"


def find_impedance(table: TableFile) -> dict[str, tuple[int, float]]:
    """Column of NEEDED -> (position, factor to Hz or ohm), for those that exist.

    Raises DataError for one that exists twice, and for one under an instrument's name without a unit.
    """
    return _with_factors(table, NEEDED)


def find_frequency(table: TableFile) -> tuple[int, float] | None:
    """(position, factor to Hz) of the frequency, None where there is none; raises as `find_impedance`."""
    return _with_factors(table, NEEDED[:1]).get("frequency_hz")


def find_temperature(table: TableFile) -> tuple[int, str] | None:
    """(position, unit) of the cell's temperature; None where no column looks like one.

    Raises DataError where the column or its unit is ambiguous: nothing else shows the temperature of a spectrum, and a
    model at another one is wrong by tens of per cent.
    """
    if "temperature_degc" in table.header:
        own = [place for place, name in enumerate(table.header) if name == "temperature_degc"]
        return _only(table, own), units.SI["temperature_degc"]
    like = headers.temperatures(table.header)
    if not like:
        return None
    name = headers.nearest("temperature_degc", like)
    if name is None or len(like) > 1:
        raise DataError(
            f"{table.path.name}: {names_listed(like)} may be the cell's temperature; call the one that is "
            "temperature_degc (in degC), or remove what is none."
        )
    place = table.header.index(name)
    unit = headers.unit_of("temperature_degc", name) or units.spelt(
        "temperature_degc", table.units[place] if table.units else ""
    )
    if unit is None:
        raise DataError(
            f"{table.path.name}: {name!r} says no known unit; write it behind the name, as in Temperature/degC "
            "(also K, degF), or remove the column."
        )
    return place, unit


def _with_factors(table: TableFile, quantities: Sequence[str]) -> dict[str, tuple[int, float]]:
    found = {quantity: _found(table, quantity) for quantity in quantities}
    without = [table.header[at[0]] for at in found.values() if at and at[1] is None]
    if without:
        say = "says" if len(without) == 1 else "say"
        raise DataError(
            f"{table.path.name}: {', '.join(map(repr, without))} {say} no known unit; write it behind the name, as in "
            f"{EXAMPLE} (also kHz, mHz, mOhm, kOhm)."
        )
    return {quantity: (at[0], at[1]) for quantity, at in found.items() if at and at[1] is not None}


def _found(table: TableFile, quantity: str) -> tuple[int, float | None] | None:
    own = [place for place, name in enumerate(table.header) if name == quantity]
    if own:
        return _only(table, own), 1.0
    read = [(place, *_stem_and_unit(table, place)) for place in range(len(table.header))]
    alike = {place: (stem, unit) for place, stem, unit in read if re.fullmatch(STEMS[quantity], stem)}
    if not alike:
        return None
    place = _only(table, list(alike))
    stem, unit = alike[place]
    factor = None if unit.startswith("M") else UNITS[quantity].get(_lower(unit))
    return place, -factor if factor is not None and stem.startswith("-") else factor


def _stem_and_unit(table: TableFile, place: int) -> tuple[str, str]:
    """(name of a column without its unit, in lower case; the unit in the name or in the line of units)."""
    name = table.header[place]
    at = UNIT.search(name)
    inside = next((text for text in at.groups() if text), "") if at else ""
    if at and any(_lower(inside) in known for known in UNITS.values()):
        return _lower(name[: at.start()]), inside
    return _lower(name), table.units[place] if table.units else ""


def _lower(text: str) -> str:
    """Text in lower case with blanks for underscores; unlike `plain` it keeps the primes of Z' and Z''."""
    return re.sub(r"[\s_]+", " ", unicodedata.normalize("NFKC", text)).strip().lower()


def _only(table: TableFile, places: Sequence[int]) -> int:
    if len(places) > 1:
        names = list(dict.fromkeys(table.header[place] for place in places))
        said = (
            f"{len(places)} columns named {names[0]!r}" if len(names) == 1 else " and ".join(map(repr, names))
        )
        raise DataError(f"{table.path.name} has {said}; rename all but one of them.")
    return places[0]
