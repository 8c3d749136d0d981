"""Sentences for the user on fields of a BPX file that no simulation here uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.typing import Array
from aesi.physics.cell.bpx.transport import inside_window
from aesi.physics.cell.parts import (
    CAPACITY_SHARES,
    CONTACT_RESISTANCE,
    DOUBLE_LAYERS,
    FILM_ENERGIES,
    FILM_RESISTANCES,
    FITTED_AT,
    FITTED_WITH,
    INITIAL_SOC,
    RATE_FACTORS,
    TESTED_ON,
    THERMAL_CONDUCTIVITY,
    CellParameters,
)
from aesi.physics.cell.relations import LEAST_TRANSPORT, WORKING_SPAN, LookupTable, Relation

OWN_FIELDS = {
    CONTACT_RESISTANCE,
    CAPACITY_SHARES,
    TESTED_ON,
    FITTED_AT,
    THERMAL_CONDUCTIVITY,
    *(
        field
        for fields in (DOUBLE_LAYERS, FILM_ENERGIES, FILM_RESISTANCES, FITTED_WITH, RATE_FACTORS)
        for field in fields.values()
    ),
}
"""Fields of the section `User-defined` that are read."""
POINTS = 401
"""Number of points at which relations are evaluated."""
OTHER_CAPACITY = 1.5
"""Largest factor, in both directions, between the declared capacity and that of an electrode between its limits: 0.94
to 1.01 in the files of ten cells."""
RISES_V = 1e-3
"""Least rise of a potential towards a fuller electrode that is told, V: none in the window of any shipped file, 0.04 mV
in those of eight published sets (of PyBaMM)."""
HYSTERESIS_STATE = "Initial hysteresis state"
"""Beginning of the names of the two fields, one per electrode."""
BRANCHES = ("OCP (lithiation) [V]", "OCP (delithiation) [V]")


def unread_field_sentences(v1: Mapping[str, Any]) -> tuple[str, ...]:
    """Sentences on the fields of a BPX 1.x mapping that are ignored but would change a simulation."""
    parts, sentences = v1["Parameterisation"], []
    branched = [
        side
        for side in ("Negative electrode", "Positive electrode")
        if any(parts[side].get(name) is not None for name in BRANCHES)
    ]
    if branched:
        sentences.append(
            f"the cell's file declares a hysteresis ({', '.join(branched)}: OCP by direction), which is not simulated: "
            "'OCP [V]' holds both ways; the effect ocv_hysteresis adds one."
        )
    initial = (v1.get("State") or {}).get("Initial conditions") or {}
    begun = [
        f"{name} {value}"
        for name, value in initial.items()
        if (name.startswith(HYSTERESIS_STATE) and value is not None)
        or (name == INITIAL_SOC and value not in (None, 1.0))
    ]
    if begun:
        sentences.append(
            f"the cell's file declares how it begins ({', '.join(begun)}), which is not simulated: a record starts at "
            "the state of charge that is given or that its voltage says."
        )
    ageing = (v1.get("State") or {}).get("Degradation") or {}
    lost = [f"{name} {value}" for name, value in ageing.items() if value]
    if lost:
        sentences.append(
            f"the cell's file declares an aged state ({', '.join(lost)}), which is not simulated: the cell is taken as "
            "new; --soh or the effects of ageing take it as aged."
        )
    own = [name for name in parts.get("User-defined") or {} if name not in OWN_FIELDS]
    if own:
        sentences.append(f"fields of the cell's file that are not read (User-defined): {', '.join(own)}.")
    return tuple(sentences)


def version_0_sentences(names: Sequence[str]) -> tuple[str, ...]:
    """A sentence on fields of a cell in BPX 0.x that have no counterpart in 1.x."""
    if not names:
        return ()
    own = (
        f"; how a winding conducts to its case is read from {THERMAL_CONDUCTIVITY!r} in the section 'User-defined'"
        if THERMAL_CONDUCTIVITY in names
        else ""
    )
    return (f"fields of the cell's file, of BPX 0.x, that are not read (Cell): {', '.join(names)}{own}.",)


def capacity_sentences(cell: CellParameters) -> tuple[str, ...]:
    """A sentence where the nominal capacity is far from that of an electrode between its stoichiometry limits."""
    for side, electrode in cell.electrodes.items():
        held_ah = cell.window_capacity_ah(electrode)
        ratio = cell.nominal_capacity_ah / held_ah
        if not 1.0 / OTHER_CAPACITY <= ratio <= OTHER_CAPACITY:
            return (
                f"the cell's file declares {cell.nominal_capacity_ah:.4g} Ah, and its {side} electrode holds "
                f"{held_ah:.4g} Ah between its stoichiometry limits, which is what is simulated: correct 'Nominal cell "
                "capacity [A.h]', or the area, the thickness, the number of electrode pairs or the limits.",
            )
    return ()


def rising_potential_sentences(cell: CellParameters) -> tuple[str, ...]:
    """A sentence on each electrode whose potential rises with its stoichiometry somewhere between its limits."""
    sentences = []
    for side, electrode in cell.electrodes.items():
        at = inside_window(electrode)
        if isinstance(electrode.ocp, LookupTable):
            nodes = np.asarray(electrode.ocp.x)
            at = np.union1d(at, nodes[(nodes > at[0]) & (nodes < at[-1])])
        potential_v = electrode.ocp(at)
        risen_v = potential_v - np.minimum.accumulate(potential_v)
        top = int(np.argmax(risen_v))
        if risen_v[top] >= RISES_V:
            foot = int(np.argmin(potential_v[: top + 1]))
            sentences.append(
                f"the potential of the {side} electrode rises by {MV_PER_V * risen_v[top]:.0f} mV between the "
                f"stoichiometries {at[foot]:.4g} and {at[top]:.4g}, and should fall: correct it there; a state of "
                "charge that is read from a voltage is wrong around it."
            )
    return tuple(sentences)


def flat_voltage_sentences(cell: CellParameters) -> tuple[str, ...]:
    """A sentence where both potentials are constant, so that no voltage tells a state of charge."""
    rest_v = cell.rest_voltage_v(np.linspace(0.0, 1.0, POINTS))
    if np.ptp(rest_v) > 0.0:
        return ()
    return (
        f"the open-circuit voltage by the cell's file is {rest_v[0]:.4g} V at every state of charge, since 'OCP [V]' "
        "of both electrodes is constant: give tables or formulas over the stoichiometry.",
    )


def replaced_relation_sentences(cell: CellParameters) -> tuple[str, ...]:
    """Sentences on relations that are not simulated as declared somewhere in the range of the surfaces or the salt."""
    sentences = []
    stoichiometry = np.linspace(0.0, 1.0, POINTS)
    for side, electrode in cell.electrodes.items():
        what = f"the diffusivity of the {side} electrode"
        sentences += _not_positive_sentences(
            electrode.diffusivity, stoichiometry, what, "stoichiometries of {}", "at 0.5"
        )
        ocp = electrode.ocp
        if isinstance(ocp, LookupTable) and (ocp.x[0] > 0.0 or ocp.x[-1] < 1.0):
            low, high = electrode.theta_min, electrode.theta_max
            constant = (
                f"its stoichiometry limits are {low:.4g} and {high:.4g}, so that at rest, too, it stays at the last "
                "value between the two, and no state of charge there can be told from a voltage: give a table over all "
                "of that"
                if low < ocp.x[0] or ocp.x[-1] < high
                else "where surfaces leave that under load it stays at the last value, and the voltage falls or rises "
                "late"
            )
            sentences.append(
                f"the potential of the {side} electrode is a table from {ocp.x[0]:.4g} to {ocp.x[-1]:.4g}; {constant}."
            )
    electrolyte = cell.electrolyte
    salt = electrolyte.c0_mol_m3 * np.linspace(*WORKING_SPAN, POINTS)
    for name, relation in (
        ("diffusivity", electrolyte.diffusivity),
        ("conductivity", electrolyte.conductivity),
    ):
        sentences += _not_positive_sentences(
            relation, salt, f"the {name} of the electrolyte", "{} mol/m3", "at rest"
        )
    return tuple(sentences)


def _not_positive_sentences(relation: Relation, at: Array, what: str, places: str, rest: str) -> list[str]:
    """A sentence where a relation is not positive at some of the places `at` (n,); empty where it is.

    what : the relation, in words.  places : format of a range of `at`.  rest : place of the value that is taken.
    """
    values = relation(at)
    wrong = at[~((values > 0.0) & np.isfinite(values))]
    if not len(wrong):
        return []
    span = f"{wrong[0]:.4g}" + (f" to {wrong[-1]:.4g}" if len(wrong) > 1 else "")
    return [
        f"{what} is no positive number at {places.format(span)}: {LEAST_TRANSPORT:g} of that {rest} is taken there; "
        "give a table, or a formula that holds."
    ]
