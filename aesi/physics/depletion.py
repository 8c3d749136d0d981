"""The sentence on why a simulation cannot go on, with the true cause.

Three causes look alike in a voltage and need different remedies: more charge than the cell has, a current that solid
diffusion cannot follow, and a current that the electrolyte cannot carry. The latter two are more likely in the cold.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from aesi.constants import FARADAY_C_MOL, ZERO_CELSIUS_K
from aesi.numerics.typing import Array
from aesi.over_time import stamp
from aesi.physics.espm.plain import rate_factor, stack_of
from aesi.physics.model import EspmModel, SolvedRows

LAYERS = {1: "negative electrode", 2: "positive electrode"}
MOST_PERCENT = 1e4
"""Per cent of the charge, from which on a message gives three digits."""
SALT, NO_SOLUTION = 3, 4
DRY_SHARE = 0.02
"""Share of the rest concentration at a collector below which the lack of salt is why no reaction can be found."""

RUN_ON = ', or let it run on: aesi simulate --run-on, in Python on_depletion="clip".'
"""How each of these sentences ends."""


def depletion_sentence(
    model: EspmModel, time_s: Array, current_a: Array, kelvin: float, rows: Array, at: int, what: int
) -> str:
    """Why a simulation stopped, and what to check: one sentence that ends with `RUN_ON`.

    time_s, current_a : (n,) s, A, of the record.  kelvin : temperature at the fault, K.  rows : (7, n),
    `SolvedRows`.  at : the first faulty row.  what : 1 or 2, the surface of that electrode (`LAYERS`); `SALT`; or
    `NO_SOLUTION`.
    """
    cell, run = model.cell, SolvedRows(*rows)
    way_there = current_a[max(at - 1, 0) : at + 1]
    asked_a = float(way_there[np.argmax(np.abs(way_there))])
    head = f"{cell.name}: {_cut_off_clause(model, time_s, run.voltage_v, at, charging=asked_a < 0.0)}"
    where = f"at {stamp(time_s[at])} s"  # of a row the file may know nothing: models run on rows of their own
    amperes = abs(asked_a)
    driest = float(np.min([run.c_e0[at], run.c_el[at]])) / cell.electrolyte.c0_mol_m3
    if what == SALT or (what == NO_SOLUTION and driest < DRY_SHARE):
        cause = _salt_clause(model, kelvin, asked_a, where)
    elif what == NO_SOLUTION:
        cause = (
            f"no reaction was found that carries {amperes:.3g} A at {kelvin - ZERO_CELSIUS_K:.3g} degC, {where}; check "
            "the unit of the current"
        )
    else:
        cause = _surface_clause(model, kelvin, amperes, rows, at, what, where)
    return f"{head}{cause}{RUN_ON}"


def _salt_clause(model: EspmModel, kelvin: float, asked_a: float, where: str) -> str:
    """A clause: the electrolyte ran out of salt, and whether that is for the cold.

    kelvin : temperature at the fault, K.  asked_a : current there, A, discharge positive.  where : its time, in words.
    """
    reference_k = model.cell.reference_temperature_k
    here, there = (limiting_current_a(model, t, charging=asked_a < 0.0) for t in (kelvin, reference_k))
    cause = (
        f"the electrolyte ran out of salt {where}: at {kelvin - ZERO_CELSIUS_K:.3g} degC it carries {here:.3g} A for "
        f"long, and the record asks for {abs(asked_a):.3g} A"
    )
    if here < 0.9 * there:
        return (
            f"{cause} (at {reference_k - ZERO_CELSIUS_K:.3g} degC it would carry {there:.3g} A); it is too cold for "
            "this current. Check the electrolyte's diffusivity and its activation energy"
        )
    return f"{cause}. Check the unit of the current and the electrolyte's diffusivity"


def _per_cent(share: float) -> str:
    """A share as per cent to a tenth; in a few digits where it is far beyond what a cell holds."""
    percent = 100.0 * share
    return f"{percent:.1f}" if abs(percent) < MOST_PERCENT else f"{percent:.3g}"


def _surface_clause(
    model: EspmModel, kelvin: float, amperes: float, rows: Array, at: int, what: int, where: str
) -> str:
    """A clause: a surface is empty or full, by the charge of the record or by a current too large for solid diffusion.

    rows : (7, n), `SolvedRows`.  at : the faulty row.  what : 1 or 2, the electrode.  amperes : magnitude of the
    current there.  Others as `_salt_clause`.
    """
    cell, electrode, row = model.cell, (model.cell.negative, model.cell.positive)[what - 1], rows[:, at]
    every = cell.soc_of(SolvedRows(*rows).mean_n)
    soc = float(every[at])
    surface = (
        f"the surface of the {LAYERS[what]} left the stoichiometry range [0, 1] {where}, at a state of charge of "
        f"{_per_cent(soc)} %"
    )
    if not 0.0 <= soc <= 1.0:
        # A simulation goes on past its fault, so that the charge of the whole record is known.
        asks, by = (
            ("asks for more charge than the cell has", -np.nanmin(every))
            if soc < 0.0
            else ("brings more charge than the cell can hold", np.nanmax(every) - 1.0)
        )
        return (
            f"{surface}: the record {asks}, by {_per_cent(by)} % of its capacity in all. Check soc0, the capacity and "
            "the sign of the current"
        )
    cause = (
        f"{surface}, while its particles hold {_per_cent(float(row[4 + what]))} % in the mean: solid diffusion cannot "
        f"follow {amperes:.3g} A"
    )
    slower = rate_factor(electrode.diffusivity_ea_j_mol, kelvin, cell.reference_temperature_k)
    if slower < 0.9:
        cause += (
            f" at {kelvin - ZERO_CELSIUS_K:.3g} degC, where it is {1.0 / slower:.2g} times slower than at the "
            "reference temperature"
        )
    return f"{cause}. Check soc0, the capacity, the diffusivity with its activation energy and the unit of the current"


def ran_out(name: str, at_s: Mapping[str, float]) -> str:
    """A sentence on a record on which clipped simulations ran out; their errors mean nothing from there on.

    at_s : what was simulated, in words, to the time at which it ran out, s.
    """
    from aesi.physics.espm.kernels import BEYOND_RANGE_V  # compiled code, which is read when it is first used

    where = ", ".join(f"in {model} at {stamp(when)} s" for model, when in at_s.items())
    return (
        f"{name}: a particle's surface or the electrolyte runs empty or full {where}. From then on kinetics "
        f"are held at the limit, open-circuit potentials are extrapolated by {BEYOND_RANGE_V:g} V per unit of "
        "stoichiometry and concentrations leave their physical range: the error from there on shows only that the "
        "model ran out, not how accurate it is."
    )


def limiting_current_a(model: EspmModel, kelvin: float, charging: bool) -> float:
    """Limiting current of the electrolyte, A, >= 0: the steady current at which the mean salt is zero in the electrode
    that it leaves (the positive one on discharge, the negative one on charge), with the diffusivity at the rest
    concentration."""
    cell, stack = model.cell, stack_of(model)
    e = cell.electrolyte
    faster = rate_factor(e.diffusivity_ea_j_mol, kelvin, cell.reference_temperature_k)
    rates = stack.lam[1:] * float(e.diffusivity(np.array([e.c0_mol_m3]))[0]) * faster
    regions = model.regions
    enters = stack.gain[:regions, 1:].mean(axis=0) - stack.gain[regions:, 1:].mean(axis=0)
    moved = stack.to_nodes[:, 1:] @ (
        enters * (1.0 - e.transference) / FARADAY_C_MOL / cell.total_area_m2 / rates
    )
    at_points = stack.gauss[: 6 * regions] @ moved
    weights = np.tile([5.0, 8.0, 5.0], regions) / 18.0 / regions
    gained_n, gained_p = (float(weights @ part) for part in np.split(at_points, 2))  # by 1 A of discharge
    return e.c0_mol_m3 / (gained_n if charging else -gained_p)


def _cut_off_clause(model: EspmModel, time_s: Array, voltage_v: Array, at: int, charging: bool) -> str:
    """A clause on the time before the fault at which the cut-off voltage was passed, where a test would end; '' where
    it was not.

    charging : whether the cell is charged at the fault."""
    cell, seen = model.cell, voltage_v[: at + 1]
    name, limit = ("upper", cell.upper_voltage_v) if charging else ("lower", cell.lower_voltage_v)
    passed = seen > limit if charging else seen < limit
    if not passed.any():
        return ""
    when = stamp(time_s[int(np.argmax(passed))])
    return f"the voltage passed the {name} cut-off ({limit:g} V) at {when} s and the record goes on; "
