"""Differences of a cell's parameters between two careful parametrisations of it.

The LG M50 was taken apart and measured twice: Chen et al. 2020 (doi:10.1149/1945-7111/ab9050) and O'Regan et al. 2022
(doi:10.1016/j.electacta.2022.140700). At 25 degC, half charge and 1 mol/l, PyBaMM's sets of the two differ by the
natural logarithms in `DIFFERENCES`. If both are random draws about the truth, the standard deviation of one is the
difference over sqrt(2). The smaller difference of the two electrodes is used for both: the other is 18-fold in
diffusivity and four-fold in the rate constant, and with a cell file that wrong no effect can be identified.
Potentials and balance are as declared.

    python -m aesi.data.blind.spread

prints the differences from PyBaMM's sets.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from aesi.data.laboratory.simulator import Applied, evaluated_at

DIFFERENCES = {"diffusivity": 0.61, "kinetics": 0.31, "electrolyte_diffusivity": 0.49, "conductivity": 0.038}
"""Absolute natural logarithms of the ratios; `python -m aesi.data.blind.spread` prints them."""
SPREADS = {name: value / math.sqrt(2) for name, value in DIFFERENCES.items()}
"""Standard deviation of the natural logarithm."""
FURTHEST = 2.0
"""Limit of draws, in standard deviations. Beyond 2.5 of them a value is a wrong parameter, not a spread."""
BEYOND = 2.5
REFERENCE_K = 298.15
"""Temperature at which the two parametrisations are compared."""


def parametrisation(rng: np.random.Generator) -> tuple[Applied, ...]:
    """One draw of a cell's parameters, as changes of the laboratory."""

    def factor(name: str) -> float:
        deviations = float(np.clip(rng.standard_normal(), -FURTHEST, FURTHEST))
        return math.exp(SPREADS[name] * deviations)

    def of_both(name: str) -> dict[str, float]:
        return {"negative_factor": factor(name), "positive_factor": factor(name)}

    return (
        Applied("solid_diffusivity", of_both("diffusivity")),
        Applied("charge_transfer_kinetics", of_both("kinetics")),
        Applied(
            "electrolyte_transport",
            {
                "diffusivity_factor": factor("electrolyte_diffusivity"),
                "conductivity_factor": factor("conductivity"),
            },
        ),
    )


def published_differences() -> dict[str, float]:
    """ln(O'Regan / Chen) of each parameter, by electrode where there are two."""
    import pybamm

    first, second = (pybamm.ParameterValues(name) for name in ("Chen2020", "ORegan2022"))

    def log_ratio(of: Callable[[Any], float]) -> float:
        return math.log(of(second) / of(first))

    found = {}
    for side in ("Negative", "Positive"):
        found[f"{side} diffusivity"] = log_ratio(partial(_diffusivity, side=side))
        found[f"{side} kinetics"] = log_ratio(partial(_exchange, side=side))
    for name in ("conductivity [S.m-1]", "diffusivity [m2.s-1]"):
        found[f"electrolyte {name.split()[0]}"] = log_ratio(partial(_in_electrolyte, name=name))
    return found


def _diffusivity(values: Any, side: str) -> float:
    name = f"{side} particle diffusivity [m2.s-1]"
    logs = [math.log(evaluated_at(values, name, x, REFERENCE_K)) for x in np.linspace(0.1, 0.9, 17)]
    return math.exp(float(np.mean(logs)))


def _in_electrolyte(values: Any, name: str) -> float:
    return evaluated_at(values, f"Electrolyte {name}", 1000.0, REFERENCE_K)


def _exchange(values: Any, side: str) -> float:
    full = float(values[f"Maximum concentration in {side.lower()} electrode [mol.m-3]"])
    name = f"{side} electrode exchange-current density [A.m-2]"
    return evaluated_at(values, name, 1000.0, 0.5 * full, full, REFERENCE_K)


if __name__ == "__main__":
    for parameter, difference in published_differences().items():
        print(f"{parameter}: {difference:+.3f}")
