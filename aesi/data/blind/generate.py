"""Make one blind case: base run, effects scaled to the size asked for, instruments, label."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from aesi.data.blind.case import BlindCase, CaseSpec
from aesi.data.blind.duty import duty
from aesi.data.blind.recipes import RECIPES, Recipe, Written
from aesi.data.blind.strangers import STRANGERS
from aesi.data.laboratory.instrument import Instrument
from aesi.data.laboratory.simulator import Applied, Setup, TrueRun, run
from aesi.data.profile import Profile
from aesi.data.virtual import nominal_capacity_ah
from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.records import Measurement

MODERATE_RATE = 0.55
"""Up to this share of the default currents, a full porous-electrode cell counts as no effect as well."""
COARSE_POINTS = 15
"""Radial points of the runs that find the size of an effect; the error of the mesh cancels in a difference."""
CLOSE_ENOUGH = 0.2
HARDER = 1.25
"""Times the rate asked for, where an effect at its most does not show as much as it should: more would leave the window
of voltage."""
MOST_TRIES = 4
MILLIVOLTS = 1e3


@dataclass(frozen=True, eq=False)
class _Bench:
    """What all runs of a case share."""

    declared: Path
    spec: CaseSpec
    profile: Profile
    capacity_ah: float
    tolerance: tuple[Applied, ...]
    base: TrueRun

    def run(self, applied: tuple[Applied, ...], radial_points: int | None = None) -> TrueRun:
        """The cell with these changes under the duty."""
        setup = Setup(self.declared, self.spec.model, (*self.tolerance, *applied), radial_points)
        return run(setup, self.profile)

    def unexplained(self, written: Written, radial_points: int | None = None) -> Array:
        """(n,) V: what was written less what the cell without effects would do under the current written."""
        current = self.profile.current_a
        if np.array_equal(written.current_a, current):
            return written.voltage_v - self.run((), radial_points).voltage_v
        believed = Profile("believed", self.profile.time_s, written.current_a, self.profile.soc0)
        setup = Setup(self.declared, self.spec.model, self.tolerance, radial_points)
        return written.voltage_v - run(setup, believed).voltage_v


def generate(spec: CaseSpec, cells: Mapping[str, Path], rng: np.random.Generator | None = None) -> BlindCase:
    """The case of a specification.

    cells : name -> declared BPX file.  rng : of duty, tolerance and noise; by default from the seed of the
    specification, so that the same specification gives the same case.
    Raises DataError for an unknown cell or recipe; SimulationError where the cell cannot be simulated.
    """
    rng = rng or np.random.default_rng(spec.seed)
    known = [name for name in spec.recipes if name in RECIPES]
    bench, sizes = _shown(spec, cells, rng, known)
    spec = bench.spec
    strange = [name for name in spec.recipes if name in STRANGERS]
    truth: dict[str, float] = {f"tolerance.{k}": v for a in bench.tolerance for k, v in a.values.items()}
    added = np.zeros(len(bench.profile))
    warmth = bench.base.temperature_degc
    together: list[Applied] = []
    for name in known:
        recipe, values = RECIPES[name], sizes[name]
        truth.update({f"{recipe.label}.{k}": v for k, v in values.items()})
        if recipe.change and not recipe.reference:
            together.append(Applied(recipe.change, values))
        elif recipe.change:
            added += _difference(recipe, values, bench)
    changed = bench.run(tuple(together)) if together else bench.base
    voltage = changed.voltage_v + added
    warmth = changed.temperature_degc
    for name in strange:
        shift = STRANGERS[name].shift(changed, bench.capacity_ah, rng)
        magnitude = spec.target_mv / MILLIVOLTS / _rms(shift)
        truth[f"{name}.magnitude"] = magnitude
        voltage = voltage + magnitude * shift
    written = Written(bench.profile.time_s, bench.profile.current_a, voltage)
    for name in known:
        values = {k.split(".", 1)[1]: v for k, v in truth.items() if k.startswith(f"{RECIPES[name].label}.")}
        written = RECIPES[name].instrument(written, values)
    truth["rms_mv"] = MILLIVOLTS * _rms(bench.unexplained(written))
    label, also = _label(spec, known, strange)
    measurement = _measured(spec, written, warmth, rng)
    return BlindCase(spec, (measurement,), label, also, spec.soc0, bench.declared, truth)


def _shown(
    spec: CaseSpec, cells: Mapping[str, Path], rng: np.random.Generator, known: list[str]
) -> tuple[_Bench, dict[str, dict[str, float]]]:
    """The bench, driven somewhat harder where that is needed for an effect to show, and the values of each recipe."""
    drawn = rng.bit_generator.state
    bench = _prepare(spec, cells, rng)
    sizes = {name: _scaled(RECIPES[name], bench) for name in known}
    if not all(reached for _, reached in sizes.values()):
        rng.bit_generator.state = drawn
        bench = _prepare(replace(spec, rate=HARDER * spec.rate), cells, rng)
        sizes = {name: _scaled(RECIPES[name], bench) for name in known}
    return bench, {name: values for name, (values, _) in sizes.items()}


def _prepare(spec: CaseSpec, cells: Mapping[str, Path], rng: np.random.Generator) -> _Bench:
    if spec.cell not in cells:
        raise DataError(f"{spec.name}: there is no cell {spec.cell!r}; given are {', '.join(cells)}.")
    for name in spec.recipes:
        if name not in RECIPES and name not in STRANGERS:
            near = get_close_matches(name, [*RECIPES, *STRANGERS], n=1)
            hint = f"; did you mean {near[0]!r}?" if near else "."
            raise DataError(f"{spec.name}: there is no recipe {name!r}{hint}")
    declared = cells[spec.cell]
    capacity = nominal_capacity_ah(declared)
    made = next((RECIPES[name].duty for name in spec.recipes if name in RECIPES), duty)
    profile = made(capacity, spec.rate, spec.soc0, rng)
    tolerance: tuple[Applied, ...] = ()
    if spec.tolerance:
        off = 1 + rng.uniform(-spec.tolerance, spec.tolerance, 2)
        factors = {"negative_factor": float(off[0]), "positive_factor": float(off[1])}
        tolerance = (Applied("solid_diffusivity", factors),)
    base = run(Setup(declared, spec.model, tolerance), profile)
    return _Bench(declared, spec, profile, capacity, tolerance, base)


def _scaled(recipe: Recipe, bench: _Bench) -> tuple[dict[str, float], bool]:
    """Values at which the recipe alone moves the voltage by about the target, or the most it may be, and whether that
    is enough."""
    target = bench.spec.target_mv / MILLIVOLTS
    magnitude = 1.0
    values = recipe.values(magnitude, bench.capacity_ah)
    for _ in range(MOST_TRIES):
        moved = _rms(_effect_alone(recipe, values, bench))
        if abs(moved / target - 1) < CLOSE_ENOUGH:
            break
        if magnitude >= recipe.most and moved < target:
            return values, False
        magnitude = float(np.clip(magnitude * target / max(moved, 1e-6), 0.02, recipe.most))
        values = recipe.values(magnitude, bench.capacity_ah)
    return values, True


def _effect_alone(recipe: Recipe, values: Mapping[str, float], bench: _Bench) -> Array:
    """(n,) V: what the recipe alone changes in the voltage, on a coarse mesh."""
    if recipe.reference:
        return _difference(recipe, values, bench)
    applied = (Applied(recipe.change, dict(values)),) if recipe.change else ()
    voltage = bench.run(applied, COARSE_POINTS).voltage_v
    written = Written(bench.profile.time_s, bench.profile.current_a, voltage)
    return bench.unexplained(recipe.instrument(written, values), COARSE_POINTS)


def _difference(recipe: Recipe, values: Mapping[str, float], bench: _Bench) -> Array:
    assert recipe.change is not None
    assert recipe.reference is not None
    points = recipe.radial_points
    changed = bench.run((Applied(recipe.change, dict(values)),), points).voltage_v
    return changed - bench.run((recipe.reference(),), points).voltage_v


def _label(spec: CaseSpec, known: list[str], strange: list[str]) -> tuple[str, tuple[str, ...]]:
    also = tuple(dict.fromkeys(a for name in known for a in RECIPES[name].also))
    full = spec.model == "DFN"
    if strange:
        return "unknown", tuple(dict.fromkeys(a for name in strange for a in STRANGERS[name].also))
    if known:
        return "+".join(dict.fromkeys(RECIPES[name].label for name in known)), also
    if full and spec.rate > MODERATE_RATE:
        return "reaction_nonuniformity", ("electrolyte_transport",)
    return "none", ("reaction_nonuniformity",) if full else ()


def _measured(spec: CaseSpec, written: Written, warmth: Array, rng: np.random.Generator) -> Measurement:
    instrument = Instrument(spec.voltage_noise_v, spec.current_noise_a)
    trace = TrueRun(written.time_s, written.current_a, written.voltage_v, warmth, np.empty(0))
    return instrument.write(trace, spec.name, rng, spec.temperature)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
