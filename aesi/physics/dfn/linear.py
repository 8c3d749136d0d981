"""The porous electrode in the frequency domain: its own equations, linearised about rest.

At place r, with s = jw, the local admittance of its particles and double layer takes the reaction Y_r from psi:

    psi_r = Y_r / (sum_u 1/(R_u - U' A_u(s)) + s C_r),      A_u = scale_u (3/s + sum gains/(s + rates))
    psi_r + sum_v (ohm[r, v] + chi spread[r, v](s)) Y_v = Phi of its electrode,      sum of Y = +- I

Surfaces fall by A_u y_u, R_u is R T / (F j0) of the kinetics and the film's resistance; salt and drops are as in
`reaction_kernels`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K
from aesi.numerics.typing import Array, ComplexArray
from aesi.physics.dfn.arguments import porous_arguments
from aesi.physics.dfn.layout import Electrodes, Particles, Stack
from aesi.physics.espm.plain import rate_factor
from aesi.physics.espm.tables import electrolyte_diffusion, solid_diffusion
from aesi.physics.model import EspmModel, activation_energies

POINTS = 16
"""Gauss points across an electrode: where double layers carry all of the current, it stays near the separator."""


def porous_impedance(
    model: EspmModel, slopes_v: Array, rest: Array, kelvin: float, omega: Array
) -> ComplexArray:
    """Impedance of the whole cell, (n,) ohm, complex.

    slopes_v : (2,) V, dU/dx of both electrodes at stoichiometries `rest` (2,).  omega : (n,) 1/s.
    """
    s: ComplexArray = np.asarray(1j * omega, dtype=np.complex128)
    model = replace(model, electrode_points=max(POINTS, model.electrode_points))
    particles, stack, electrodes = porous_arguments(model)
    rates = np.array(
        [
            rate_factor(energy, kelvin, model.cell.reference_temperature_k)
            for energy in activation_energies(model.cell)
        ]
    )
    thermal = GAS_CONSTANT_J_MOL_K * kelvin / FARADAY_C_MOL
    places = len(stack.at)
    half = places // 2
    local = _place_impedance(model, particles, electrodes, slopes_v, rest, thermal, rates, s)
    e = model.cell.electrolyte
    kappa = float(e.conductivity(np.array([e.c0_mol_m3]))[0]) * rates[5]
    matrix = np.zeros((len(s), places + 2, places + 2), dtype=complex)
    matrix[:, :places, :places] = _ohmic_drops(stack, electrodes, kappa) + _salt_impedance(
        model, stack, thermal, rates[4], s
    )
    matrix[:, np.arange(places), np.arange(places)] += local
    right = np.zeros((len(s), places + 2, 1), dtype=complex)
    for side, sign in enumerate((1.0, -1.0)):
        own = slice(side * half, (side + 1) * half)
        matrix[:, own, places + side] = -1.0
        matrix[:, places + side, own] = 1.0
        right[:, places + side] = sign / model.cell.total_area_m2
    solved = np.linalg.solve(matrix, right)[:, :, 0]
    gap = float(stack.gap_path.sum()) / kappa / model.cell.total_area_m2
    series = gap + electrodes.contact
    return cast(ComplexArray, solved[:, places] - solved[:, places + 1] + series)


def _place_impedance(
    model: EspmModel,
    p: Particles,
    e: Electrodes,
    slopes_v: Array,
    rest: Array,
    thermal: float,
    rates: Array,
    s: ComplexArray,
) -> ComplexArray:
    """(frequencies, places) ohm m2: potential over reaction of one place by itself."""
    electrodes = (model.cell.negative, model.cell.positive)
    faster = [
        rates[side] * float(x.diffusivity(rest[side : side + 1])[0]) / solid_diffusion(x.diffusivity).d0
        for side, x in enumerate(electrodes)
    ]
    exchange = [  # over its value at unit occupancy and factor
        float(x.rate_factor(at)[0]) * float(np.sqrt(at[0] * (1.0 - at[0])))
        for x, at in zip(electrodes, rest[:, None], strict=True)
    ]
    film = [float(x.film_ohm_m2(at)[0]) for x, at in zip(electrodes, rest[:, None], strict=True)]
    admittance = s[:, None] * e.capacity[None, :].astype(complex)
    for u, place in enumerate(p.place):
        kind = p.kind[u]
        side = p.side[kind]
        modes = (p.gains / (s[:, None] + faster[side] * p.rates[kind])).sum(axis=1)
        surface = p.scale[u] * (3.0 / s + modes)
        resistance = thermal / (p.exchange[u] * rates[2 + side] * exchange[side])
        resistance += film[side] / (rates[6 + side] * p.reactive[u])
        admittance[:, place] += 1.0 / (resistance - slopes_v[side] * surface)
    return cast(ComplexArray, 1.0 / admittance)


def _salt_impedance(
    model: EspmModel, stack: Stack, thermal: float, warmer: float, s: ComplexArray
) -> ComplexArray:
    """(frequencies, places, places) ohm m2: potential of the salt at r per reaction at v; its mean does not move."""
    e = model.cell.electrolyte
    d0 = electrolyte_diffusion(e.diffusivity, e.c0_mol_m3).d0
    here = warmer * float(e.diffusivity(np.array([e.c0_mol_m3]))[0]) / d0
    modes = 1.0 / (s[:, None] + here * stack.rates[None, 1:])
    at = stack.at[:, 1:]
    chi = 2.0 * (1.0 - e.transference) * thermal
    return cast(ComplexArray, chi * stack.supply / stack.c0 * np.einsum("rk,fk,vk->frv", at, modes, at))


def _ohmic_drops(stack: Stack, e: Electrodes, kappa: float) -> Array:
    """(places, places) ohm m2: drop from the collector to r and on to the separator, per reaction at v."""
    half = len(e.before)
    out = np.zeros((2 * half, 2 * half))
    for side in range(2):
        own = slice(side * half, (side + 1) * half)
        out[own, own] = e.solid[side] + stack.path[side] / kappa * (e.after @ e.before)
    return out
