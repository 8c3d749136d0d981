"""Scores of an answer of the tracer on a measured cell: the named effect, its size, and the initial state of charge."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aesi.bench.scoring import neutral_value, size_error
from aesi.tracer.case.free_parameter import STATE_OF_CHARGE
from aesi.tracer.report.outcome import STATES

GROUP_OF = 2
"""Most members of a group of look-alikes in which a right effect counts as named. A convention."""


def answer_scores(
    answers: tuple[str, ...], truth: Mapping[str, float], content: Mapping[str, Any]
) -> dict[str, Any]:
    """The scores of one answer, as entries of the row of its case.

    answers : effects each of which is right; empty if no effect may be named.  truth : `effect.parameter` -> true
    value, SI.  content : the answer as in `discovery.json`.
    `named` : a right effect is named, or is a look-alike of a named one in a group of at most GROUP_OF; if `answers` is
    empty, no effect is named.  `others` : named effects that are not right.  `size_*` : estimated and true value of the
    parameter whose truth is known, in its own unit, and the error relative to the distance from no effect.
    """
    effects = list(content["effects"])
    groups = {
        name: {name}.union(*(g for g in content["indistinguishable"] if name in g and len(g) <= GROUP_OF))
        for name in effects
    }
    hit = [name for name, group in groups.items() if group & set(answers)]
    named = bool(hit) if answers else not effects
    row: dict[str, Any] = {
        key: content[key] for key in ("verdict", "effects", "indistinguishable", "confidence", "margin")
    }
    for state in STATES:
        row[f"{state}_test_mv"] = content[state]["test"].get("rmse_mv")
    return row | {
        "named": named,
        "others": [name for name in effects if name not in hit],
        **_size(truth, content),
    }


def _size(truth: Mapping[str, float], content: Mapping[str, Any]) -> dict[str, Any]:
    for candidate in content["candidates"]:
        if candidate["effect"] not in content["effects"]:
            continue
        for name, estimate in candidate["parameters"].items():
            key = f"{candidate['effect']}.{name}"
            if key not in truth or estimate["value"] is None:
                continue
            true, value = truth[key], float(estimate["value"])
            neutral = neutral_value(candidate["effect"], name)
            interval = estimate["low"], estimate["high"]
            return {
                "parameter": key,
                "size_true": true,
                "size_found": value,
                "size_low": estimate["low"],
                "size_high": estimate["high"],
                "size_neutral": neutral,
                "size_error": size_error(value, true, neutral),
                "size_covered": None not in interval and bool(interval[0] <= true <= interval[1]),
            }
    return {}


def initial_state_row(record: str, given: float, true: float, content: Mapping[str, Any]) -> dict[str, Any]:
    """The `size_*` entries of a wrongly given initial state of charge: its true error, and how much of it the fit of
    the written model corrected on that record (nothing if the written model is the declared one).

    record : name of the record that it was given for; good records beside it have states of their own.  given : the
    state of charge that the tracer had, 0 to 1.  true : the right one.  content : the answer as in `discovery.json`.
    """
    rows = content["own_parameters"]["after"]
    own = (row for row in rows if (row["effect"], row["parameter"]) == (STATE_OF_CHARGE, record))
    moved = next((row["value"] for row in own), given)
    return {
        "parameter": "initial state of charge",
        "size_true": true - given,
        "size_found": moved - given,
        "size_neutral": 0.0,
        "size_error": size_error(moved, true, given),
    }
