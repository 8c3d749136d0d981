"""Sentences on the declared parameters that a refit moved, from the content of discovery.json."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from aesi.advice import listed
from aesi.constants import PERCENT
from aesi.pipeline.report.views import Row
from aesi.pipeline.report.words.discoveries import WITH_FINDING, states_of
from aesi.pipeline.report.words.sizes import (
    TELLING,
    capitalised,
    name_words,
    resized,
    rounded,
    two_digits,
)
from aesi.tracer.case.free_parameter import CAPACITY_SHARE, STATE_OF_CHARGE

MOST_NAMED = 3
"""Parameters that one sentence names."""
MOST_DIGITS = 6
"""Most digits: a state of charge is known to a ten-thousandth at best."""
OF_A_RECORD = {
    STATE_OF_CHARGE: "the initial state of charge of {}",
    CAPACITY_SHARE: "the share of its capacity that the cell had in {}",
}
"""Owner of a parameter that belongs to a record -> words in place of an effect."""
PURE = ("dimensionless", "1")
"""Units of plain numbers: of a parameter of an effect, of one of a record."""
RECALIBRATING, BESIDE, WRITTEN = "Recalibration", "The fit with the finding", "The fit of the written model"


def moved_findings(discovery: Mapping[str, Any]) -> list[str]:
    """A sentence for the recalibrated model and, where something was found, one for the model with it: what moved most,
    and what ended at the end of its range; none where nothing was fitted."""
    own = discovery.get("own_parameters", {})
    shown, after = {"recalibrated": RECALIBRATING}, states_of(discovery).get("after")
    if after is not None:
        shown["after"] = BESIDE if after == WITH_FINDING else WRITTEN
    moved = [_sentence(words, own[state]) for state, words in shown.items() if own.get(state)]
    return [*moved, *filter(None, [resized_finding(discovery)])]


def resized_finding(discovery: Mapping[str, Any]) -> str:
    """A sentence with both sizes where the written model has what was found at another size; '' where it has not."""
    sizes = [one for effect in discovery["effects"] for one in resized(effect, discovery)]
    if not sizes:
        return ""
    found, there = (listed([f"{name} {sizes_of[place]}" for name, *sizes_of in sizes]) for place in (1, 0))
    return (
        f"The finding and model/ differ in size: {found} in the finding, where the file's parameters are as declared; "
        f"{there} in model/, where they are refitted as well."
    )


def _sentence(words: str, rows: Sequence[Row]) -> str:
    furthest = [row for row in rows if abs(row["deviations"]) > TELLING]
    if not furthest:
        return f"{words} moves no declared parameter by more than one standard deviation of its prior in this fit."
    named = "; ".join(_moved(row) for row in furthest[:MOST_NAMED])
    rest = len(furthest) - MOST_NAMED
    more = f"; and {rest} more" if rest > 0 else ""
    text = f"{words} moves {named}{more}."
    ended = [parameter_words(row) for row in rows if row["at_limit"]]
    if ended:
        bound = "its bound, and its value is" if len(ended) == 1 else "their bounds, and their values are"
        text += f" {capitalised(listed(ended))} ended on {bound} not determined by the data."
    return text


def _moved(row: Row) -> str:
    times = f"{abs(row['deviations']):.1f} standard deviations of {deviation_words(row)} each"
    return f"{parameter_words(row)} {'by' if _is_change(row) else 'to'} {moved_value(row)} ({times})"


def deviation_words(row: Row) -> str:
    """Words for one standard deviation of what a fit allows a parameter: '0.30 mV', '26 %' of a factor."""
    if row["unit"] == "dimensionless" and row["declared"] == 1.0:
        return f"{two_digits(PERCENT * row['one_sd'])} %"
    return two_digits(row["one_sd"]) if row["unit"] in PURE else rounded(row["one_sd"], row["unit"])


def _is_change(row: Row) -> bool:
    """Whether a parameter is what an effect puts on top of what the file holds, none as declared."""
    return row["declared"] == 0.0 and row["unit"] not in PURE


def moved_value(row: Row) -> str:
    """Words for where a parameter went, or by how much: '0.42 times declared', '0.97 (declared 1)', '+3.1 mohm'.

    A state of charge is not declared: it was read from a voltage, or given."""
    if row["unit"] == "dimensionless" and row["declared"] == 1.0:
        return f"{_apart(row['value'], 1.0, least=2)[0]} times declared"
    if row["unit"] in PURE:
        there, declared = _apart(row["value"], row["declared"])
        return f"{there} ({'from' if row['effect'] == STATE_OF_CHARGE else 'declared'} {declared})"
    sign = "+" if _is_change(row) and row["value"] > 0.0 else ""
    return sign + rounded(row["value"], row["unit"])


def _apart(value: float, declared: float, least: int = 3) -> tuple[str, str]:
    """Both in as few digits as show that they differ."""
    for digits in range(least, MOST_DIGITS):
        if f"{value:.{digits}g}" != f"{declared:.{digits}g}":
            return f"{value:.{digits}g}", f"{declared:.{digits}g}"
    return f"{value:.{MOST_DIGITS}g}", f"{declared:.{MOST_DIGITS}g}"


def parameter_words(row: Row) -> str:
    """'solid diffusivity (negative)', 'the initial state of charge of drive'."""
    if row["effect"] in OF_A_RECORD:
        return OF_A_RECORD[row["effect"]].format(row["parameter"])
    effect, name = row["effect"].replace("_", " "), row["parameter"]
    if name.rpartition("_")[0] in row["effect"]:  # 'resistance_ohm' of 'series_resistance' says nothing more
        return str(effect)
    return f"{effect} ({name_words(name, row['unit'])})"


def moved_summary(rows: Iterable[Row]) -> str:
    """All that moved by more than a standard deviation on one line, for a tag of a tracked run."""
    told = [row for row in rows if abs(row["deviations"]) > TELLING]
    return "; ".join(f"{parameter_words(r)} {moved_value(r)}" for r in told)
