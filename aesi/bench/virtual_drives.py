"""Virtual cells by the dozen, quickly: one drive, and cells that differ at random from what is declared.

The measurement is the project's own simulation of the declared cell with effects added, and noise on the
voltage, where the laboratory solves a porous-electrode model. The error series are smooth functions of the states
with hysteresis and heat, as on real cells; they are for ranking designs of the error model and its bands, not for
judging the physics.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.polynomial.chebyshev import chebval

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.profiles.profile import Bench, Profile, paper_profiles
from aesi.errors import SimulationError
from aesi.numerics.typing import Array
from aesi.physics import ActiveEffect, Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.experiment.drives import HALVES, cut_repeats
from aesi.pipeline.experiment.sections import RepeatsConfig
from aesi.pipeline.product.deviations import slopes_v
from aesi.pipeline.product.error_series import error_series
from aesi.records import ErrorSeries, Measurement, Run, Split
from aesi.sparse import with_inputs

SplitLayout = Literal["repeats", "schedules", "beyond", "one"]
"""repeats : WLTC five times over the whole state of charge, training on 1, 3 and 5, test on 2 and 4.
schedules : the paper's training, validation and test schedules.
beyond : as repeats, but the training drives never charge, and the test drives do, at BEYOND times the current.
one : a single training record, WLTC five times over the whole state of charge; test on UDDS five times."""

INPUTS = ("I", "I_next", "I_60s", "c_sp", "c_sn", "c_e0", "c_eL")
DT_S = 1.0
NOISE_V = 5e-4
"""White noise of the voltage."""
OPEN_CIRCUIT_V = 3e-3
"""Standard deviation of each of OPEN_CIRCUIT_TERMS terms by which the true open-circuit voltage is off."""
OPEN_CIRCUIT_TERMS = 7
N_REPEATS = 5
BEYOND = 1.3
"""Against the training's largest current."""
SOC_START, SOC_END = 0.97, 0.06
TEST_REPEATS = (2, 4)
TRAIN_REPEATS = (1, 3, 5)
MOST_TRIES = 20
"""Random cells that are drawn until one can be driven like that."""

DrawnValues = dict[str, float]


def virtual_splits(cell: Cell, layout: SplitLayout, count: int, seed: int = 0) -> Iterator[Split]:
    """`count` virtual cells under one drive, each with another set of undeclared differences."""
    rng = np.random.default_rng(seed)
    declared = {
        role: [_declared(cell, profile) for profile in profiles]
        for role, profiles in PROFILES[layout](cell.capacity_ah).items()
    }
    for _ in range(count):
        yield _split(cell, declared, rng)


def cuts_of(layout: SplitLayout) -> int:
    """Into how many parts an experiment cuts a drive of the layout to leave them out in turn."""
    return HALVES if layout in ("repeats", "beyond") else 1


def random_effects(cell: Cell, rng: np.random.Generator) -> tuple[ActiveEffect, ...]:
    """Each difference with even odds, its size at random about what cells of one type scatter by."""
    chosen = [name for name in DIFFERENCES if rng.random() < 0.5] or ["series_resistance"]
    return tuple(CATALOGUE[name].activate(**DIFFERENCES[name](rng, cell.capacity_ah)) for name in chosen)


DIFFERENCES: dict[str, Callable[[np.random.Generator, float], DrawnValues]] = {
    "ocv_hysteresis": lambda rng, q: {"magnitude_v": rng.uniform(2e-3, 15e-3), "rate": rng.uniform(10, 60)},
    "series_resistance": lambda rng, q: {"resistance_ohm": rng.uniform(0.002, 0.015) / q},
    "solid_diffusivity": lambda rng, q: _factors(rng, 0.5),
    "charge_transfer_kinetics": lambda rng, q: _factors(rng, 0.5),
    "electrolyte_transport": lambda rng, q: {
        "conductivity_factor": float(np.exp(0.3 * rng.standard_normal())),
        "diffusivity_factor": float(np.exp(0.3 * rng.standard_normal())),
    },
    "lithium_inventory_loss": lambda rng, q: {"loss": rng.uniform(-0.01, 0.02)},
    "active_material_loss_negative": lambda rng, q: {"loss": rng.uniform(-0.02, 0.04)},
    "concentration_dependent_diffusivity": lambda rng, q: {
        "negative_slope": 1.5 * rng.standard_normal(),
        "positive_slope": 1.5 * rng.standard_normal(),
    },
    "self_heating": lambda rng, q: {"heat_transfer_w_k": rng.uniform(0.1, 0.5)},
}
"""Effect -> (rng, capacity in Ah) -> values."""


