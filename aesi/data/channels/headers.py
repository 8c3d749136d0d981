"""Guesses from column names, used only for the options that messages propose."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from aesi.data import units
from aesi.data.readers.formats.format import Sign, plain
from aesi.data.readers.layout import COLUMN_NUMBER

OF_PLACE = r"\bt[ _]?(cell|can|case|surf|skin|batt|core|amb|chamber|env|room)"
"""Pattern of names of a temperature by its place, such as T_cell."""
LIKELY = {
    "time_s": r"time|zeit|elapsed|\bt\b|^t$|duration",
    "current_a": r"current|strom|\bamps?\b|\bi\b|^<?i>?\b|ampere",
    "voltage_v": r"volt|spannung|ecell|ewe|potential|\b[uv]\b",
    "temperature_degc": r"temp(?!el|o\b|s\b)|°[cf]|deg[cf]|celsius|thermo|\bt[ck]?\d\b|" + OF_PLACE,
    "state": r"^(state|status|step type|mode|md|command|zustand|direction)\b",
}
UNLIKELY = {
    "time_s": r"step|rest\b|date|stamp|stempel|real|absolute|cycle|dpt|dt\b|/dt|" + OF_PLACE,
    "current_a": r"density|range|limit|capacity|control|set\b|rate|time|temp|dq|power|shunt|offset",
    "voltage_v": r"limit|control|set\b|max|min|dv|range|aux|offset|power|upper|lower",
    "temperature_degc": r"time|/dt|set\b|limit|circuit|\bt?amb|chamber|env|room|umgebung|kammer",
    "state": r"time|of charge|soc",
}
WHOLE_TIME = r"total|test|cumul|elapsed"
"""Pattern of names of the whole test's time; beside such a column, a plain 'Time' restarts with each step."""
STAMP = r"stamp|stempel|date ?time|\bdat(e|um)\b|uhrzeit"
"""Pattern of names of a date and time of day, which tell the time of a test where no other column does."""
TEMPERATURE = "T"
"""Symbol of a temperature; without a unit it may be a time, where nothing else in a table is one."""
NO_TEMPERATURE = r"time|/dt|set\b|limit|circuit"
"""Pattern of names that only look like a temperature."""
RATE_OR_POWER = r"\bc[-_ ]?rate\b|\bpower\b|\bleistung\b"
"""Pattern of names of a C-rate or a power, which are multiples of a current."""
UNIT = re.compile(
    r"[\[(<]\s*([^\])>]+?)\s*[\])>]\s*$|[/#]\s*([^/#\[\](){}]+?)\s*$|[_ ]\s*([^/_ \[\](){}]+)\s*$"
)
DIRECTION = re.compile(
    r"[\[(<]\s*([+-]?)\s*=?\s*(dis\w*|dchg?|entlad\w*|charg\w*|chg?|lad\w*)\.?\s*=?\s*([+-]|pos|neg)?[^\])>]*[\])>]\s*$",
    re.IGNORECASE,
)
"""What says at the end of a current's name which direction is positive: (chg+), [+ = discharge], (dis. -)."""
NO_NAME = re.compile(rf"{COLUMN_NUMBER}\d+")


def nearest(quantity: str, header: Sequence[str], doubtful: bool = False) -> str | None:
    """The column of the header that most likely holds the quantity, or None.

    doubtful : also accept a column that more likely holds a related quantity (a step's time, a limit).
    """
    likely = [name for name in header if quantity in LIKELY and _is_like(quantity, name)]
    best = min(likely, key=lambda name: _doubt(quantity, name), default=None)
    return best if best is None or doubtful or not _doubt(quantity, best)[0] else None


def likeliest(quantity: str, header: Sequence[str], doubtful: bool = False) -> str | None:
    """The column to propose for the quantity, or None: the nearest name; else a column of dates for the time; else a
    column T for the time or the temperature; else the only column with a unit of the quantity and a name that says
    nothing.  doubtful : as in `nearest`; a unit alone then does not count."""
    found = nearest(quantity, [name for name in header if name != TEMPERATURE], doubtful)
    if found is None and quantity == "time_s":
        found = next((name for name in header if re.search(STAMP, plain(name))), None)
    may_be_t = quantity in {"time_s", "temperature_degc"} and TEMPERATURE in header
    if found is None and not may_be_t and not doubtful:
        return _by_unit(quantity, header)
    return TEMPERATURE if found is None and may_be_t else found


