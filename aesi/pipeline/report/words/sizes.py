"""A finding with its size: '8.0 mohm [7.9, 8.1] more series resistance', from the content of discovery.json."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import Any

import numpy as np

from aesi.advice import listed
from aesi.constants import PERCENT
from aesi.parameters import Parameter
from aesi.physics.effects import CATALOGUE

SAME_SHARE = 0.98
"""A finding that leaves more than this share of the error of a refit is no better than the refit."""
TELLING = 1.0
"""Standard deviations of what a refit allows a parameter that it has to move it by; moved by less it counts as
declared."""
MOST_PARAMETERS = 3
"""Most parameters of an effect in one sentence."""
PREFIXES = {"ohm": ("mohm", 1e3), "V": ("mV", 1e3), "A": ("mA", 1e3), "m": ("um", 1e6)}
"""Unit -> that of its thousandths or millionths, and how many make one."""
SMALL = 0.5
"""Values below this, in their own unit, are written in thousandths."""
TINY = 1e-4
"""Numbers below this, as they would be written, are written with an exponent."""
ENDINGS = {"ohm/(A*hour)": "_ohm_ah", "ohm/hour**0.5": "_ohm"}
"""Unit -> ending of a name that does not spell it out."""


def with_size(effect: str, discovery: Mapping[str, Any], title: str | None = None) -> str:
    """The effect's name with its fitted parameters and their 90 % intervals; the name alone where there are none."""
    name = title or effect.replace("_", " ")
    known, parameters = _known(effect), _shown_parameters(effect, discovery)
    if not parameters:
        return name
    ((key, value), *others) = parameters.items()
    if not others and value["unit"] != "dimensionless":
        if (shift := _declared_of(known.get(key), discovery)) is not None:
            declared, unit = shift
            return f"{name} ({quantity(_with_ends(value, 1.0, *shift))} instead of {declared:.4g} {unit})"
        if _row(effect, discovery)["kind"] != "physics":  # what is off, or lies, is not had more or less of
            return f"{name} ({quantity(value)})"
        parameter = known.get(key)
        more = " more" if parameter is not None and parameter.counted == "added" else " of"
        return f"{quantity(value)}{more} {name}"
    parts = [_part(key, value, known.get(key)) for key, value in list(parameters.items())[:MOST_PARAMETERS]]
    rest = ", ..." if len(parameters) > MOST_PARAMETERS else ""
    return f"{name} ({', '.join(parts)}{rest})"


