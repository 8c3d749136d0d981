"""Arguments of the compiled extended path, which has all that effects add to the plain model.

Particles of several sizes, regions across each electrode, diffusivities that depend on stoichiometry, asymmetric
kinetics, double layers, plating, and a temperature that is measured or follows from a heat balance.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from aesi.constants import FARADAY_C_MOL
from aesi.numerics.modes.galerkin import ohmic_shares, sphere_modes
from aesi.numerics.typing import Array
from aesi.physics.espm.layout import (
    CACHE_SLOTS,
    VOLTAGE_ROWS,
    Drive,
    Memory,
    Modes,
    Salt,
    SaltMemory,
    Surfaces,
    Units,
    Whole,
)
from aesi.physics.espm.plain import stack_of
from aesi.physics.espm.tables import (
    conductivity_table,
    electrolyte_diffusion,
    entropic_tables,
    film_tables,
    ocp_tables,
    rate_tables,
    solid_diffusions,
)
from aesi.physics.model import NO_PLATING, EspmModel, activation_energies, heat_numbers
from aesi.records import Hold


def run_extended(
    model: EspmModel,
    time: Array,
    current: Array,
    temperature_k: Array | None,
    soc0: float,
    hold: Hold,
    unresolved_heat_w: Array | None = None,
) -> tuple[Array, dict[str, Array], int, int]:
    """(rows as of `plain.run_plain`, further states by name, sample of the first fault (-1 for none), its kind).

    model : that of the record, see `of_record`.  unresolved_heat_w : (n,) W, see `simulate`.
    """
    from aesi.physics.espm.extended_kernels import step_extended_record

    out = np.empty((9, len(time)))
    theta0 = np.array(model.cell.stoichiometries(soc0))
    kelvin = temperature_k if temperature_k is not None else np.array([model.cell.initial_temperature_k])
    steps = model.substep_s, model.most_substeps, model.step_refinement
    heat_w = np.empty(0) if unresolved_heat_w is None else unresolved_heat_w
    drive = Drive(time, current, kelvin, temperature_k is not None, hold == "backward", *steps, heat_w)
    arguments = extended_arguments(model)
    fault_at, fault = step_extended_record(
        drive, theta0, *arguments, *_memory(*arguments[:2], model.regions), out
    )
    extra = {"temperature_k": out[7]}
    if model.negative.plating is not None:
        extra["plated_mol_m3"] = out[8]
    return out[:VOLTAGE_ROWS], extra, fault_at, fault


def _memory(particles: Units, salt: Salt, regions: int) -> tuple[Memory, Modes, SaltMemory]:
    of = np.zeros
    units, order = particles.rates.shape
    nodes, salt_order = salt.to_nodes.shape
    memory = Memory(
        y=of(units), theta=of(units), pred=of(units), theta_per_y=of(units), ohm=of((regions, regions)),
        salt=np.ones(len(salt.gauss)), log_salt=of(2 * regions), region_salt=np.ones(2 * regions),
        delta=of(2 * regions), layer=of(2 * regions), ahead=of(2 * regions), total=of(2 * regions),
        plated=of(regions), new_plated=of(regions), kappa=np.ones(2 * regions + 1), deviation=of(2 * regions),
        potential=of(units), slope=of(units), gain=of(units), matrix=of((units + 1, units + 2)), move=of(units + 1),
        new_delta=of(regions), new_layer=of(regions), fitted=of(regions), conductance=of(regions),
    )  # fmt: skip
    modes = Modes(
        z=of((units, order)), means=of(units),
        nodes=of(len(particles.at)), force=of(order + 1), force_end=of(order + 1), faster=np.ones(3),
        near=np.ones(units), largest=np.ones(units),
        keys=np.full(CACHE_SLOTS, -1, dtype=np.int64),
        w=of((CACHE_SLOTS, units, 3, order)), w_e=of((CACHE_SLOTS, 3, salt_order)),
    )  # fmt: skip
    return memory, modes, SaltMemory(*map(of, (salt_order, nodes, nodes, salt_order, salt_order)))


@lru_cache(maxsize=64)
def extended_arguments(model: EspmModel) -> tuple[Units, Salt, Surfaces, Whole]:
    """Constants of the cell for `extended_kernels.step_extended_record`."""
    cell = model.cell
    whole = Whole(
        energies=activation_energies(cell),
        heat=heat_numbers(model),
        area=cell.total_area_m2,
        separator=cell.separator.thickness_m / cell.separator.transport_efficiency,
        contact=cell.contact_resistance_ohm,
        reference_k=cell.reference_temperature_k,
    )
    return particle_units(model), _salt(model), _surfaces(model), whole


def _salt(model: EspmModel) -> Salt:
    e, stack = model.cell.electrolyte, stack_of(model)
    diffusion = electrolyte_diffusion(e.diffusivity, e.c0_mol_m3)
    return Salt(
        rates=stack.lam * diffusion.d0,
        gains=stack.gain * (1.0 / FARADAY_C_MOL),
        to_nodes=stack.to_nodes,
        project=np.ascontiguousarray(stack.project.T),
        gauss=stack.gauss,
        mean=stack.mean,
        psi=diffusion.psi,
        strength=diffusion.strength,
        top=diffusion.top,
        c0=e.c0_mol_m3,
        kappa=conductivity_table(e.conductivity, e.c0_mol_m3),
        supply=1.0 - e.transference,
    )


def particle_units(model: EspmModel) -> Units:
    """Constants of the particles, ordered by region from each collector, then by size."""
    solids = solid_diffusions(model.cell)
    sphere = sphere_modes(model.solid_order)
    units, rates, gains, lump, share, volume, exchange = [], [], [], [], [], [], []
    reactive = []
    sides = ((model.cell.negative, model.negative), (model.cell.positive, model.positive))
    for side, (electrode, interface) in enumerate(sides):
        for region in range(model.regions):
            for area_share, radius_ratio in interface.bins:
                part = area_share / model.regions
                radius = electrode.particle_radius_m * radius_ratio
                area = electrode.area_per_volume_1_m * electrode.thickness_m * part
                per_charge = 1.0 / (area * FARADAY_C_MOL * radius * electrode.c_max_mol_m3)
                units.append((side, region))
                rates.append(sphere.lam[1:] * solids[side].d0 / radius**2)
                gains.append(sphere.gain[1:] * per_charge)
                lump.append(3.0 * per_charge)
                share.append(part)
                volume.append(part * radius_ratio)
                exchange.append(area * FARADAY_C_MOL * electrode.rate_constant)
                reactive.append(area)
    sums = [sum(v for v, unit in zip(volume, units, strict=True) if unit[0] == side) for side in range(2)]
    fractions = [v / sums[unit[0]] for v, unit in zip(volume, units, strict=True)]
    return Units(
        place=np.array(units, dtype=np.int64),
        rates=np.array(rates),
        gains=np.array(gains),
        lump=np.array(lump),
        share=np.array(share),
        volume=np.array(fractions),
        exchange=np.array(exchange),
        reactive=np.array(reactive),
        psi=np.array([x.psi for x in solids]),
        strength=np.array([x.strength for x in solids]),
        at=sphere.at,
        project=sphere.project,
    )


def _surfaces(model: EspmModel) -> Surfaces:
    n = model.cell.negative
    plating = model.negative.plating or NO_PLATING
    area_n = n.area_per_volume_1_m * n.thickness_m / model.regions
    solid, salt = ohmic_drops(model)
    return Surfaces(
        ocp=ocp_tables(model.cell),
        entropic=entropic_tables(model.cell),
        rate=rate_tables(model.cell),
        film=film_tables(model.cell),
        alpha=np.array([model.negative.transfer_coefficient, model.positive.transfer_coefficient]),
        capacity=np.array([interface_capacity(model, side) for side in range(2)]),
        plating=np.array([area_n * FARADAY_C_MOL * plating.rate_m_s, plating.transfer_coefficient]),
        plating_to_c=model.regions / (FARADAY_C_MOL * n.thickness_m),
        solid=solid,
        salt=salt,
    )


def interface_capacity(model: EspmModel, side: int) -> float:
    """Capacity of the double layer of one region of an electrode (0 negative, 1 positive), F/m2 of cell."""
    cell = model.cell
    electrode, interface = ((cell.negative, model.negative), (cell.positive, model.positive))[side]
    area = electrode.area_per_volume_1_m * electrode.thickness_m / model.regions
    return (electrode.double_layer_f_m2 + interface.double_layer_f_m2) * area


def ohmic_drops(model: EspmModel) -> tuple[Array, Array]:
    """(resistances of the solid, ohm m2; those of the electrolyte times its conductivity, m), (2, regions, regions)."""
    n, p = model.cell.negative, model.cell.positive
    solid, salt = ohmic_shares(model.regions)
    return (
        np.array([solid * n.thickness_m / n.conductivity_s_m, solid * p.thickness_m / p.conductivity_s_m]),
        np.array(
            [salt * n.thickness_m / n.transport_efficiency, salt * p.thickness_m / p.transport_efficiency]
        ),
    )
