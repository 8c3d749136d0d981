"""Generation of one blind case: base runs, effects scaled to the target size, instruments, label."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from aesi.constants import MV_PER_V
from aesi.data.blind.case import BlindCase, CaseSpec
from aesi.data.blind.cells import CELLS
from aesi.data.blind.duty import TESTS, DutyConditions
from aesi.data.blind.recipes import RECIPES, Recipe, Written
from aesi.data.blind.spread import parametrisation
from aesi.data.blind.strangers import STRANGERS
from aesi.data.laboratory.change import Values
from aesi.data.laboratory.simulator import Applied, LaboratoryModel, Setup, TrueRun, simulate_truth
from aesi.data.profiles.profile import Profile
from aesi.data.virtual import INSTRUMENT, nominal_capacity_ah
from aesi.errors import DataError, did_you_mean
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.records import Measurement

COARSE_POINTS = 15
"""Radial points of the runs that determine the size of an effect, always with the single particle: the error of mesh
and model cancels in a difference to within `CLOSE_ENOUGH`."""
CLOSE_ENOUGH = 0.2
"""An effect is scaled until it changes the voltage by the target size, to within this share of it, in at most
MOST_TRIES."""
MOST_TRIES = 4
SHOWN = 0.6
"""Least change of the voltage by an effect, as a share of the target."""
CHAMBER_K = 15.0
"""Largest distance of the chamber's temperature from the reference of the cell file, in both directions."""
RISE_K, RISE_S = (2.0, 8.0), (300.0, 1500.0)
"""Ranges of the temperature rise of a cell that warms up, K, and of its time constant, s. They are prescribed, since a
heat balance makes a porous electrode four times slower to solve."""
OTHER_SOC = (-0.1, 0.05)
"""Range of the initial state of charge of further records minus the first one's, where the finder is not told it."""
REDUCTION = "reaction_nonuniformity"
"""Effect that the single particle leaves out of a porous electrode; it is not a deviation of the cell."""


@dataclass(frozen=True, eq=False)
class _CaseBase:
    """What all runs of a case have in common: the declared cell file, the tests, and the true cell without effects.

    own : changes that are no effects (parameters, chamber temperature).
    """

    declared: Path
    spec: CaseSpec
    profiles: tuple[Profile, ...]
    capacity_ah: float
    own: tuple[Applied, ...]

    def run(
        self,
        applied: tuple[Applied, ...] = (),
        model: LaboratoryModel | None = None,
        radial_points: int | None = None,
        profiles: Sequence[Profile] | None = None,
        between: int = 1,
    ) -> list[TrueRun]:
        """The runs of the cell with these changes under its tests, with `between` rows for each row of a test."""
        setup = Setup(self.declared, model or self.spec.model, (*self.own, *applied), radial_points)
        return [simulate_truth(setup, profile, between) for profile in profiles or self.profiles]

    def unexplained(
        self,
        written: Sequence[Written],
        model: LaboratoryModel | None = None,
        radial_points: int | None = None,
    ) -> Array:
        """(rows of all records,) V: written voltage minus that of the cell without effects at the written current."""
        believed = [
            profile
            if np.array_equal(one.current_a, profile.current_a)
            else Profile("believed", profile.time_s, one.current_a, profile.soc0)
            for one, profile in zip(written, self.profiles, strict=True)
        ]
        base_runs = self.run((), model, radial_points, believed)
        return np.concatenate([w.voltage_v - b.voltage_v for w, b in zip(written, base_runs, strict=True)])


def generate(spec: CaseSpec, cells: Mapping[str, Path]) -> BlindCase:
    """The case of a specification; equal specifications give equal cases.

    cells : name -> declared BPX file.
    Raises DataError for an unknown cell or recipe; SimulationError where the cell cannot be simulated.
    """
    base, sizes, rng = _base_showing_all(spec, cells)
    spec, known = base.spec, list(sizes)
    strange = [name for name in spec.recipes if name in STRANGERS]
    truth = {f"own.{a.change}.{k}": v for a in base.own for k, v in a.values.items()}
    for name, values in sizes.items():
        as_named = RECIPES[name].as_named(values, base.declared)
        truth.update(_relative_to_file(RECIPES[name].label, as_named, base.own))
    between = max((RECIPES[name].between for name in known), default=1)
    traces = _records_with_effects(base, sizes, between)
    for name in strange:
        traces = _with_stranger(name, traces, base, truth, int(rng.integers(2**31)))
    written = [Written(t.time_s, t.current_a, t.voltage_v) for t in traces]
    for name in known:
        written = [RECIPES[name].instrument(one, sizes[name]) for one in written]
    written = [Written(w.time_s[::between], w.current_a[::between], w.voltage_v[::between]) for w in written]
    truth["rms_mv"] = MV_PER_V * rms(base.unexplained(written))
    label, also = _label(known, strange)
    neutral = (REDUCTION,) if spec.model == "DFN" else ()
    measurements = tuple(
        _as_measured(spec, one, t, rng, between) for one, t in zip(written, traces, strict=True)
    )
    soc0 = spec.soc0 if spec.soc0_given else None
    return BlindCase(spec, measurements, label, also, neutral, soc0, base.declared, truth)


