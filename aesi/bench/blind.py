"""Does the tracer name what is missing? Labelled cases that PyBaMM made, the label kept from the tracer.

A row a case, and a summary with the confusion matrix and the rates that count: right effects (or declared
indistinguishable from them), honest silence on cells that lack nothing, `unknown` where no effect of the
catalogue is at
work, the error left over and how well the parameters are met.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aesi.data.blind import BlindCase, CaseSpec, cells_in, generate, plan, small_plan
from aesi.errors import AesiError
from aesi.physics import Cell
from aesi.pipeline.discovery.discover import to_json
from aesi.tracer import discover

MV = 1e3
LARGEST_GROUP = 3
NOTHING = "reaction_nonuniformity"
"""What the order reduction leaves out counts as nothing missing on a cell that is as declared."""


def chosen(
    cases: int | None = None, only: str | None = None, small: bool = False, seed: int = 0, every: int = 1
) -> list[CaseSpec]:
    """Cases of the plan, or of the small one that a test can afford.

    cases : how many (None: all).  only : substring of a recipe's name.  every : take each n-th case.
    """
    specs = small_plan(seed) if small else plan(seed)
    return [s for s in specs if only is None or only in "+".join(s.recipes)][::every][:cases]


def judged(spec: CaseSpec, cells: str) -> dict[str, Any]:
    """One case made and judged; cells : folder of the two declared cell files."""
    return _judged(generate(spec, cells_in(Path(cells))))


def _judged(case: BlindCase) -> dict[str, Any]:
    began = time.perf_counter()
    row: dict[str, Any] = {
        "case": case.spec.name,
        "cell": case.spec.cell,
        "label": case.label,
        "also": list(case.also),
        "target_mv": case.spec.target_mv,
    }
    try:
        found = discover(Cell.from_bpx(case.declared), case.measurements, soc0=case.soc0)
    except AesiError as error:
        return row | {
            "verdict": "error",
            "right": False,
            "error": str(error),
            "ours_s": time.perf_counter() - began,
        }
    content = to_json(found)
    row |= {
        k: content[k] for k in ("verdict", "effects", "indistinguishable", "confidence", "noise_floor_mv")
    }
    row |= {
        f"{state}_test_mv": content[state]["test"]["rmse_mv"] for state in ("before", "recalibrated", "after")
    }
    row["right"] = is_right(case.label, case.also, content)
    row["parameter_error"] = _parameter_error(case, content)
    return row | {"ours_s": time.perf_counter() - began}


def is_right(label: str, also: tuple[str, ...], content: Mapping[str, Any]) -> bool:
    """Is this the answer of the label, or one of the others that are right as well?

    Effects match where each one of the label is named or in the group of one that is, none is named beyond
    them, and no
    group has more than three members.
    """
    return any(_matches(answer, content) for answer in (label, *also))


def _matches(answer: str, content: Mapping[str, Any]) -> bool:
    verdict, effects = content["verdict"], list(content["effects"])
    if answer in ("none", "unknown"):
        return bool(verdict == answer)
    if answer == NOTHING and verdict == "none":
        return True
    groups = [set(g) for g in content["indistinguishable"]]
    if verdict != "found" or any(len(g) > LARGEST_GROUP for g in groups):
        return False
    wanted = answer.split("+")
    if len(wanted) != len(effects):
        return False
    stands_for = [{e}.union(*(g for g in groups if e in g)) for e in effects]
    return _assignable(wanted, stands_for)


def _assignable(wanted: list[str], stands_for: list[set[str]]) -> bool:
    if not wanted:
        return True
    first, rest = wanted[0], wanted[1:]
    return any(
        first in names and _assignable(rest, [*stands_for[:k], *stands_for[k + 1 :]])
        for k, names in enumerate(stands_for)
    )


def _parameter_error(case: BlindCase, content: Mapping[str, Any]) -> float | None:
    """Largest relative error among the parameters whose truth is known under the same name, or None."""
    errors = []
    for candidate in content["candidates"]:
        if candidate["effect"] not in content["effects"]:
            continue
        for name, estimate in candidate["parameters"].items():
            truth = case.truth.get(f"{candidate['effect']}.{name}")
            if truth:
                errors.append(abs(estimate["value"] - truth) / abs(truth))
    return max(errors) if errors else None


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Rates by kind of case, medians, and the confusion matrix (label -> answer -> cases)."""
    kinds = {"effect": [], "none": [], "unknown": []}  # type: dict[str, list[dict[str, Any]]]
    for row in rows:
        kinds[row["label"] if row["label"] in ("none", "unknown") else "effect"].append(row)
    found = [r for r in kinds["effect"] if r["right"] and r["verdict"] == "found"]
    left = [r["after_test_mv"] / r["noise_floor_mv"] for r in found]
    errors = [r["parameter_error"] for r in found if r.get("parameter_error") is not None]
    confusion: dict[str, Counter[str]] = {}
    for row in rows:
        answer = "+".join(row.get("effects") or []) if row["verdict"] == "found" else row["verdict"]
        confusion.setdefault(row["label"], Counter())[answer] += 1
    return {
        "summary": True,
        "cases": len(rows),
        **{f"{kind}_right_pct": _share(part) for kind, part in kinds.items()},
        **{f"{kind}_cases": len(part) for kind, part in kinds.items()},
        "after_over_noise_median": float(np.median(left)) if left else None,
        "parameter_error_median": float(np.median(errors)) if errors else None,
        "seconds_median": float(np.median([r["ours_s"] for r in rows])) if rows else None,
        "confusion": {label: dict(counts) for label, counts in confusion.items()},
    }


def _share(rows: list[dict[str, Any]]) -> float | None:
    return 100.0 * sum(bool(r["right"]) for r in rows) / len(rows) if rows else None
