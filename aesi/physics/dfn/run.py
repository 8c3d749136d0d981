"""A record through the porous electrode."""

from __future__ import annotations

import numpy as np

from aesi.errors import InputError
from aesi.numerics.modes.collocation import gauss_layer
from aesi.numerics.modes.galerkin import gauss_lobatto
from aesi.numerics.typing import Array
from aesi.physics.dfn.arguments import porous_arguments
from aesi.physics.dfn.layout import DfnState, DfnTrial, NewtonScratch, Particles, Stack, Weights
from aesi.physics.espm.layout import CACHE_SLOTS, VOLTAGE_ROWS, Drive
from aesi.physics.model import EspmModel
from aesi.records import Hold

LONGER_STEPS = 2.0
"""Length of steps over that for the single particle, whose deviations are of first order. Under pulses of an LG M50 in
rows of 10 s, steps of 2 s are 0.004 mV RMS off steps of 0.25 s, and 5 s 0.012; a C/20 discharge of 37 h takes 0.7 s and
0.3. Where a diffusivity spans three decades, at the end of one of twenty pulses of 10 s at 0 degC, they are 0.95 and
2.6 mV off steps of 1/16 s in rows of 5 s, and 0.7 and 1.1 in rows of 10 s."""


def run_porous_electrode(
    model: EspmModel,
    time: Array,
    current: Array,
    temperature_k: Array | None,
    soc0: float,
    hold: Hold,
    unresolved_heat_w: Array | None = None,
    *,
    profiles: dict[str, Array] | None = None,
) -> tuple[Array, dict[str, Array], int, int]:
    """As `extended.run_extended`: (rows (7, n), further states by name, sample of the first fault, its kind).

    profiles : filled with the arrays of `Run.profiles`.  Raises InputError for an electrode cut into regions.
    """
    from aesi.physics.dfn.record_kernels import step_porous_record

    check_whole(model)
    particles, stack, electrodes = porous_arguments(model)
    out = np.empty((9, len(time)))
    kelvin = temperature_k if temperature_k is not None else np.array([model.cell.initial_temperature_k])
    state, trial, newton, weights = _memory(particles, stack)
    kept = 0 if profiles is None else len(time)
    profile = np.zeros((kept, 4, len(electrodes.node_share)))
    salt_profile = np.zeros((kept, len(stack.to_nodes)))
    steps = LONGER_STEPS * model.substep_s, model.most_substeps, model.step_refinement
    heat_w = np.empty(0) if unresolved_heat_w is None else unresolved_heat_w
    drive = Drive(time, current, kelvin, temperature_k is not None, hold == "backward", *steps, heat_w)
    theta0 = np.array(model.cell.stoichiometries(soc0))
    fault_at, fault = step_porous_record(
        drive, theta0, particles, stack, electrodes, state, trial, newton, weights, out, profile, salt_profile
    )
    extra = {"temperature_k": out[7]}
    if model.negative.plating is not None:
        extra["plated_mol_m3"] = out[8]
    if profiles is not None:
        profiles.update(_named(model, profile))
        profiles.update({"electrolyte_x_m": _nodes(model), "electrolyte_nodes_mol_m3": salt_profile})
    return out[:VOLTAGE_ROWS], extra, fault_at, fault


def check_whole(model: EspmModel) -> None:
    """Raises InputError for an electrode cut into regions."""
    if model.regions != 1:
        raise InputError(
            "reaction_nonuniformity is what the porous-electrode model has of itself; leave it out, or use model "
            "'espm'."
        )


def _named(model: EspmModel, profile: Array) -> dict[str, Array]:
    """The rows (n, 4, places) of `step_porous_record` by name, places from the negative collector to the positive."""
    n, s, p = model.cell.negative, model.cell.separator, model.cell.positive
    x = gauss_layer(model.electrode_points).x
    whole = n.thickness_m + s.thickness_m + p.thickness_m
    half = len(x)
    order = np.concatenate([np.arange(half), np.arange(2 * half - 1, half - 1, -1)])
    surface = [y.area_per_volume_1_m * y.thickness_m for y in (n, p)]
    theta, reaction, salt, potential = (profile[:, row, order] for row in range(4))
    return {
        "x_m": np.concatenate([n.thickness_m * x, whole - p.thickness_m * x])[order],
        "surface_stoichiometry": theta,
        "reaction_a_m2": reaction / np.repeat(surface, half),
        "electrolyte_mol_m3": salt * model.cell.electrolyte.c0_mol_m3,
        "potential_v": potential,
    }


def _nodes(model: EspmModel) -> Array:
    """(nodes,) m, positions of the electrolyte's nodes, from the negative collector to the positive one."""
    cell = model.cell
    inside = 0.5 * (gauss_lobatto(model.electrode_points + 1)[0] + 1.0)
    out, start = [np.zeros(1)], 0.0
    for layer in (cell.negative, cell.separator, cell.positive):
        out.append(start + layer.thickness_m * inside[1:])
        start += layer.thickness_m
    return np.concatenate(out)


def _memory(p: Particles, s: Stack) -> tuple[DfnState, DfnTrial, NewtonScratch, Weights]:
    """State and scratch at rest."""
    units, modes, kinds = len(p.place), len(p.gains), len(p.side)
    places, salt_modes = s.at.shape
    nodes, half = len(s.to_nodes), places // 2

    def of(*shape: int) -> Array:
        return np.zeros(shape)

    state = DfnState(
        z=of(units, modes), mean=of(units), y=of(units), trend=of(units), theta=of(units), flow=of(units, modes),
        largest=np.ones(kinds), q=of(salt_modes), forcing=of(salt_modes), c=of(nodes), reaction=of(places),
        psi=of(places), salt=np.ones(places), layer=of(places), plated=of(places),
    )  # fmt: skip
    trial = DfnTrial(
        base_z=of(units, modes), base_mean=of(units), base_q=of(salt_modes), base_salt=of(places),
        theta_base=of(units), theta_per_y=of(units), y_start=of(units), reaction_start=of(places),
        psi_start=of(places), y_back=of(units), skew=of(places), lag=of(places),
        metal_before=of(places), metal_filled=of(places),
        flow=of(units, modes), largest=np.ones(kinds), near=np.ones(kinds), rest=of(units, modes), force=of(modes + 1),
        forcing=of(salt_modes), forcing_before=of(salt_modes),
        salt_before=np.ones(places), q=of(salt_modes), c=of(nodes), salt=of(places), nodes=of(p.at.shape[0]),
        kappa=of(places), ohm=of(places, half), layer_c=of(places), layer_old=of(places),
        no_spread=of(places, places), z_end=of(modes), rates=np.ones(8),
        total=of(2), before=of(2), change=of(2), faster=np.ones(3),
    )  # fmt: skip
    newton = NewtonScratch(
        pot=of(units), slope=of(units), by_salt=of(units), excess=of(places), shift=of(places), conductance=of(places),
        d_y=of(units), d_psi=of(places), d_reaction=of(places), d_salt=of(places),
        y_in=of(units), psi_in=of(places),
        matrix=of(places, places), rhs=of(places, 3),
    )  # fmt: skip
    weights = Weights(
        keys=np.full(CACHE_SLOTS, -1, dtype=np.int64),
        particle=of(CACHE_SLOTS, kinds, 3, modes),
        taken=of(CACHE_SLOTS, kinds),
        salt=of(CACHE_SLOTS, 3, salt_modes),
        spread=of(CACHE_SLOTS, places, places),
    )
    return state, trial, newton, weights