def _relative_to_file(label: str, values: Values, own: Sequence[Applied]) -> dict[str, float]:
    """Values of an effect by `label.name`, relative to the declared file as in a finding: where the cell itself has
    another value than its file, a factor of the effect multiplies that.  own : changes of the cell itself."""
    of_cell = {key: factor for each in own if each.change == label for key, factor in each.values.items()}
    return {f"{label}.{key}": value * of_cell.get(key, 1.0) for key, value in values.items()}


def _base_showing_all(
    spec: CaseSpec, cells: Mapping[str, Path]
) -> tuple[_CaseBase, dict[str, dict[str, float]], np.random.Generator]:
    """(what the case is made from, values of each recipe, generator in its present state) for the first cell that shows
    all effects.

    The cells are tried from that of the specification on: a particle of 50 nm does not show its diffusivity. Where none
    shows them all, it is the specification's own.
    """
    _check_names(spec, cells)
    after = [*CELLS][[*CELLS].index(spec.cell) + 1 :] + [*CELLS][: [*CELLS].index(spec.cell)]
    allowed = [n for n in after if all(n in RECIPES[r].cells for r in spec.recipes if r in RECIPES)]
    tried = []
    for name in (spec.cell, *allowed):
        there = spec if name == spec.cell else _on_another_cell(spec, name)
        rng = np.random.default_rng(there.seed)
        base = _prepare(there, cells, rng)
        sizes = {n: _scaled_values(RECIPES[n], base) for n in there.recipes if n in RECIPES}
        tried.append((base, {n: values for n, (values, _) in sizes.items()}, rng))
        if all(moved >= SHOWN * spec.target_mv / MV_PER_V for _, moved in sizes.values()):
            return tried[-1]
    return tried[0]


def _on_another_cell(spec: CaseSpec, cell: str) -> CaseSpec:
    """The same case on another cell, at the same relative position in its ranges of charge and of rates."""
    old, new = CELLS[spec.cell], CELLS[cell]
    share = (spec.soc0 - old.soc0[0]) / (old.soc0[1] - old.soc0[0])
    soc0 = round(new.soc0[0] + share * (new.soc0[1] - new.soc0[0]), 3)
    return replace(spec, cell=cell, soc0=soc0, rate=round(spec.rate / old.rate * new.rate, 4))


def _check_names(spec: CaseSpec, cells: Mapping[str, Path]) -> None:
    """Raises DataError for an unknown cell or recipe."""
    if spec.cell not in cells:
        raise DataError(f"{spec.name}: there is no cell {spec.cell!r}; given are {', '.join(cells)}.")
    for name in spec.recipes:
        if name not in RECIPES and name not in STRANGERS:
            known = did_you_mean(name, [*RECIPES, *STRANGERS])
            raise DataError(f"{spec.name}: there is no recipe {name!r}{known}")


def _prepare(spec: CaseSpec, cells: Mapping[str, Path], rng: np.random.Generator) -> _CaseBase:
    declared = cells[spec.cell]
    capacity = nominal_capacity_ah(declared)
    profiles = []
    for number, kind in enumerate(spec.records):
        other = 0.0 if spec.soc0_given or number == 0 else float(rng.uniform(*OTHER_SOC))
        profiles.append(TESTS[kind](DutyConditions(capacity, spec.rate, spec.soc0 + other, spec.dt_s), rng))
    own = parametrisation(rng) if spec.spread else ()
    return _CaseBase(declared, spec, tuple(profiles), capacity, (*own, *_temperature_changes(spec, rng)))


def _temperature_changes(spec: CaseSpec, rng: np.random.Generator) -> tuple[Applied, ...]:
    """The difference of the chamber from the declared temperature, and the rise in it, drawn for the case."""
    if spec.warmth == "none":
        return ()
    shift = {"shift_k": float(rng.uniform(-CHAMBER_K, CHAMBER_K))}
    if spec.warmth == "ambient":
        return (Applied("ambient_temperature", shift),)
    rise = {"rise_k": float(rng.uniform(*RISE_K)), "constant_s": float(rng.uniform(*RISE_S))}
    return (Applied("temperature_course", shift | rise),)


