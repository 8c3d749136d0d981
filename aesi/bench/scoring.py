"""Scores of an answer of the tracer against the label of a case.

The strict scores require exactly the right names, and no further name: `exact` each effect by its own name, `grouped`
also by a look-alike in a small group. The lenient score also accepts the other answers that the case lists as right.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aesi.physics.effects import CATALOGUE

LARGEST_GROUP = 3
"""Most members of a group of look-alikes that counts as a name. A convention: a larger group says too little."""
NOTHING = "reaction_nonuniformity"
"""Effect by which the single-particle model differs from the porous electrode. Where it is the right answer, the
verdict `none` is right as well."""
TWINS = frozenset({frozenset({"leakage_current", "current_sensor_offset"})})
"""Pairs of effects that no record of current and voltage can distinguish: both are a current that flows through the
cell and not through the sensor. An answer with either of them, and the other in its group, counts as exact."""
CERTAIN = 0.95
"""Confidence level of the intervals of rates, which are exact (Clopper and Pearson, Biometrika 26, 1934, 404)."""
TO_THE_NOISE = 1.1
"""Multiple of the sensor noise up to which the error on held-out data counts as noise. A convention."""
TENTHS = 10
"""Number of bins of equal width over the confidence, 0 to 1."""


@dataclass(frozen=True)
class Judgement:
    """The scores of one answer against the label.

    exact : the answer names all effects of the label and no others; for the labels `none` and `unknown`, it has that
    verdict and names nothing.  grouped : the same, but an effect may also be a look-alike of a named one, in a group of
    at most LARGEST_GROUP.  named : share of the label's effects that are named or in such a group, 0 to 1.
    false_names : named effects that are not present, whatever the verdict.  lenient : the answer is right as in
    `grouped`, or is one of the other answers that the case lists as right.
    """

    exact: bool
    grouped: bool
    named: float
    false_names: tuple[str, ...]
    lenient: bool


def judge(label: str, also: Sequence[str], neutral: Collection[str], content: Mapping[str, Any]) -> Judgement:
    """The scores of one answer.

    label : 'none', 'unknown', or the ids of effects joined by '+'.  also : other answers that the lenient score
    accepts.  neutral : names that count neither as right nor as wrong.  content : the answer as in `discovery.json`.
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
    """The name with its look-alikes; the name alone if there are more than LARGEST_GROUP of them together."""
    found = {name}.union(*(group for group in groups if name in group))
    return found if len(found) <= LARGEST_GROUP else {name}


def _twin(name: str, stands_for: Mapping[str, set[str]]) -> bool:
    """Whether a named effect cannot be distinguished from this one in principle (TWINS) and lists it in its group."""
    return any(frozenset({name, said}) in TWINS and name in group for said, group in stands_for.items())


def is_right(label: str, also: tuple[str, ...], content: Mapping[str, Any]) -> bool:
    """Whether the answer matches the label or one of the other answers that are listed as right (`also`).

    Effects match if each effect of the label is named or in the group of a named one, no other effect is named, and no
    group has more than LARGEST_GROUP members.
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
    """Whether each wanted effect can be assigned to a named one of its own whose group contains it."""
    if not wanted:
        return True
    first, rest = wanted[0], wanted[1:]
    return any(
        first in names and _assignable(rest, [*stands_for[:k], *stands_for[k + 1 :]])
        for k, names in enumerate(stands_for)
    )


@dataclass(frozen=True)
class Rate:
    """A share of cases.  pct : per cent.  interval_pct : its exact 95 % interval, per cent.  cases : number of cases.
    The first two are None if there are no cases."""

    pct: float | None
    interval_pct: tuple[float, float] | None
    cases: int

    def named(self, name: str) -> dict[str, Any]:
        """The entries of a summary row: `NAME_pct`, `NAME_95_pct` ([low, high]) and `NAME_cases`."""
        interval = list(self.interval_pct) if self.interval_pct else None
        return {f"{name}_pct": self.pct, f"{name}_95_pct": interval, f"{name}_cases": self.cases}


def rate(rows: Sequence[Mapping[str, Any]], key: str) -> Rate:
    """Share of the rows in which the entry `key` is true."""
    return proportion(sum(bool(row[key]) for row in rows), len(rows))


def proportion(hits: int, cases: int) -> Rate:
    """The share hits / cases, rounded to 0.1 %, with its exact 95 % interval."""
    from scipy.stats import binomtest

    if not cases:
        return Rate(None, None, 0)
    interval = binomtest(hits, cases).proportion_ci(CERTAIN, method="exact")
    low, high = (round(100.0 * float(end), 1) for end in (interval.low, interval.high))
    return Rate(round(100.0 * hits / cases, 1), (low, high), cases)


def neutral_value(effect: str, parameter: str) -> float:
    """Value of a parameter at which its effect of the catalogue vanishes; 0 if it declares none."""
    return CATALOGUE[effect].parameters[parameter].neutral or 0.0


def size_error(value: float, true: float, neutral: float) -> float:
    """Error of an estimated size over the distance of the true one from the value without an effect: 1 where all of it
    is missed.  All in one unit; true and neutral differ."""
    return abs(value - true) / abs(true - neutral)


def median_of(rows: Sequence[Mapping[str, Any]], key: str) -> float | None:
    """Median of an entry over the rows that have it; None if none has."""
    values = [row[key] for row in rows if row.get(key) is not None]
    return float(np.median(values)) if values else None


def answer_words(row: Mapping[str, Any]) -> str:
    """The answer of a row: the named effects, behind the word `unknown` where that is the verdict; the verdict if there
    are none."""
    names = "+".join(row.get("effects", ()))
    return f"unknown: {names}" if names and row["verdict"] == "unknown" else names or str(row["verdict"])


def confusion(rows: Iterable[tuple[str, Mapping[str, Any]]]) -> dict[str, dict[str, int]]:
    """Confusion matrix: right answer -> given answer -> number of cases.  rows : each with its right answer."""
    counts: dict[str, Counter[str]] = {}
    for right, row in rows:
        counts.setdefault(right, Counter())[answer_words(row)] += 1
    return {right: dict(given) for right, given in counts.items()}


def calibration(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Mean stated confidence beside the frequency of right answers (`grouped`), per cent, by bins of the confidence of
    0.1; bins without a case are left out."""
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