@dataclass(frozen=True, eq=False)
class _Made:
    """How a cell differs: effects, and Chebyshev coefficients of its open-circuit voltage over the charge."""

    effects: tuple[ActiveEffect, ...]
    open_circuit_v: Array


def _factors(rng: np.random.Generator, spread: float) -> DrawnValues:
    negative, positive = np.exp(spread * rng.standard_normal(2))
    return {"negative_factor": float(negative), "positive_factor": float(positive)}


def _repeats(capacity_ah: float) -> dict[str, tuple[Profile, ...]]:
    return _in_turn(capacity_ah, lambda once: once, lambda once: once)


def _beyond(capacity_ah: float) -> dict[str, tuple[Profile, ...]]:
    return _in_turn(capacity_ah, lambda once: np.maximum(once, 0.0), lambda once: BEYOND * once)


def _in_turn(
    capacity_ah: float, train: Callable[[Array], Array], test: Callable[[Array], Array]
) -> dict[str, tuple[Profile, ...]]:
    """WLTC by turns for training and test."""
    once = Bench(capacity_ah, DT_S).drive("wltc_3b")
    drives = [(test if k + 1 in TEST_REPEATS else train)(once) for k in range(N_REPEATS)]
    return {"record": (_emptying("drive", drives, capacity_ah),)}


def _one(capacity_ah: float) -> dict[str, tuple[Profile, ...]]:
    bench = Bench(capacity_ah, DT_S)
    train, test = (
        _emptying(name, N_REPEATS * [bench.drive(name)], capacity_ah) for name in ("wltc_3b", "udds")
    )
    return {"train": (train,), "valid": (), "test": (test,)}


def _emptying(name: str, drives: Sequence[Array], capacity_ah: float) -> Profile:
    """The drives after a minute of rest, so many times as hard that they use up the charge from start to end."""
    bench = Bench(capacity_ah, DT_S)
    share = float(np.sum(np.concatenate(drives))) * DT_S / SECONDS_PER_HOUR / capacity_ah
    scale = (SOC_START - SOC_END) / share
    return bench.profile(name, [bench.rest(60.0), *(scale * drive for drive in drives)], SOC_START)


PROFILES: dict[SplitLayout, Callable[[float], dict[str, tuple[Profile, ...]]]] = {
    "repeats": _repeats,
    "schedules": lambda capacity_ah: paper_profiles(capacity_ah, DT_S),
    "beyond": _beyond,
    "one": _one,
}


@dataclass(frozen=True, eq=False)
class _Declared:
    """A drive of the declared cell: its run, and what each parameter is worth along it (n, k), V a deviation."""

    profile: Profile
    run: Run
    slopes_v: Array


def _declared(cell: Cell, profile: Profile) -> _Declared:
    record = Measurement(profile.time_s, profile.current_a, np.zeros(len(profile)), name=profile.name)
    run = simulate(cell, profile.time_s, profile.current_a, profile.soc0)
    slopes = slopes_v(cell, (), record, profile.soc0, "linear", "espm", run.voltage_v)
    return _Declared(profile, run, slopes)


def _split(cell: Cell, declared: dict[str, list[_Declared]], rng: np.random.Generator) -> Split:
    for _ in range(MOST_TRIES):
        made = _Made(random_effects(cell, rng), OPEN_CIRCUIT_V * rng.standard_normal(OPEN_CIRCUIT_TERMS))
        try:
            series = {
                role: tuple(_series(cell, made, one, rng) for one in drives)
                for role, drives in declared.items()
            }
        except SimulationError:  # the cell with these effects cannot give that charge
            continue
        if "record" not in series:
            return Split(series["train"], series["valid"], series["test"])
        period = (len(series["record"][0]) - 60) * DT_S / N_REPEATS
        rest = round(60 / DT_S)
        drive = series["record"][0].take(slice(rest, None))
        return cut_repeats(drive, RepeatsConfig(period_s=period, train=TRAIN_REPEATS, test=TEST_REPEATS))
    raise SimulationError(
        f"none of {MOST_TRIES} random cells can be driven like that; lower the differences."
    )


def _series(cell: Cell, made: _Made, declared: _Declared, rng: np.random.Generator) -> ErrorSeries:
    profile = declared.profile
    truth = simulate(cell, profile.time_s, profile.current_a, profile.soc0, made.effects)
    noise = NOISE_V * rng.standard_normal(len(profile))
    voltage: Array = truth.voltage_v + chebval(2 * truth.series["soc"] - 1, made.open_circuit_v) + noise
    measured = Measurement(profile.time_s, profile.current_a, voltage, name=profile.name)
    series = with_inputs(error_series(measured, declared.run, DT_S), INPUTS)
    return replace(series, slopes_v=declared.slopes_v)
