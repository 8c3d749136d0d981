"""Units of the four quantities in files, and their conversion to s, A, V and degC.

A unit comes from a maker's format, which writes it beside the name, or from the user (`--unit current_a=mA`).
It is never guessed from the numbers.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from aesi.constants import SECONDS_PER_HOUR, ZERO_CELSIUS_K
from aesi.errors import DataError, did_you_mean
from aesi.numerics.typing import Array

SECONDS_PER_MINUTE, SECONDS_PER_DAY = 60.0, 24.0 * SECONDS_PER_HOUR
SI = {"time_s": "s", "current_a": "A", "voltage_v": "V", "temperature_degc": "degC"}
FACTORS: dict[str, dict[str, float]] = {
    "time_s": {
        "s": 1.0,
        "ms": 1e-3,
        "us": 1e-6,
        "min": SECONDS_PER_MINUTE,
        "h": SECONDS_PER_HOUR,
        "d": SECONDS_PER_DAY,
    },
    "current_a": {"A": 1.0, "mA": 1e-3, "uA": 1e-6, "kA": 1e3},
    "voltage_v": {"V": 1.0, "mV": 1e-3, "uV": 1e-6},
    "temperature_degc": {"degC": 1.0, "K": 1.0, "degF": 5.0 / 9.0},
}
OFFSETS = {"K": -ZERO_CELSIUS_K, "degF": -32.0}
"""Added before the factor."""
CLOCK = "h:m:s"
DATE = "date"
SPELLINGS = {
    "time_s": {
        "s": ("s", "sec", "secs", "second", "seconds"),
        "ms": ("ms", "msec", "millisecond", "milliseconds"),
        "us": ("us", "µs", "μs", "microsecond", "microseconds"),
        "min": ("min", "mins", "minute", "minutes"),
        "h": ("h", "hr", "hrs", "hour", "hours"),
        "d": ("d", "day", "days"),
        CLOCK: ("h:m:s", "h:min:s", "h:min:s.ms", "hh:mm:ss", "hh:mm:ss.ms", "hh:mm:ss.fff"),
    },
    "current_a": {
        "A": ("a", "amp", "amps", "ampere", "amperes"),
        "mA": ("ma", "milliamp", "milliamps", "milliampere", "milliamperes"),
        "uA": ("ua", "µa", "μa", "microampere", "microamperes"),
        "kA": ("ka", "kiloampere"),
    },
    "voltage_v": {
        "V": ("v", "volt", "volts"),
        "mV": ("mv", "millivolt", "millivolts"),
        "uV": ("uv", "µv", "μv", "microvolt", "microvolts"),
    },
    "temperature_degc": {
        "degC": ("degc", "°c", "c", "celsius", "℃", "�c", "øc"),
        "K": ("k", "kelvin"),
        "degF": ("f", "degf", "°f", "fahrenheit"),
    },
}
"""How headers and users write each unit, in lower case."""
CLOCK_TIME = re.compile(
    r"(?:(\d+)\s*(?:d|days?)[ ,:]\s*)?(\d+):(\d{1,2}):(\d{1,2}(?:[.,]\d+)?)", re.IGNORECASE
)


def spelt(quantity: str, text: str) -> str | None:
    """The unit that a header or a user means by `text`; None where it is not a unit of the quantity."""
    plain = text.strip().lower()
    for unit, ways in SPELLINGS.get(quantity, {}).items():
        if plain in ways:
            return unit
    return None


def declared(quantity: str, text: str) -> str:
    """The unit that a user stated.  Raises DataError, with the known units, for an unknown one."""
    if quantity not in SI:
        raise DataError(
            f"{quantity!r} has no unit to declare{did_you_mean(quantity, SI)} Those that have one: {', '.join(SI)}."
        )
    if quantity == "time_s" and ("%" in text or text.strip().lower() == DATE):
        return text.strip() if "%" in text else DATE
    unit = spelt(quantity, text)
    if unit is None:
        also = ", h:m:s, date, or a pattern such as '%d.%m.%Y %H:%M:%S'" if quantity == "time_s" else ""
        raise DataError(f"{quantity} in {text!r} is unknown; units: {', '.join(FACTORS[quantity])}{also}.")
    return unit


def known_units(units: Mapping[str, str]) -> Mapping[str, str]:
    """The user's units by quantity, as they are.  Raises DataError as `declared` does."""
    for quantity, unit in units.items():
        declared(quantity, unit)
    return units


def is_text(unit: str) -> bool:
    """True where cells in this unit are text (clock times, dates), not numbers."""
    return unit in (CLOCK, DATE) or "%" in unit


def to_si(quantity: str, values: Array, unit: str) -> Array:
    """(n,) numbers in `unit` as s, A, V or degC."""
    if unit == SI[quantity]:
        return values
    return (values + OFFSETS.get(unit, 0.0)) * FACTORS[quantity][unit]


def clock_to_s(cells: Sequence[str]) -> Array:
    """(n,) s of cells such as '12:34:56.7' or '3d 12:34:56'; NaN for empty cells and for other text."""
    seconds = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        found = CLOCK_TIME.fullmatch(cell.strip())
        if found:
            days, hours, minutes, rest = found.groups()
            seconds[row] = (
                SECONDS_PER_DAY * int(days or 0)
                + SECONDS_PER_HOUR * int(hours)
                + SECONDS_PER_MINUTE * int(minutes)
                + float(rest.replace(",", "."))
            )
    return seconds


def dates_to_s(cells: Sequence[str], pattern: str) -> Array:
    """(n,) s since the first date; NaN for a cell that is not a date.

    pattern : 'date' (ISO 8601) or a strptime pattern.  Raises DataError for an invalid pattern.
    """
    import pandas as pd

    form = "ISO8601" if pattern == DATE else pattern
    try:
        # In UTC: a record that runs over a change to summer time holds two offsets, which pandas refuses otherwise.
        stamps = pd.to_datetime(pd.Series(cells).str.strip(), format=form, errors="coerce", utc=True)
    except (
        ValueError,
        re.error,
    ) as error:  # an invalid pattern; a cell that does not match it raises nothing
        raise DataError(
            f"{pattern!r} is no pattern of a date: {error}; give one such as '%d.%m.%Y %H:%M:%S', or date (ISO 8601)."
        ) from None
    first = stamps.dropna()
    if first.empty:
        return np.full(len(cells), np.nan)
    return np.asarray((stamps - first.iloc[0]).dt.total_seconds(), dtype=float)