def _by_unit(quantity: str, header: Sequence[str]) -> str | None:
    """The one column that has a unit of the quantity in brackets or behind a slash and a name that says nothing."""
    named = [name for name in header if not any(_is_like(other, name) for other in LIKELY)]
    of_unit = [
        name
        for name in named
        if units.spelt(quantity, marked_unit(name)) and not re.search(UNLIKELY[quantity], plain(name))
    ]
    return of_unit[0] if len(of_unit) == 1 else None


def temperatures(header: Sequence[str]) -> list[str]:
    """The columns that look like temperatures, of cell or surroundings; the most likely cell temperature first."""
    like = [name for name in header if _is_like("temperature_degc", name)]
    return sorted(
        (name for name in like if not re.search(NO_TEMPERATURE, plain(name))),
        key=lambda name: _doubt("temperature_degc", name),
    )


def stem(name: str) -> str:
    """A column's name without its unit."""
    found = UNIT.search(name)
    # The last word is removed only where it is a unit: T_chamber is not T.
    is_unit = found is not None and (found.group(3) is None or _spelt_anywhere(found.group(3)))
    return plain(name[: found.start()] if found is not None and is_unit else name)


def _spelt_anywhere(text: str) -> bool:
    return any(units.spelt(quantity, text) is not None for quantity in units.SPELLINGS)


def sign_in(name: str) -> Sign | None:
    """The direction in which a current is positive by its name, such as 'I (chg+)'; None where it does not say."""
    found = DIRECTION.search(name)
    if found is None or not (mark := found.group(1) or found.group(3)):
        return None
    on_charge = found.group(2).lower().startswith(("ch", "lad"))
    return "charge-positive" if on_charge != (mark.lower() in ("-", "neg")) else "discharge-positive"


def unit_in(name: str) -> str:
    """The unit in a column's name, such as 'I[mA]', 'Current (mA)', 'Voltage / mV', 'time_ms'; '' without one."""
    found = UNIT.search(_unsigned(name))
    return next((text for text in found.groups() if text), "") if found else ""


def marked_unit(name: str) -> str:
    """What stands in brackets or behind a slash at the end of a column's name, where names hold their unit; '' without
    one. A last word alone, as in 'current_cell', and a number, as in '#1', need not be a unit."""
    found = None if NO_NAME.fullmatch(name) else UNIT.search(_unsigned(name))
    return next((text for text in found.groups()[:2] if text), "") if found else ""


def _unsigned(name: str) -> str:
    """The name without the direction at its end."""
    return name if sign_in(name) is None else DIRECTION.sub("", name).strip()


def is_rate_or_power(name: str) -> bool:
    """True for the name of a column that looks like a current but is a C-rate or a power."""
    return re.search(RATE_OR_POWER, plain(name)) is not None


def unit_of(quantity: str, name: str) -> str | None:
    """The unit of the quantity that a column's name has, or is, as `--unit` takes it; None without one."""
    return units.spelt(quantity, unit_in(name) or _unsigned(name))


def options(quantities: Iterable[str], header: Sequence[str]) -> str:
    """The options that map the quantities to the most likely columns, with their units where these are not SI."""
    return " ".join(of_column(quantity, likeliest(quantity, header) or "NAME") for quantity in quantities)


def of_column(quantity: str, name: str) -> str:
    """The options that map a quantity to one column, with its unit where that is not SI."""
    unit = unit_of(quantity, name)
    declared = f" --unit {quantity}={unit}" if unit is not None and unit != units.SI[quantity] else ""
    return f'--column {quantity}="{name}"{declared}'


def _doubt(quantity: str, name: str) -> tuple[bool, bool, int]:
    """Sort key: the most likely column first."""
    text, unit = plain(name), unit_of(quantity, name)
    unlikely = bool(re.search(UNLIKELY[quantity], text))
    of_step = quantity == "time_s" and not re.search(WHOLE_TIME, text)
    return unlikely, of_step, 0 if unit == units.SI.get(quantity) else 1 if unit else 2


def _is_like(quantity: str, name: str) -> bool:
    """Whether the name may be that of the quantity. T and a unit of temperature, as T/K, is no time."""
    symbol = name.strip().startswith(TEMPERATURE) and stem(name) == plain(TEMPERATURE)
    if symbol and unit_of("temperature_degc", name) is not None:
        return quantity == "temperature_degc"
    return re.search(LIKELY[quantity], plain(name)) is not None
