"""Arguments of the compiled steps of the porous electrode, from a model."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from aesi.constants import FARADAY_C_MOL
from aesi.numerics.modes.collocation import gauss_layer, lobatto_to
from aesi.numerics.modes.galerkin import gauss_lobatto, sphere_modes, stack_modes
from aesi.numerics.typing import Array
from aesi.physics.dfn.layout import Electrodes, Particles, Stack
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


@lru_cache(maxsize=64)
def porous_arguments(model: EspmModel) -> tuple[Particles, Stack, Electrodes]:
    """Constants of a model, cached by value."""
    return _particles(model), _stack(model), _electrodes(model)


def _particles(model: EspmModel) -> Particles:
    """Constants of the units, ordered by place, then by particle size."""
    sphere, layer = sphere_modes(model.solid_order), gauss_layer(model.electrode_points)
    solids = solid_diffusions(model.cell)
    place, kind, scale, share, volume, exchange, reactive = [], [], [], [], [], [], []
    sides: list[int] = []
    rates: list[Array] = []
    parts = ((model.cell.negative, model.negative), (model.cell.positive, model.positive))
    for side, (electrode, interface) in enumerate(parts):
        first = len(rates)
        of_volume = sum(a * r for a, r in interface.bins)
        for _, ratio in interface.bins:
            # Where the diffusivity varies, each particle has its own profile and so its own weights.
            for _ in range(1 if solids[side].linear else model.electrode_points):
                rates.append(sphere.lam[1:] * solids[side].d0 / (electrode.particle_radius_m * ratio) ** 2)
                sides.append(side)
        for point, weight in enumerate(layer.weight):
            for size, (area_share, ratio) in enumerate(interface.bins):
                part = weight * area_share
                own = size if solids[side].linear else size * model.electrode_points + point
                radius = electrode.particle_radius_m * ratio
                area = electrode.area_per_volume_1_m * electrode.thickness_m * part
                place.append(side * model.electrode_points + point)
                kind.append(first + own)
                scale.append(1.0 / (area * FARADAY_C_MOL * radius * electrode.c_max_mol_m3))
                share.append(part)
                volume.append(part * ratio / of_volume)
                exchange.append(area * FARADAY_C_MOL * electrode.rate_constant)
                reactive.append(area)
    return Particles(
        place=np.array(place, dtype=np.int64),
        kind=np.array(kind, dtype=np.int64),
        side=np.array(sides, dtype=np.int64),
        scale=np.array(scale),
        share=np.array(share),
        volume=np.array(volume),
        exchange=np.array(exchange),
        reactive=np.array(reactive),
        rates=np.array(rates),
        gains=np.array(sphere.gain[1:]),
        psi=np.array([x.psi for x in solids]),
        strength=np.array([x.strength for x in solids]),
        at=np.array(sphere.at),
        project=np.array(sphere.project),
    )


def _stack(model: EspmModel) -> Stack:
    n, s, p = model.cell.negative, model.cell.separator, model.cell.positive
    e, order = model.cell.electrolyte, model.electrode_points
    layers = (n, s, p)
    stack = stack_modes(
        (n.thickness_m, s.thickness_m, p.thickness_m),
        (n.porosity, s.porosity, p.porosity),
        (n.transport_efficiency, s.transport_efficiency, p.transport_efficiency),
        order,
    )
    diffusion = electrolyte_diffusion(e.diffusivity, e.c0_mol_m3)
    layer = gauss_layer(order)
    positions = ((0, layer.x), (2, 1.0 - layer.x))  # each electrode's points count from its collector
    at_places = np.vstack(
        [lobatto_to(x, order) @ stack.to_nodes[k * order : (k + 1) * order + 1] for k, x in positions]
    )
    at_places[:, 0] = at_places[:, 0].mean()  # the conserved mode is uniform; this makes it exactly so
    return Stack(
        rates=stack.lam * diffusion.d0,
        at=at_places,
        to_nodes=np.array(stack.to_nodes),
        project=np.ascontiguousarray(stack.project.T),
        psi=diffusion.psi,
        strength=diffusion.strength,
        top=diffusion.top,
        c0=e.c0_mol_m3,
        supply=(1.0 - e.transference) / FARADAY_C_MOL,
        kappa=conductivity_table(e.conductivity, e.c0_mol_m3),
        gap_path=_gap_path(order, s.thickness_m / s.transport_efficiency),
        path=np.array([x.thickness_m / x.transport_efficiency for x in (layers[0], layers[2])]),
    )


def _gap_path(order: int, length_m: float) -> Array:
    """(nodes,) m, weights of the separator's nodes: their sum over the conductivities is its resistance x area."""
    path = np.zeros(3 * order + 1)
    path[order : 2 * order + 1] = 0.5 * length_m * gauss_lobatto(order + 1)[1]
    return path


def _electrodes(model: EspmModel) -> Electrodes:
    cell = model.cell
    n, p, e = cell.negative, cell.positive, cell.electrolyte
    layer = gauss_layer(model.electrode_points)
    sides = ((n, model.negative), (p, model.positive))
    capacity = [
        layer.weight
        * x.area_per_volume_1_m
        * x.thickness_m
        * (x.double_layer_f_m2 + interface.double_layer_f_m2)
        for x, interface in sides
    ]
    exchange = [
        layer.weight * x.area_per_volume_1_m * x.thickness_m * FARADAY_C_MOL * x.rate_constant
        for x, _ in sides
    ]
    plating = model.negative.plating or NO_PLATING
    area_n = n.area_per_volume_1_m * n.thickness_m
    return Electrodes(
        before=np.array(layer.before),
        after=np.array(layer.after),
        solid=np.array([layer.solid * x.thickness_m / x.conductivity_s_m for x in (n, p)]),
        ocp=ocp_tables(cell),
        entropic=entropic_tables(cell),
        rate=rate_tables(cell),
        film=film_tables(cell),
        alpha=np.array([x.transfer_coefficient for _, x in sides]),
        has_layers=any(x.double_layer_f_m2 + y.double_layer_f_m2 > 0.0 for x, y in sides),
        capacity=np.concatenate(capacity),
        exchange=np.concatenate(exchange),
        node_share=np.concatenate([layer.weight, layer.weight]),
        plating=np.array(
            [area_n * FARADAY_C_MOL * plating.rate_m_s, plating.transfer_coefficient, e.c0_mol_m3]
        ),
        plating_to_c=1.0 / (FARADAY_C_MOL * n.thickness_m),
        energies=activation_energies(model.cell),
        heat=heat_numbers(model),
        area=cell.total_area_m2,
        contact=cell.contact_resistance_ohm,
        transference=e.transference,
        reference_k=cell.reference_temperature_k,
    )
