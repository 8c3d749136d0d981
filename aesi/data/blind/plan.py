"""Which cases there are: every effect at several sizes on both cells, pairs, nothing at all, and strangers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from aesi.data.blind.case import CaseSpec
from aesi.data.blind.duty import duty
from aesi.data.blind.recipes import RECIPES
from aesi.data.blind.strangers import STRANGERS
from aesi.data.laboratory.simulator import Model

NMC = "nmc"
M50 = "lg_m50"
FILES = {NMC: "nmc_30ah.bpx.json", M50: "lg_m50_chen2020.bpx.json"}
RATES = {NMC: 1.0, M50: 0.7}
"""The LG M50 is an energy cell, with higher resistances; its currents stay lower."""
SOC0 = {NMC: (0.8, 0.95), M50: (0.6, 0.75)}
"""From higher up, charge pulses take the LG M50 to 4.34 V, beyond its upper voltage."""
PLATING_SOC0 = (0.65, 0.75)
"""Fast charges go on from there without leaving the window of voltage by more than pulses do."""
TARGETS_MV = (2.0, 4.0, 8.0)
TOLERANCE = 0.05
SLOW = ("particle_size_distribution",)
"""Recipes that take a minute a run: one size on one cell."""
PAIRS = (
    ("series_resistance", "self_heating"),
    ("ocv_hysteresis", "series_resistance"),
    ("self_heating", "ocv_hysteresis"),
    ("leakage_current", "series_resistance"),
    ("positive_ocp", "series_resistance"),
    ("current_sensor_gain", "ocv_hysteresis"),
    ("slow_negative_kinetics", "positive_ocp"),
    ("film_growth", "negative_diffusivity"),
)


def cells_in(folder: Path) -> dict[str, Path]:
    """The two cells of the plan, from a folder of cell files such as experiments/cells."""
    return {name: folder / file for name, file in FILES.items()}


def plan(seed: int = 0) -> tuple[CaseSpec, ...]:
    """The full set, over 100 cases, in a fixed order for a seed."""
    rng = np.random.default_rng(seed)
    wanted: list[tuple[tuple[str, ...], str, float, Model]] = []
    for name in RECIPES:
        if name in SLOW:
            wanted.append(((name,), NMC, TARGETS_MV[1], "SPMe"))
            continue
        wanted += [((name,), NMC, target, "SPMe") for target in TARGETS_MV[:2]]
        if RECIPES[name].duty is duty:  # fast charges take the LG M50 far beyond its upper voltage
            wanted.append(((name,), M50, TARGETS_MV[2], "SPMe"))
    wanted += [(("series_resistance",), NMC, 6.0, "DFN"), (("ocv_hysteresis",), M50, 6.0, "DFN")]
    wanted += [(pair, cell, 6.0, "SPMe") for pair, cell in zip(PAIRS, (NMC, M50) * 4, strict=True)]
    wanted += [((name,), cell, 6.0, "SPMe") for name in STRANGERS for cell in (NMC, M50)]
    wanted += [((), cell, 0.0, "SPMe") for cell in (NMC, M50) for _ in range(4)]
    wanted += [((), cell, 0.0, "DFN") for cell in (NMC, M50) for _ in range(2)]
    cases = [_spec(k, *one, rng) for k, one in enumerate(wanted)]
    fast = len(cases)
    cases += [_strong(fast + k, cell, rng) for k, cell in enumerate((NMC, M50))]
    return tuple(cases)


def small_plan(seed: int = 0) -> tuple[CaseSpec, ...]:
    """Six cases that a test can afford: nothing, heat, resistance, hysteresis, a gain, a stranger."""
    rng = np.random.default_rng(seed)
    recipes = ((), ("self_heating",), ("series_resistance",), ("ocv_hysteresis",))
    more = (("current_sensor_gain",), ("breathing",))
    return tuple(_spec(k, names, NMC, 6.0, "SPMe", rng) for k, names in enumerate((*recipes, *more)))


def _spec(
    number: int, recipes: tuple[str, ...], cell: str, target_mv: float, model: Model, rng: np.random.Generator
) -> CaseSpec:
    moderate = model == "DFN"
    low, high = PLATING_SOC0 if recipes == ("lithium_plating",) else SOC0[cell]
    return CaseSpec(
        name=f"b{number:03d}",
        cell=cell,
        recipes=recipes,
        target_mv=target_mv,
        model=model,
        rate=RATES[cell] * (0.5 if moderate else float(rng.uniform(0.75, 1.0))),
        tolerance=TOLERANCE if rng.random() < 0.4 else 0.0,
        temperature=bool(rng.random() < 0.4),
        soc0=round(float(rng.uniform(low, high)), 3),
        seed=int(rng.integers(2**31)),
    )


def _strong(number: int, cell: str, rng: np.random.Generator) -> CaseSpec:
    """A full porous-electrode cell driven hard: its reaction is not uniform, and that shows."""
    return CaseSpec(
        name=f"b{number:03d}",
        cell=cell,
        model="DFN",
        rate=1.2 if cell == NMC else 0.9,
        soc0=min(0.9, SOC0[cell][1]),
        seed=int(rng.integers(2**31)),
    )
