"""The plan of the cases. A case is a function of seed and index; the first N cases of a seed are a balanced sample.

Cases come in shuffled blocks of fifteen: five without an effect, six with one effect, two pairs, a stranger, and a
triple or another stranger. Within each kind every factor (cell, model, records, spread, temperature, state of charge,
sampling rate, size) takes all its values before one is repeated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np

from aesi.data.blind.case import CaseSpec, RecordKind, Warmth
from aesi.data.blind.cells import CELLS
from aesi.data.blind.recipes import RECIPES
from aesi.data.blind.strangers import STRANGERS
from aesi.data.laboratory.simulator import LaboratoryModel

FULL = 360
"""Number of cases of the full set: 120 without an effect, 144 with one, 48 with two, 12 with three, 36 strangers."""
BLOCK = ("none",) * 5 + ("single",) * 6 + ("pair",) * 2 + ("stranger",)
LAST_OF_BLOCK = ("triple", "stranger")
TARGETS_MV = (1.5, 3.0, 6.0, 12.0)
"""Target RMS changes of the voltage, mV, from just above the noise of 1 mV."""
MODELS: tuple[LaboratoryModel, ...] = ("DFN", "SPMe")
RECORDS: tuple[tuple[RecordKind, ...], ...] = (
    ("drive",),
    ("slow", "drive"),
    ("drive",),
    ("pulses", "drive"),
    ("drive",),
    ("slow", "pulses", "drive"),
    ("pulses",),
    ("drive", "drive"),
)
WARMTHS: tuple[Warmth, ...] = ("none", "ambient", "none", "course")
ROWS_S = (1.0, 1.0, 0.1)
"""Intervals of rows, s, taken in turn: two cases of three at 1 Hz, one at 10 Hz."""
FAST_CHARGE_SOC0 = (0.65, 0.75)
"""Initial states of charge from which fast charges exceed the voltage window by no more than pulses do."""
PAIRS = (
    ("series_resistance", "self_heating"),
    ("ocv_hysteresis", "series_resistance"),
    ("self_heating", "ocv_hysteresis"),
    ("leakage_current", "series_resistance"),
    ("positive_ocp", "series_resistance"),
    ("current_sensor_gain", "ocv_hysteresis"),
    ("slow_negative_kinetics", "positive_ocp"),
    ("film_growth", "negative_diffusivity"),
    ("active_material_loss_negative", "series_resistance"),
    ("lithium_inventory_loss", "film_growth"),
    ("colder", "ocv_hysteresis"),
    ("voltage_lag", "series_resistance"),
)
TRIPLES = (
    ("series_resistance", "ocv_hysteresis", "self_heating"),
    ("active_material_loss_positive", "series_resistance", "ocv_hysteresis"),
    ("current_sensor_gain", "series_resistance", "positive_ocp"),
    ("lithium_inventory_loss", "film_growth", "colder"),
)


def plan(seed: int = 0, cases: int = FULL) -> tuple[CaseSpec, ...]:
    """The first cases of a seed."""
    return _all(seed)[:cases]


def case(seed: int, index: int) -> CaseSpec:
    """One case of a seed."""
    return _all(seed)[index]


def small_plan(seed: int = 0) -> tuple[CaseSpec, ...]:
    """Six easy and fast cases for tests: no effect, heat, resistance, hysteresis, a gain, a stranger."""
    recipes = ((), ("self_heating",), ("series_resistance",), ("ocv_hysteresis",))
    more = (("current_sensor_gain",), ("breathing",))
    return tuple(
        CaseSpec(f"b{k:03d}", "nmc", names, 6.0, soc0=0.85, seed=1000 * seed + k)
        for k, names in enumerate((*recipes, *more))
    )


@cache
def _all(seed: int) -> tuple[CaseSpec, ...]:
    rng = np.random.default_rng([seed, FULL])
    drawn = {kind: _Draws(kind, rng) for kind in ("none", "single", "pair", "triple", "stranger")}
    kinds: list[str] = []
    for block in range(FULL // (len(BLOCK) + 1)):
        kinds += [str(k) for k in rng.permutation([*BLOCK, LAST_OF_BLOCK[block % 2]])]
    return tuple(drawn[kind].case(number) for number, kind in enumerate(kinds))


class _Draws:
    """Generator of the cases of one kind in sequence, with every factor balanced."""

    def __init__(self, kind: str, rng: np.random.Generator) -> None:
        contents: dict[str, Sequence[Any]] = {
            "none": ((),),
            "single": [(name,) for name in RECIPES],
            "pair": PAIRS,
            "triple": TRIPLES,
            "stranger": [(name,) for name in STRANGERS],
        }
        self.rng = rng
        self.recipes = _balanced(contents[kind], rng)
        self.cells = _balanced(tuple(CELLS), rng)
        self.models = _balanced(MODELS, rng)
        self.records = _balanced(RECORDS, rng)
        self.spreads = _balanced((True, False), rng)
        self.warmths = _balanced(WARMTHS, rng)
        self.given = _balanced((True, False), rng)
        self.rows_s = _balanced(ROWS_S, rng)
        self.targets = _balanced(TARGETS_MV, rng)

    def case(self, number: int) -> CaseSpec:
        """The next case; `number` counts cases of all kinds and is part of its name."""
        names = next(self.recipes)
        known = [RECIPES[name] for name in names if name in RECIPES]
        cell, records = next(self.cells), next(self.records)
        spread, warmth = next(self.spreads), next(self.warmths)
        low, high = CELLS[cell].soc0
        for recipe in known:
            if cell not in recipe.cells:
                cell = recipe.cells[0]
            if recipe.test != "drive":
                records = tuple(recipe.test if record == "drive" else record for record in records)
                low, high = FAST_CHARGE_SOC0
            warmth = "none" if recipe.warm else warmth
        return CaseSpec(
            name=f"b{number:03d}",
            cell=cell,
            recipes=names,
            target_mv=next(self.targets) if names else 0.0,
            model=next(self.models),
            records=records,
            rate=round(CELLS[cell].rate * float(self.rng.uniform(0.75, 1.0)), 4),
            spread=spread,
            warmth=warmth,
            soc0=round(float(self.rng.uniform(low, high)), 3),
            soc0_given=next(self.given),
            dt_s=next(self.rows_s),
            seed=int(self.rng.integers(2**31)),
        )


def _balanced(values: Sequence[Any], rng: np.random.Generator) -> Iterator[Any]:
    """All values in a random order, then again in another, without end."""
    while True:
        yield from (values[k] for k in rng.permutation(len(values)))
