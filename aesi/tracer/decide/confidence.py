"""The confidence of a verdict: how often verdicts of its kind with its margin were right on blind cases.

    p = 1 / (1 + exp(-(a + b m)))        m the margin of the verdict, a and b by kind of verdict

`confidence.json` holds a and b with the number of cases behind them; `confidence_cases.jsonl` holds those cases
(of development: 436 of `aesi bench blind`, seeds 12, 13, 18, 19, 21, 23 to 27, 30 and 31, and 11 of `aesi bench real`;
one a line with verdict, margin and whether it was right, look-alikes counted as right).

    python -m aesi.tracer.decide.confidence CASES.jsonl > confidence.json

fits it, also from the rows of `aesi bench blind --json`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

import numpy as np

from aesi.numerics.typing import Array

FILE = "confidence.json"
SLOPE_PRIOR = 0.1
"""Prior precision (one over the variance) of the slope: a standard deviation of three per unit of margin, so that a few
cases cannot make a step. A convention."""
HIGHEST = 0.99
"""Highest confidence that some hundred cases can vouch for."""


@dataclass(frozen=True)
class FrequencyMap:
    """Logistic map from margin to frequency for one kind of verdict.  cases : number of cases that it was fitted to."""

    intercept: float
    slope: float
    cases: int

    def frequency(self, margin: float) -> float:
        """Frequency, 0 to 1, with which a verdict with this margin is right."""
        return min(float(1.0 / (1.0 + np.exp(-(self.intercept + self.slope * margin)))), HIGHEST)


@lru_cache(maxsize=1)
def frequency_maps() -> Mapping[str, FrequencyMap]:
    """Kind of verdict -> map."""
    content = json.loads(files("aesi.tracer.decide").joinpath(FILE).read_text(encoding="utf-8"))
    return {word: FrequencyMap(**values) for word, values in content["maps"].items()}


def fitted_map(margins: Sequence[float], right: Sequence[bool]) -> FrequencyMap:
    """Fit by maximum likelihood, with a weak prior (one case right and one wrong in the middle) and a slope that is
    not negative."""
    from scipy.optimize import minimize
    from scipy.special import expit, log_expit

    m, y = np.array(margins, dtype=float), np.array(right, dtype=float)
    middle = float(np.median(m)) if len(m) else 0.0
    m, y = np.append(m, [middle, middle]), np.append(y, [1.0, 0.0])

    def surprise(weights: Array) -> tuple[float, Array]:
        """(negative log likelihood with the prior, nats; its gradient)."""
        line = weights[0] + weights[1] * m
        nats = -float(np.sum(y * log_expit(line) + (1.0 - y) * log_expit(-line)))
        off = expit(line) - y
        slopes = np.array([np.sum(off), np.sum(off * m) + SLOPE_PRIOR * weights[1]])
        return nats + 0.5 * SLOPE_PRIOR * float(weights[1] ** 2), slopes

    weights = minimize(surprise, np.zeros(2), jac=True, bounds=[(None, None), (0.0, None)]).x
    return FrequencyMap(float(weights[0]), float(weights[1]), len(margins))


def kind_of(word: str, effects: Sequence[str]) -> str:
    """Kind of verdict that has a map of its own: its word, or `named` where names stand beside `unknown`."""
    return "named" if word == "unknown" and effects else word


def maps_of(rows: Sequence[Mapping[str, object]]) -> dict[str, FrequencyMap]:
    """Kind of verdict -> map, from rows with `verdict`, `effects`, `margin` and `right`."""
    out = {}
    for kind in ("found", "none", "unknown", "named"):
        of_kind = [row for row in rows if "margin" in row and _kind(row) == kind]
        margins = [float(str(row["margin"])) for row in of_kind]
        out[kind] = fitted_map(margins, [bool(row["right"]) for row in of_kind])
    return out


def _kind(row: Mapping[str, object]) -> str:
    effects = row.get("effects", ())
    return kind_of(str(row.get("verdict")), effects if isinstance(effects, Sequence) else ())


def _main(paths: Sequence[str]) -> None:
    rows = []
    for path in paths:
        with open(path, encoding="utf-8") as file:
            rows += [json.loads(line) for line in file if line.strip()]
    maps = {word: vars(found) for word, found in maps_of(rows).items()}
    command = "python -m aesi.tracer.decide.confidence confidence_cases.jsonl"
    print(json.dumps({"command": command, "maps": maps}, indent=1))


if __name__ == "__main__":
    _main(sys.argv[1:])
