"""Which column of a file is which quantity, in what unit and with what sign.

Three conventions are known: this project's names, the battery data format (BDF), and names given by the user.
BDF: https://github.com/battery-data-alliance/battery-data-format, table of required quantities; its
current is positive on charge.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches

from aesi.errors import DataError

REQUIRED = ("time_s", "current_a", "voltage_v")
QUANTITIES = (*REQUIRED, "temperature_degc")

BDF = {
    "time_s": ("Test Time / s", "test_time_second"),
    "current_a": ("Current / A", "current_ampere"),
    "voltage_v": ("Voltage / V", "voltage_volt"),
    "temperature_degc": (
        "Surface Temperature T1 / degC",
        "temperature_t1_celsius",
        "surface_temperature_t1_celsius",
        "Surface Temperature / degC",
        "surface_temperature_celsius",
    ),
}

UNITS = {"time_s": "s", "current_a": "A", "voltage_v": "V", "temperature_degc": "degC"}
WRONG_UNITS = {
    "time_s": ("ms", "min", "h", "hr", "hour", "hours", "minutes", "us", "days"),
    "current_a": ("ma", "ua", "µa", "ka", "c"),
    "voltage_v": ("mv", "uv", "µv", "kv"),
    "temperature_degc": ("k", "f", "degf", "°f", "kelvin"),
}
LIKELY = {
    "time_s": r"time|zeit|^t$|^t[^a-z]",
    "current_a": r"current|strom|amp|^i$|^i[^a-z]|<i>",
    "voltage_v": r"volt|spannung|ecell|^u$|^v$|^[uv][^a-z]",
    "temperature_degc": r"temp|^t\d",
}


@dataclass(frozen=True)
class Mapped:
    """Position of each quantity in the header.

    bdf_current : the current came from a BDF column, so it is positive on charge by definition.
    """

    position: dict[str, int]
    header: dict[str, str]
    bdf_current: bool
    notes: tuple[str, ...]


def map_columns(
    header: tuple[str, ...],
    columns: Mapping[str, str | None] | None,
    file: str,
    required: tuple[str, ...] = REQUIRED,
) -> Mapped:
    """Find the quantities among the header's names.

    columns : quantity -> name, or None to leave it out; goes before the known names.
    required : what has to be there; the rest is found where it is.
    Raises DataError for an unknown quantity, a name that is missing or there twice, and a unit not SI.
    """
    given = dict(columns or {})
    for quantity in given:
        if quantity not in QUANTITIES:
            raise DataError(f"{quantity!r} is not a quantity to map; there are {', '.join(QUANTITIES)}.")
    position: dict[str, int] = {}
    missing: list[str] = []
    notes: list[str] = []
    bdf_current = False
    for quantity in QUANTITIES:
        if quantity in given:
            name = given[quantity]
            if name is None:
                if quantity in required:
                    raise DataError(f"{file}: {quantity} cannot be left out.")
                notes.append(f"{quantity} was left out as asked.")
                continue
            position[quantity] = _named(name, quantity, header, file)
            notes.append(f"{quantity} was taken from column {name!r} as asked.")
            continue
        found = _own(quantity, header, file)
        if found is None:
            found = _bdf(quantity, header, file)
            if found is not None:
                notes.append(f"{quantity} was taken from the BDF column {header[found]!r}.")
                bdf_current |= quantity == "current_a"
        if found is not None:
            position[quantity] = found
        elif quantity in required:
            missing.append(quantity)
    if missing:
        raise _missing(missing, header, file)
    names = {quantity: header[found] for quantity, found in position.items()}
    for quantity, name in names.items():
        _check_unit(quantity, name, file)
    _check_distinct(position, file, names)
    return Mapped(position, names, bdf_current, tuple(notes))


def _own(quantity: str, header: tuple[str, ...], file: str) -> int | None:
    return _only([i for i, name in enumerate(header) if name.lower() == quantity], quantity, header, file)


def _bdf(quantity: str, header: tuple[str, ...], file: str) -> int | None:
    for label in BDF[quantity]:
        places = [i for i, name in enumerate(header) if _plain(name) == _plain(label)]
        if places:
            return _only(places, label, header, file)
    return None


def _named(name: str, quantity: str, header: tuple[str, ...], file: str) -> int:
    found = _only([i for i, there in enumerate(header) if there == name.strip()], name, header, file)
    if found is None:
        near = get_close_matches(name, header, n=1, cutoff=0.4)
        hint = f"; the nearest is {near[0]!r}" if near else ""
        raise DataError(f"{file} has no column {name!r} for {quantity}{hint}. It has: {_listed(header)}.")
    return found


def _only(places: list[int], name: str, header: tuple[str, ...], file: str) -> int | None:
    if len(places) > 1:
        raise DataError(
            f"{file} has {len(places)} columns named {header[places[0]]!r} (numbers "
            f"{', '.join(str(p + 1) for p in places)}); rename all but one of them."
        )
    return places[0] if places else None


def _missing(missing: list[str], header: tuple[str, ...], file: str) -> DataError:
    likely = {quantity: nearest(quantity, header) for quantity in missing}
    options = " ".join(f'--column {quantity}="{name or "NAME"}"' for quantity, name in likely.items())
    near = ", ".join(repr(name) for name in likely.values() if name)
    found = f"; the nearest: {near}" if near else ""
    sign = ", and --sign charge-positive if charging is positive there" if "current_a" in missing else ""
    return DataError(
        f"{file} has no column {' and no column '.join(missing)}{found}. "
        f"Say which is meant: {options}{sign}. It has: {_listed(header)}."
    )


def nearest(quantity: str, header: tuple[str, ...]) -> str | None:
    """The column of the header that most likely holds the quantity, or None."""
    likely = [name for name in header if re.search(LIKELY[quantity], name.lower())]
    unit = UNITS[quantity].lower()
    in_unit = [name for name in likely if _unit(name) == unit]
    for names in (in_unit, likely):
        if names:
            return names[0]
    near = get_close_matches(quantity, [name.lower() for name in header], n=1, cutoff=0.5)
    return next((name for name in header if near and name.lower() == near[0]), None)


def _unit(name: str) -> str:
    """The unit in a column's name: 'I[mA]', 'Current (mA)', 'Voltage / mV', 'time_ms'; '' without one."""
    found = re.search(r"[\[(<]\s*([^\])>]+?)\s*[\])>]\s*$|[/_ ]\s*([^/_ \[\](){}]+)\s*$", name)
    return (found.group(1) or found.group(2)).lower() if found else ""


def _check_unit(quantity: str, name: str, file: str) -> None:
    unit = _unit(name)
    if unit in WRONG_UNITS[quantity]:
        raise DataError(
            f"{file}: column {name!r} is in {unit} by its name, and {quantity} is needed in "
            f"{UNITS[quantity]}; convert the column."
        )


def _check_distinct(position: Mapping[str, int], file: str, names: Mapping[str, str]) -> None:
    seen: dict[int, str] = {}
    for quantity, place in position.items():
        if place in seen:
            raise DataError(
                f"{file}: column {names[quantity]!r} cannot be both {seen[place]} and {quantity}."
            )
        seen[place] = quantity


def _plain(name: str) -> str:
    return re.sub(r"\s+", "", name).lower()


def _listed(header: tuple[str, ...]) -> str:
    shown = ", ".join(repr(name[:40]) for name in header[:12])
    return shown + (f" and {len(header) - 12} more" if len(header) > 12 else "")
