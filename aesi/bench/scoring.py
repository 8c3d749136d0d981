"""Scoring of an answer: strictly (the exact name, or the name in a small group, and no further name) and leniently."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

LARGEST_GROUP = 3
"""A group of look-alikes with more members than this does not count as a name."""
NOTHING = "reaction_nonuniformity"
"""Effect of the order reduction: on a cell that is as declared, naming it counts as naming nothing."""
TWINS = frozenset({frozenset({"leakage_current", "current_sensor_offset"})})
"""Effects that are identical in current and voltage: a current through the cell but not the sensor. Naming either, with
the other in its group, is exact."""
CERTAIN = 0.95
"""Confidence of every interval of a rate (Clopper and Pearson 1934, exact)."""
TO_THE_NOISE = 1.1
"""Multiple of the noise up to which an error on unseen data counts as noise."""
TENTHS = 10
"""Number of bins of confidence."""


@dataclass(frozen=True)
class Judgement:
    """The scores of an answer against the label.

    exact : all effects by their names and no others; verdict `none` or `unknown` without a name where that is the
    label.  grouped : the same, where an effect may also be a member of the group of a named one.
    named : share of the label's effects that are named or in such a group.  false_names : names of effects that are not
    present, for any verdict.  lenient : as grouped, or one of the other answers listed as right.
    """

    exact: bool
    grouped: bool
    named: float
    false_names: tuple[str, ...]
    lenient: bool


def judge(label: str, also: Sequence[str], neutral: Collection[str], content: Mapping[str, Any]) -> Judgement:
    """Judge an answer.

    label : 'none', 'unknown' or effects joined by '+'.  also : answers that the lenient judge takes.  neutral :
    names that are neither right nor wrong.  content : the answer, as `discovery.json` has it.
    """
    verdict = str(content["verdict"])
    said = [name for name in content["effects"] if name not in neutral]
    stands_for = {name: _group(name, content["indistinguishable"]) for name in said}
    lenient = is_right(label, tuple(also), content)
    if label in ("none", "unknown"):
        silent = not said and (verdict == label or (label == "none" and verdict == "found"))
        return Judgement(silent, silent, 0.0, tuple(said), lenient or silent)
    wanted = label.split("+")
    grouped = [name for name in wanted if any(name in group for group in stands_for.values())]
    exactly = [name for name in wanted if name in said or _twin(name, stands_for)]
    false = tuple(name for name in said if not stands_for[name] & set(wanted))
    alone = verdict == "found" and not false and len(said) == len(wanted)
    return Judgement(
        exact=alone and len(exactly) == len(wanted),
        grouped=alone and _assignable(wanted, list(stands_for.values())),
        named=len(grouped) / len(wanted),
        false_names=false,
        lenient=lenient or (alone and len(grouped) == len(wanted)),
    )


def _group(name: str, groups: Sequence[Sequence[str]]) -> set[str]:
    """A name and its look-alikes, where they are few enough."""
    found = {name}.union(*(group for group in groups if name in group))
    return found if len(found) <= LARGEST_GROUP else {name}


def _twin(name: str, stands_for: Mapping[str, set[str]]) -> bool:
    return any(frozenset({name, said}) in TWINS and name in group for said, group in stands_for.items())


def is_right(label: str, also: tuple[str, ...], content: Mapping[str, Any]) -> bool:
    """True where the answer matches the label, or one of the other answers listed as right.

    Effects match where each effect of the label is named or in the group of a named one, no other is named, and no
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


@dataclass(frozen=True)
class Rate:
    """A share in per cent with its exact 95 % interval; None where there were no cases."""

    pct: float | None
    interval_pct: tuple[float, float] | None
    cases: int

    def named(self, name: str) -> dict[str, Any]:
        """`name_pct`, `name_95_pct` (low, high) and `name_cases`."""
        interval = list(self.interval_pct) if self.interval_pct else None
        return {f"{name}_pct": self.pct, f"{name}_95_pct": interval, f"{name}_cases": self.cases}


def rate(rows: Sequence[Mapping[str, Any]], key: str) -> Rate:
    """Share of rows where `key` is true."""
    return proportion(sum(bool(row[key]) for row in rows), len(rows))


def proportion(hits: int, cases: int) -> Rate:
    """hits of cases, with the interval."""
    from scipy.stats import binomtest

    if not cases:
        return Rate(None, None, 0)
    interval = binomtest(hits, cases).proportion_ci(CERTAIN, method="exact")
    low, high = (round(100.0 * float(end), 1) for end in (interval.low, interval.high))
    return Rate(round(100.0 * hits / cases, 1), (low, high), cases)


def calibration(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Confidence shown against the frequency of being right, by tenths of the confidence; empty tenths left out."""
    found = []
    for tenth in range(TENTHS):
        part = [
            r for r in rows if r.get("confidence") is not None and _tenth(float(r["confidence"])) == tenth
        ]
        if part:
            shown = float(np.mean([r["confidence"] for r in part]))
            found.append({"shown_pct": round(100.0 * shown, 1), **rate(part, "grouped").named("right")})
    return found


def _tenth(confidence: float) -> int:
    return min(int(TENTHS * confidence), TENTHS - 1)
