"""What an answer is worth: the name, the size, and the initial state, against what is known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aesi.physics.effects import CATALOGUE
from aesi.tracer.case.free_parameter import STATE_OF_CHARGE

GROUP_OF = 2
"""A name counts where it is given, or is one of a group of so many."""


def scored(
    answers: tuple[str, ...], truth: Mapping[str, float], content: Mapping[str, Any]
) -> dict[str, Any]:
    """What the answer (as in discovery.json) is worth.

    named : a right name is given, or is one of a group of two with one that is; with no right name, that none is
    given.  size_* : of the parameter whose truth is known.
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
    for state in ("before", "recalibrated", "after"):
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
            neutral = CATALOGUE[candidate["effect"]].parameters[name].neutral or 0.0
            interval = estimate["low"], estimate["high"]
            return {
                "parameter": key,
                "size_true": true,
                "size_found": value,
                "size_low": estimate["low"],
                "size_high": estimate["high"],
                "size_neutral": neutral,
                "size_error": abs(value - true) / abs(true - neutral),
                "size_covered": None not in interval and bool(interval[0] <= true <= interval[1]),
            }
    return {}


def initial_state_row(told: float, true: float, content: Mapping[str, Any]) -> dict[str, Any]:
    """How much of a wrong initial state of charge the fit of the first record took back; nothing of it where the model
    stayed as declared."""
    rows = content["own_parameters"]["after"]
    moved = next((row["value"] for row in rows if row["effect"] == STATE_OF_CHARGE), told)
    return {
        "parameter": "initial state of charge",
        "size_true": true - told,
        "size_found": moved - told,
        "size_neutral": 0.0,
        "size_error": abs(moved - true) / abs(true - told),
    }