def _scaled_values(recipe: Recipe, base: _CaseBase) -> tuple[dict[str, float], float]:
    """(values at which the recipe alone changes the voltage by about the target, or its least or most; that change,
    V RMS)."""
    target = base.spec.target_mv / MV_PER_V

    def values_at(magnitude: float) -> dict[str, float]:
        return recipe.values(magnitude, base.capacity_ah, base.spec.soc0)

    magnitude = max(1.0, recipe.least)
    moved = 0.0
    for _ in range(MOST_TRIES):
        moved = rms(_effect_alone(recipe, values_at(magnitude), base))
        wanted = magnitude * target / max(moved, 1e-6)
        another = float(np.clip(wanted, recipe.least, recipe.most))
        if abs(moved / target - 1) < CLOSE_ENOUGH or another == magnitude:
            break
        magnitude = another
    return values_at(magnitude), moved


def _effect_alone(recipe: Recipe, values: Mapping[str, float], base: _CaseBase) -> Array:
    """(rows,) V: change of the voltage by the recipe alone, from a coarse single particle."""
    if recipe.reference:
        return np.concatenate(_difference(recipe, values, base))
    applied = (Applied(recipe.change, dict(values)),) if recipe.change else ()
    written = [
        recipe.instrument(Written(t.time_s, t.current_a, t.voltage_v), values)
        for t in base.run(applied, "SPMe", COARSE_POINTS)
    ]
    return base.unexplained(written, "SPMe", COARSE_POINTS)


def _difference(
    recipe: Recipe, values: Mapping[str, float], base: _CaseBase, between: int = 1
) -> list[Array]:
    """Change of the voltage, V, by an option of the single particle over the same option without effect, by record."""
    assert recipe.change is not None
    assert recipe.reference is not None
    points = recipe.radial_points
    changed = base.run((Applied(recipe.change, dict(values)),), "SPMe", points, between=between)
    without = base.run((recipe.reference(),), "SPMe", points, between=between)
    return [c.voltage_v - w.voltage_v for c, w in zip(changed, without, strict=True)]


def _records_with_effects(
    base: _CaseBase, sizes: Mapping[str, dict[str, float]], between: int
) -> list[TrueRun]:
    """The noise-free records of the cell with all its effects, with `between` rows for each row of a test."""
    together = [
        Applied(str(RECIPES[n].change), v)
        for n, v in sizes.items()
        if RECIPES[n].change and not RECIPES[n].reference
    ]
    traces = base.run(tuple(together), between=between)
    for name, values in sizes.items():
        if RECIPES[name].reference:
            added = _difference(RECIPES[name], values, base, between)
            traces = [_with_added_voltage(t, a) for t, a in zip(traces, added, strict=True)]
    return traces


def _with_stranger(
    name: str, traces: list[TrueRun], base: _CaseBase, truth: dict[str, float], seed: int
) -> list[TrueRun]:
    """The records with a stranger of the target size, with the same constants in each record."""
    shifts = [STRANGERS[name].shift(trace, base.capacity_ah, np.random.default_rng(seed)) for trace in traces]
    magnitude = base.spec.target_mv / MV_PER_V / rms(np.concatenate(shifts))
    truth[f"{name}.magnitude"] = magnitude
    return [
        _with_added_voltage(trace, magnitude * shift) for trace, shift in zip(traces, shifts, strict=True)
    ]


def _with_added_voltage(trace: TrueRun, added_v: Array) -> TrueRun:
    return replace(trace, voltage_v=trace.voltage_v + added_v)


def label_of(spec: CaseSpec) -> str:
    """The label that the case of a specification will have."""
    return _label(
        [name for name in spec.recipes if name not in STRANGERS],
        [name for name in spec.recipes if name in STRANGERS],
    )[0]


def _label(known: list[str], strange: list[str]) -> tuple[str, tuple[str, ...]]:
    if strange:
        return "unknown", ()
    if not known:
        return "none", (REDUCTION,)
    also = tuple(dict.fromkeys(a for name in known for a in RECIPES[name].also))
    return "+".join(dict.fromkeys(RECIPES[name].label for name in known)), also


def _as_measured(
    spec: CaseSpec, written: Written, trace: TrueRun, rng: np.random.Generator, between: int
) -> Measurement:
    degc = trace.temperature_degc[::between]
    shown = TrueRun(written.time_s, written.current_a, written.voltage_v, degc)
    return INSTRUMENT.write(shown, spec.name, rng, spec.warmth != "none")