def resized(effect: str, discovery: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The parameter of an effect that the written model has at another size than the finding, as far as one sees it:
    in words, its value there, and the finding's; ('ambient temperature', '14.0 degC', '11.8 degC')."""
    written = discovery.get("written_parameters", {}).get(effect, {})
    name, parameters, out = effect.replace("_", " "), _shown_parameters(effect, discovery), []
    for key, value in list(parameters.items())[:MOST_PARAMETERS]:
        if key not in written:
            continue
        parameter = _known(effect).get(key)
        times = PERCENT if _is_share(parameter) else 1.0
        declared, unit = _declared_of(parameter, discovery) or (
            0.0,
            "%" if _is_share(parameter) else value["unit"],
        )
        shown = _with_ends(value, times, declared, unit)
        unit, (there, found) = _digits_of(shown, [declared + times * written[key], shown["value"]])
        if there != found:
            words = name if len(parameters) == 1 else f"{name} ({name_words(key, value['unit'])})"
            out.append((words, f"{there}{unit}", f"{found}{unit}"))
    return out


def _row(effect: str, discovery: Mapping[str, Any]) -> Mapping[str, Any]:
    """The candidate's row of an effect; empty where it could not be tried."""
    return next((c for c in discovery.get("candidates", ()) if c["effect"] == effect), {})


def _known(effect: str) -> Mapping[str, Parameter]:
    return CATALOGUE[effect].parameters if effect in CATALOGUE else {}


def _shown_parameters(effect: str, discovery: Mapping[str, Any]) -> dict[str, Any]:
    """Name -> estimate, for the fitted parameters of an effect that are informative (`_is_informative`); for all of
    them if none is."""
    fitted, known = dict(_row(effect, discovery).get("parameters", {})), _known(effect)
    return {key: value for key, value in fitted.items() if _is_informative(value, known.get(key))} or fitted


def _declared_of(parameter: Parameter | None, discovery: Mapping[str, Any]) -> tuple[float, str] | None:
    """The declared value that a parameter shifts, with its unit; None for a parameter that is no shift."""
    key = parameter.shift_of if parameter else ""
    if parameter is None or key not in discovery:
        return None
    return discovery[key], "degC" if key.endswith("_degc") else parameter.unit


def _is_share(parameter: Parameter | None) -> bool:
    return parameter is not None and parameter.counted == "share"


def _with_ends(value: Mapping[str, Any], times: float, plus: float, unit: str) -> dict[str, Any]:
    """A value and its interval in another unit with another zero."""
    return {**{end: plus + times * value[end] for end in ("value", "low", "high")}, "unit": unit}


def quantity(value: Mapping[str, Any]) -> str:
    """A value with its interval and unit: '8.0 mohm [7.9, 8.1]'."""
    unit, (middle, low, high) = _digits_of(value, [value[key] for key in ("value", "low", "high")])
    return f"{middle}{unit} [{low}, {high}]"


def _digits_of(value: Mapping[str, Any], numbers: Sequence[float]) -> tuple[str, list[str]]:
    """The unit behind a number, with its space, and numbers in it, as precise as the value's interval."""
    unit, factor = value["unit"], 1.0
    largest = max(abs(value[key]) for key in ("value", "low", "high"))
    if unit in PREFIXES and largest < SMALL:
        unit, factor = PREFIXES[unit]
    digits = _digits(factor * (value["high"] - value["low"]), factor * value["value"])
    shown = "" if unit == "dimensionless" else f" {unit}"
    if 0.0 < factor * largest < TINY:
        return shown, [f"{factor * number:.2e}" for number in numbers]
    return shown, [f"{factor * number:.{digits}f}" for number in numbers]


def rounded(value: float, unit: str) -> str:
    """A value with its unit to two digits, in thousandths where it is small: '3.1 mohm'."""
    factor = 1.0
    if unit in PREFIXES and abs(value) < SMALL:
        unit, factor = PREFIXES[unit]
    return f"{two_digits(factor * value)} {unit}"


def two_digits(value: float) -> str:
    """A number to two digits, without an exponent up to a million: '170' and not '1.7e+02'."""
    return f"{float(f'{value:.2g}'):g}"


def capitalised(text: str) -> str:
    """With a capital letter, as a sentence begins."""
    return text[:1].upper() + text[1:]


def what_good_records_lack(discovery: Mapping[str, Any]) -> str:
    """Words on a verdict `none` beside known-good records: 'no error that new_drive, known to be good, does not show
    too'; '' without such records."""
    good = discovery.get("good", ())
    shows = "does" if len(good) == 1 else "do"
    return f"no error that {listed(good)}, known to be good, {shows} not show too" if good else ""


def finding_line(discovery: Mapping[str, Any]) -> str:
    """The verdict in one line, with what was found and how much of it; a confidence where it belongs to a name."""
    effects = [with_size(effect, discovery) for effect in discovery["effects"]]
    verdict = discovery["verdict"]
    if verdict == "none":
        beside = what_good_records_lack(discovery)
        return f"none: these data show {beside or 'nothing that the declared model lacks'}"
    if verdict == "unknown":
        named = f"{', '.join(effects)} {explain_part(effects, discovery)}" if effects else ""
        if effects and fit_explains(discovery):
            return f"unknown: {named}"
        return f"unknown: {named}{'; ' if named else ''}a systematic error remains{unexplained_by(discovery)}"
    if refit_does_as_well(discovery):
        return f"one of two explanations: {', '.join(effects)}; or the model's own parameters, whose refit fits as well"
    return f"found: {', '.join(effects)}"


def fit_explains(discovery: Mapping[str, Any]) -> bool:
    """Whether a fit leaves no more of data that were left out of it than a right model may; an `unknown` then says that
    this fit is not to be relied on."""
    return bool(discovery.get("structured_mv", np.inf) <= discovery.get("tolerance_mv", 0.0))


def explain_part(names: Sequence[str], discovery: Mapping[str, Any]) -> str:
    """The predicate of effects that are named with an `unknown`."""
    explain = "explains" if len(names) == 1 else "explain"
    if fit_explains(discovery):
        return f"{explain} the error, but other explanations are not excluded"
    return f"{explain} a part of the error"


def unexplained_by(discovery: Mapping[str, Any]) -> str:
    """Words after 'a systematic error remains': ' that no effect of the catalogue explains', or which of them were
    tried, that what explains it is not to be relied on, or that the good records beside the others seem to be of
    another age."""
    aged = discovery.get("of_another_age", ())
    if aged:
        return f" that {aged[0].replace('_', ' ')} explains if the good records are of another age"
    tried = discovery.get("tried", CATALOGUE)
    if not tried:
        return "; no effect was tried"
    if fit_explains(discovery):
        return " that a fit explains, but not one to be relied on"
    if set(tried) >= {name for name, effect in CATALOGUE.items() if effect.refines is None}:
        return " that no effect of the catalogue explains"
    if len(tried) == 1:
        return f" that {tried[0].replace('_', ' ')}, which alone was tried, does not explain"
    return f" that none of the {len(tried)} effects that were tried explains"


def refit_does_as_well(discovery: Mapping[str, Any]) -> bool:
    """Whether the declared model with its own parameters refitted leaves as little of unseen data as the finding,
    and by other means: a refit that moved nothing but what was found is the same explanation."""
    own, after = (
        discovery.get(state, {}).get("test", {}).get("rmse_mv") for state in ("recalibrated", "after")
    )
    if own is None or after is None or after <= SAME_SHARE * own:
        return False
    rows = discovery.get("own_parameters", {}).get("recalibrated", ())
    moved = {row["effect"] for row in rows if abs(row["deviations"]) > TELLING}
    return not moved or not moved <= set(discovery["effects"])


def _is_informative(value: Mapping[str, Any], parameter: Parameter | None) -> bool:
    """Whether the 90 % interval of a parameter leaves out the value at which it has no effect, and is not the whole
    range of the parameter."""
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
    if parameter is not None and _is_share(parameter):
        percent = _with_ends(value, PERCENT, 0.0, "%")
        return f"{quantity(percent)} {parameter.description.removeprefix('share ')}"
    factor = key.endswith("_factor") or (parameter is not None and parameter.neutral == 1.0)
    times = " times" if factor else ""
    return f"{name_words(key, value['unit'])} {quantity(value)}{times}"


def name_words(key: str, unit: str) -> str:
    """A parameter's name without its unit: 'negative' of 'negative_f_m2', in F/m**2."""
    ending = "_" + re.sub(r"[^a-z0-9]+", "_", unit.lower().replace("**", "")).strip("_")
    words = key.removesuffix(ENDINGS.get(unit, ending))
    return words.replace("_factor", "").replace("_", " ")


def _digits(width: float, value: float) -> int:
    """Decimals that show the interval's width to two digits, or the value to three where it has none."""
    scale = width if width > 0 else abs(value) / 10.0
    if scale <= 0:
        return 1
    return max(0, min(6, 1 - floor(log10(scale))))
