"""A finding with its size: '8.0 mohm [7.9, 8.1] more series resistance', from the content of discovery.json."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor, log10
from typing import Any

from aesi.parameters import Parameter
from aesi.physics.effects import CATALOGUE

SAME_SHARE = 0.98
"""A finding that leaves more than this share of the error of a refit is no better than the refit."""
TELLING = 1.0
"""Standard deviations of its tolerance: a parameter that a refit moved by less counts as declared."""
MOST_PARAMETERS = 3
"""Of an effect, in one sentence."""
PREFIXES = {"ohm": ("mohm", 1e3), "V": ("mV", 1e3), "A": ("mA", 1e3), "m": ("um", 1e6)}
"""Unit -> that of its thousandths or millionths, and how many make one."""
SMALL = 0.5
"""In its own unit; what is less is written in thousandths."""


def with_size(effect: str, discovery: Mapping[str, Any], title: str | None = None) -> str:
    """The effect's name with its fitted parameters and their 90 % intervals; the name alone where there are none."""
    name = title or effect.replace("_", " ")
    row = next((c for c in discovery["candidates"] if c["effect"] == effect), None)
    known = CATALOGUE[effect].parameters if effect in CATALOGUE else {}
    fitted = dict(row.get("parameters", {})) if row else {}
    told = {key: value for key, value in fitted.items() if _tells(value, known.get(key))} or fitted
    if not told:
        return name
    ((key, value), *others) = told.items()
    if not others and value["unit"] != "dimensionless":
        if row and (said := _instead(value, known.get(key), discovery)):
            return f"{name} ({said})"
        if row and row["kind"] != "physics":  # what is off, or lies, is not had more or less of
            return f"{name} ({quantity(value)})"
        parameter = known.get(key)
        more = " more" if parameter is not None and parameter.counted == "added" else " of"
        return f"{quantity(value)}{more} {name}"
    parts = [_part(key, value, known.get(key)) for key, value in list(told.items())[:MOST_PARAMETERS]]
    rest = ", ..." if len(told) > MOST_PARAMETERS else ""
    return f"{name} ({', '.join(parts)}{rest})"


def _instead(value: Mapping[str, Any], parameter: Parameter | None, discovery: Mapping[str, Any]) -> str:
    """'14.0 degC [12.1, 15.9] instead of 25 degC', of a parameter that is how far something is from what was declared;
    '' of any other."""
    key = parameter.shift_of if parameter else ""
    if key not in discovery:
        return ""
    declared, unit = discovery[key], "degC" if key.endswith("_degc") else value["unit"]
    there = {end: declared + value[end] for end in ("value", "low", "high")}
    return f"{quantity({**there, 'unit': unit})} instead of {declared:.4g} {unit}"


def quantity(value: Mapping[str, Any]) -> str:
    """A value with its interval and unit: '8.0 mohm [7.9, 8.1]'."""
    unit, factor = value["unit"], 1.0
    largest = max(abs(value[key]) for key in ("value", "low", "high"))
    if unit in PREFIXES and largest < SMALL:
        unit, factor = PREFIXES[unit]
    digits = _digits(factor * (value["high"] - value["low"]), factor * value["value"])
    middle, low, high = (f"{factor * value[key]:.{digits}f}" for key in ("value", "low", "high"))
    shown = "" if unit == "dimensionless" else f" {unit}"
    return f"{middle}{shown} [{low}, {high}]"


def rounded(value: float, unit: str) -> str:
    """A value with its unit to two digits, in thousandths where it is small: '3.1 mohm'."""
    factor = 1.0
    if unit in PREFIXES and abs(value) < SMALL:
        unit, factor = PREFIXES[unit]
    return f"{factor * value:.2g} {unit}"


def finding_line(discovery: Mapping[str, Any]) -> str:
    """The verdict in one line, with what was found and how much of it; a confidence where it belongs to a name."""
    effects = [with_size(effect, discovery) for effect in discovery["effects"]]
    verdict = discovery["verdict"]
    if verdict == "none":
        return "none: nothing is missing that these data could show"
    if verdict == "unknown":
        explain = "explains" if len(effects) == 1 else "explain"
        named = f"{', '.join(effects)} {explain} a part; " if effects else ""
        return f"unknown: {named}something real is left{unexplained_by(discovery)}"
    if refit_does_as_well(discovery):
        return f"one of two explanations: {', '.join(effects)}; or the model's own parameters, whose refit does as well"
    return f"found: {', '.join(effects)}"


def unexplained_by(discovery: Mapping[str, Any]) -> str:
    """What goes on after 'something real': ' that no effect of the catalogue explains', or which of them were tried."""
    tried = discovery.get("tried", CATALOGUE)
    if not tried:
        return "; no effect was tried on it"
    if set(tried) >= {name for name, effect in CATALOGUE.items() if effect.refines is None}:
        return " that no effect of the catalogue explains"
    if len(tried) == 1:
        return f" that {tried[0].replace('_', ' ')}, which alone was tried, does not explain"
    return f" that none of the {len(tried)} effects that were tried explains"


def refit_does_as_well(discovery: Mapping[str, Any]) -> bool:
    """Whether the declared model with its own parameters refitted leaves as little of unseen data as the finding, and
    by other means: a refit that moved what was found, and nothing else, is the same explanation."""
    own, after = (
        discovery.get(state, {}).get("test", {}).get("rmse_mv") for state in ("recalibrated", "after")
    )
    if own is None or after is None or after <= SAME_SHARE * own:
        return False
    rows = discovery.get("own_parameters", {}).get("recalibrated", ())
    moved = {row["effect"] for row in rows if abs(row["deviations"]) > TELLING}
    return not moved or not moved <= set(discovery["effects"])


def _tells(value: Mapping[str, Any], parameter: Parameter | None) -> bool:
    """Whether a parameter differs from the value at which it does nothing, and is not all of its range."""
    if parameter is None:
        return True
    low, high = parameter.bounds
    if parameter.neutral is None:
        return False
    return not value["low"] <= parameter.neutral <= value["high"] and (value["low"], value["high"]) != (
        low,
        high,
    )


def _part(key: str, value: Mapping[str, Any], parameter: Parameter | None) -> str:
    if parameter is not None and parameter.counted == "share":
        percent = {end: 100 * value[end] for end in ("value", "low", "high")}
        return f"{quantity({**percent, 'unit': '%'})} {parameter.description.removeprefix('share ')}"
    words = key.rsplit("_", 1)[0].replace("_", " ") if key.endswith(("_v", "_a", "_k", "_s", "_ohm")) else key
    words = words.replace("_factor", "").replace("_", " ")
    times = " times" if parameter is not None and parameter.neutral == 1.0 else ""
    return f"{words} {quantity(value)}{times}"


def _digits(width: float, value: float) -> int:
    """Decimals that show the interval's width to two digits, or the value to three where it has none."""
    scale = width if width > 0 else abs(value) / 10.0
    if scale <= 0:
        return 1
    return max(0, min(6, 1 - floor(log10(scale))))
