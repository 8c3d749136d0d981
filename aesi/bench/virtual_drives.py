"""Virtual cells that are fast to simulate: drives of cells that differ from the declared cell at random.

The measured voltage is this package's own simulation of the declared cell with effects added, an error of the
open-circuit voltage and white noise. The virtual laboratory (`aesi.data.virtual`) solves a porous-electrode model
instead, which takes longer. As on real cells, the voltage error is a smooth function of the states with hysteresis and
heat. These cells serve to rank designs of the error model and of its bands; they cannot judge the physics.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.polynomial.chebyshev import chebval

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.profiles.profile import Profile, ProfileBuilder, paper_profiles
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
"""How training and test data are laid out.

repeats : one record, five WLTC cycles from SOC_START to SOC_END; cycles 1, 3 and 5 train, 2 and 4 test.
schedules : the paper's training, validation and test schedules, a record each.
beyond : as `repeats`, but the training cycles have their charging currents set to zero, and the test cycles keep them
and have BEYOND times the current.
one : one training record of five WLTC cycles and one test record of five UDDS cycles, both from SOC_START to SOC_END.
"""

INPUTS = ("I", "I_next", "I_60s", "c_sp", "c_sn", "c_e0", "c_eL")
"""Inputs of the correction, those of the experiments on measured drives."""
DT_S = 1.0
"""Time step of the drives, s."""
REST_S = 60.0
"""Length of the rest that a record begins with, s."""
NOISE_V = 5e-4
"""Standard deviation of the white noise on the voltage, V."""
OPEN_CIRCUIT_V = 3e-3
"""Standard deviation of each Chebyshev coefficient of the error of the declared open-circuit voltage, V. A convention,
as are the other sizes here: about what cells of one type scatter by."""
OPEN_CIRCUIT_TERMS = 7
"""Number of these coefficients, over the state of charge."""
N_REPEATS = 5
"""Number of drive cycles in a record."""
BEYOND = 1.3
"""Factor on the current of the test cycles in the layout `beyond`."""
SOC_START, SOC_END = 0.97, 0.06
"""State of charge of the declared cell before and after the drive cycles."""
TEST_REPEATS = (2, 4)
TRAIN_REPEATS = (1, 3, 5)
"""Numbers of the cycles that test and that train, counted from 1."""
MOST_TRIES = 20
"""Most random cells that are drawn until one can deliver the charge of the drive."""

DrawnValues = dict[str, float]
"""Parameter of an effect -> value, in the unit that its name ends with."""


def virtual_splits(cell: Cell, layout: SplitLayout, count: int, seed: int = 0) -> Iterator[Split]:
    """The data of `count` virtual cells, one after the other, each with other random differences from the declared
    cell.

    seed : of the differences and of the noise.  Raises SimulationError if MOST_TRIES random cells in a row cannot be
    simulated.
    """
    rng = np.random.default_rng(seed)
    declared = {
        role: [_declared(cell, profile) for profile in profiles]
        for role, profiles in PROFILES[layout](cell.capacity_ah).items()
    }
    for _ in range(count):
        yield _split(cell, declared, rng)


def cuts_of(layout: SplitLayout) -> int:
    """Number of parts into which an experiment cuts each training drive of the layout, to leave them out in turn
    (`aesi.pipeline.experiment.drives.cuts`)."""
    return HALVES if layout in ("repeats", "beyond") else 1


def random_effects(cell: Cell, rng: np.random.Generator) -> tuple[ActiveEffect, ...]:
    """A random set of effects: each of DIFFERENCES with a probability of one half, with random parameters; a series
    resistance if none was drawn."""
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
"""Effect -> function of the random generator and the capacity in Ah that draws its parameters. The ranges are about
what cells of one type scatter by: conventions."""


@dataclass(frozen=True, eq=False)
class _Made:
    """The differences of one virtual cell from the declared cell.

    open_circuit_v : (OPEN_CIRCUIT_TERMS,) V, Chebyshev coefficients of the error of the open-circuit voltage over the
    state of charge, the interval [0, 1] mapped to [-1, 1].
    """

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
    """One record of N_REPEATS WLTC cycles, the training cycles changed by `train`, the test cycles by `test` (both map
    (n,) A to (n,) A)."""
    once = ProfileBuilder(capacity_ah, DT_S).drive("wltc_3b")
    drives = [(test if k + 1 in TEST_REPEATS else train)(once) for k in range(N_REPEATS)]
    return {"record": (_emptying("drive", drives, capacity_ah),)}


def _one(capacity_ah: float) -> dict[str, tuple[Profile, ...]]:
    builder = ProfileBuilder(capacity_ah, DT_S)
    train, test = (
        _emptying(name, N_REPEATS * [builder.drive(name)], capacity_ah) for name in ("wltc_3b", "udds")
    )
    return {"train": (train,), "valid": (), "test": (test,)}


def _emptying(name: str, drives: Sequence[Array], capacity_ah: float) -> Profile:
    """The drives one after the other, after a rest, with the current scaled so that they discharge the cell from
    SOC_START to SOC_END."""
    builder = ProfileBuilder(capacity_ah, DT_S)
    share = float(np.sum(np.concatenate(drives))) * DT_S / SECONDS_PER_HOUR / capacity_ah
    scale = (SOC_START - SOC_END) / share
    return builder.profile(name, [builder.rest(REST_S), *(scale * drive for drive in drives)], SOC_START)


PROFILES: dict[SplitLayout, Callable[[float], dict[str, tuple[Profile, ...]]]] = {
    "repeats": _repeats,
    "schedules": lambda capacity_ah: paper_profiles(capacity_ah, DT_S),
    "beyond": _beyond,
    "one": _one,
}


@dataclass(frozen=True, eq=False)
class _Declared:
    """A drive simulated with the declared cell.

    slopes_v : (n, k) V, change of the voltage by one prior standard deviation of each of k parameters.
    """

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
        except SimulationError:  # the cell with these effects cannot deliver the charge of the drive
            continue
        if "record" not in series:
            return Split(series["train"], series["valid"], series["test"])
        drive = series["record"][0].take(slice(round(REST_S / DT_S), None))
        period = len(drive) * DT_S / N_REPEATS
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
