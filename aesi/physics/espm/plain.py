"""Arguments of the compiled plain path: linear solid diffusion, closed-form kinetics, one temperature."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K
from aesi.numerics.modes.galerkin import StackModes, sphere_modes, stack_modes
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell, Electrode
from aesi.physics.cell.relations import Constant, Relation, Scaled, Sum
from aesi.physics.espm.layout import CACHE_SLOTS
from aesi.physics.espm.plain_layout import PlainCell, PlainMemory, PlainSalt, PlainSolid
from aesi.physics.espm.tables import conductivity_table, electrolyte_diffusion, ocp_table
from aesi.physics.model import EspmModel
from aesi.records import Hold


def run_plain(
    model: EspmModel, time: Array, current: Array, soc0: float, hold: Hold
) -> tuple[Array, int, int]:
    """(rows (7, n), `SolvedRows`; sample of the first fault (-1 for none); its kind): a fault is a surface or salt out
    of range."""
    from aesi.physics.espm.plain_kernels import step_plain_record

    out = np.empty((7, len(time)))
    theta0 = np.array(model.cell.stoichiometries(soc0))
    arguments = plain_arguments(model)
    memory = _memory(*arguments[:2])
    fault_at, fault = step_plain_record(time, current, hold == "backward", theta0, *arguments, memory, out)
    return out, fault_at, fault


def _memory(solid: PlainSolid, salt: PlainSalt) -> PlainMemory:
    (nodes, salt_modes), modes = salt.to_nodes.shape, solid.rates.shape[1]
    return PlainMemory(
        z_n=np.zeros(modes),
        z_p=np.zeros(modes),
        q=np.zeros(salt_modes),
        c=np.zeros(nodes),
        g=np.zeros(6),
        forcing=np.zeros(salt_modes),
        before=np.zeros(salt_modes),
        rest=np.zeros(nodes),
        keys=np.full(CACHE_SLOTS, -1, dtype=np.int64),
        parts=np.ones(CACHE_SLOTS, dtype=np.int64),
        w_n=np.zeros((CACHE_SLOTS, 3, modes)),
        w_p=np.zeros((CACHE_SLOTS, 3, modes)),
        w_e=np.zeros((CACHE_SLOTS, 5, salt_modes)),
    )


def rate_factor(energy_j_mol: float, temperature_k: float, reference_k: float) -> float:
    """Factor of a rate at `temperature_k` over that at `reference_k`."""
    return float(np.exp(energy_j_mol / GAS_CONSTANT_J_MOL_K * (1.0 / reference_k - 1.0 / temperature_k)))


def shifted_ocp(electrode: Electrode, rise_k: float) -> Relation:
    """Open-circuit potential (V over stoichiometry) at `rise_k` above the reference temperature."""
    if rise_k == 0.0 or electrode.entropic == Constant(0.0):
        return electrode.ocp
    return Sum(electrode.ocp, Scaled(electrode.entropic, rise_k))


def stoichiometry_per_coulomb(cell: Cell, electrode: Electrode) -> float:
    """Change of stoichiometry per charge at a surface gain of one, 1/C: 1 / (F R c_max x reactive area)."""
    area = cell.reactive_area_m2(electrode)
    return 1.0 / (area * FARADAY_C_MOL * electrode.particle_radius_m * electrode.c_max_mol_m3)


def stack_of(model: EspmModel) -> StackModes:
    """Electrolyte modes of a model, cached by geometry."""
    n, s, p = model.cell.negative, model.cell.separator, model.cell.positive
    return stack_modes(
        (n.thickness_m, s.thickness_m, p.thickness_m),
        (n.porosity, s.porosity, p.porosity),
        (n.transport_efficiency, s.transport_efficiency, p.transport_efficiency),
        model.electrolyte_order,
        model.regions,
    )


def _salt_gain(stack: StackModes) -> Array:
    """Gain of a current that enters one electrode and leaves the other, its mean exactly zero."""
    gain = stack.gain[0] - stack.gain[1]
    gain[0] = 0.0
    return gain


@lru_cache(maxsize=64)
def plain_arguments(model: EspmModel) -> tuple[PlainSolid, PlainSalt, PlainCell]:
    """Constants of the cell for `plain_kernels.step_plain_record`."""
    cell = model.cell
    n, p, e = cell.negative, cell.positive, cell.electrolyte
    temperature, reference = cell.initial_temperature_k, cell.reference_temperature_k
    sphere, stack = sphere_modes(model.solid_order), stack_of(model)
    rates = np.array([sphere.lam[1:] * _solid_rate(x, temperature, reference) for x in (n, p)])
    scale = np.array([stoichiometry_per_coulomb(cell, x) for x in (n, p)])
    diffusion = electrolyte_diffusion(e.diffusivity, e.c0_mol_m3)
    faster = rate_factor(e.diffusivity_ea_j_mol, temperature, reference)
    salt_gain = _salt_gain(stack) * (1.0 - e.transference) / (FARADAY_C_MOL * cell.total_area_m2)
    return (
        PlainSolid(rates, scale[:, None] * sphere.gain[None, 1:], 3.0 * scale),
        PlainSalt(
            rates=stack.lam * diffusion.d0 * faster,
            gains=salt_gain,
            to_nodes=stack.to_nodes,
            project=np.ascontiguousarray(stack.project.T),
            gauss=stack.gauss,
            mean=stack.mean,
            psi=diffusion.psi,
            strength=1.0 / diffusion.d0,
            nonlinear=not diffusion.linear,
            substep=model.substep_s,
            most=model.most_substeps,
            finer=model.step_refinement,
        ),
        _cell(model, temperature, diffusion.top),
    )


def _solid_rate(electrode: Electrode, temperature: float, reference: float) -> float:
    d = float(electrode.diffusivity(np.array([0.5]))[0])
    faster = rate_factor(electrode.diffusivity_ea_j_mol, temperature, reference)
    return d * faster / electrode.particle_radius_m**2


def _cell(model: EspmModel, temperature: float, top: float) -> PlainCell:
    cell = model.cell
    n, s, p, e = cell.negative, cell.separator, cell.positive, cell.electrolyte
    thermal_v = GAS_CONSTANT_J_MOL_K * temperature / FARADAY_C_MOL
    reference = cell.reference_temperature_k
    rise = temperature - reference
    conductivity = conductivity_table(e.conductivity, e.c0_mol_m3)
    through_layers = n.thickness_m / (3.0 * n.transport_efficiency) + s.thickness_m / s.transport_efficiency
    return PlainCell(
        ocp_n=ocp_table(shifted_ocp(n, rise), "negative"),
        ocp_p=ocp_table(shifted_ocp(p, rise), "positive"),
        kappa=conductivity * rate_factor(e.conductivity_ea_j_mol, temperature, reference),
        area=cell.total_area_m2,
        c0=e.c0_mol_m3,
        top=top,
        reactive_n=n.area_per_volume_1_m * n.thickness_m,
        reactive_p=p.area_per_volume_1_m * p.thickness_m,
        exchange_n=FARADAY_C_MOL * n.rate_constant * rate_factor(n.rate_ea_j_mol, temperature, reference),
        exchange_p=FARADAY_C_MOL * p.rate_constant * rate_factor(p.rate_ea_j_mol, temperature, reference),
        thermal_v=thermal_v,
        salt_v=2.0 * (1.0 - e.transference) * thermal_v,
        path=through_layers + p.thickness_m / (3.0 * p.transport_efficiency),
        solid=(n.thickness_m / n.conductivity_s_m + p.thickness_m / p.conductivity_s_m) / 3.0,
        contact=cell.contact_resistance_ohm,
    )
