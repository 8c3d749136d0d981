"""Constants and state of the compiled steps, by name; numba takes named tuples of arrays as they are.

Units are particles: of one size, at one place. Places are Gauss points, those of the negative electrode first, each
counted from its collector. Currents of units and places are per area of the cell, positive for delithiation.
"""

from __future__ import annotations

from typing import NamedTuple

from aesi.numerics.typing import Array, IntArray


class Particles(NamedTuple):
    """Constants of the units.

    place, kind : (units,) place, and row of `rates`.  side : (kinds,) electrode.  scale : (units,)
    stoichiometry/(A/m2 s) per unit gain.  share, volume : (units,) share of its electrode's reaction and material.
    exchange : (units,) A/m2 at unit salt and occupancy.
    reactive : (units,) surface per area of cell.  rates : (kinds, modes) 1/s.  gains : (modes,).
    psi, strength, at, project : of the variable part of diffusion, see `tables.DiffusionTable` and `SphereModes`.
    """

    place: IntArray
    kind: IntArray
    side: IntArray
    scale: Array
    share: Array
    volume: Array
    exchange: Array
    reactive: Array
    rates: Array
    gains: Array
    psi: Array
    strength: Array
    at: Array
    project: Array


class Stack(NamedTuple):
    """Constants of the electrolyte.

    rates : (modes,) 1/s.  at : (places, modes) salt at the places, and how the reaction there feeds the modes.
    to_nodes, project : (nodes, modes) both ways.  psi, strength, top : the variable part of diffusion.  c0 : mol/m3.
    supply : mol/C, (1 - t+) / F.  kappa : table of conductivity on [0, top].
    path : (2,) m, thickness over transport efficiency of the electrodes.  gap_path : (nodes,) of the separator.
    """

    rates: Array
    at: Array
    to_nodes: Array
    project: Array
    psi: Array
    strength: float
    top: float
    c0: float
    supply: float
    kappa: Array
    gap_path: Array
    path: Array


class Electrodes(NamedTuple):
    """Constants of both electrodes and of the cell.

    before, after : see `collocation.GaussLayer`.  solid : (2, points, points) ohm m2.
    ocp, entropic, rate, film : (2, table).  alpha : (2,).  capacity, exchange : (places,) F/m2 and A/m2 of cell.
    node_share : (places,) weights.  plating : rate in A/m2 of cell per mol/m3 of salt, transfer coefficient, c0 in
    mol/m3.  plating_to_c : mol/m3 per C/m2.  energies : (8,) J/mol.  heat : (3,).  area : m2.  contact : ohm.
    transference : cation transference number.
    """

    before: Array
    after: Array
    solid: Array
    ocp: Array
    entropic: Array
    rate: Array
    film: Array
    alpha: Array
    has_layers: bool
    capacity: Array
    exchange: Array
    node_share: Array
    plating: Array
    plating_to_c: float
    energies: Array
    heat: Array
    area: float
    contact: float
    transference: float
    reference_k: float


class DfnState(NamedTuple):
    """State that a step changes.

    z : (units, modes) stoichiometry.  mean, theta : (units,) the same, of the whole particle and of its surface.
    y : (units,) A/m2, currents of the particles.  trend : (units,) A/(m2 s), rate at which y deviates from its share of
    the current.  flow : (units, modes) stoichiometry, modes of the integral of (diffusivity over that of the rates).
    largest : (kinds,) largest diffusivity of a profile over that of the rates.
    q, forcing : (salt modes,) mol/m3, of the salt, the latter of the variable part of diffusion.  c : (nodes,) mol/m3.
    reaction : (places,) A/m2 of cell, sum of particles, double layers and plating.  psi : (places,) V, see
    `reaction_kernels`.
    salt : (places,) over rest.  layer : (places,) A/m2 into double layers.  plated : (places,) mol/m3.
    """

    z: Array
    mean: Array
    y: Array
    trend: Array
    theta: Array
    flow: Array
    largest: Array
    q: Array
    forcing: Array
    c: Array
    reaction: Array
    psi: Array
    salt: Array
    layer: Array
    plated: Array


class DfnTrial(NamedTuple):
    """Scratch of a step. `base_...` is its end for zero reaction there; `..._start` and `..._back` are its start.
    Fields that `DfnState` has too have the same units.

    base_z, base_mean, base_q, base_salt, y_start, reaction_start, psi_start, flow, largest, forcing, q, c, salt : as
    there; y_start with what double layers lag by.
    theta_base, theta_per_y : (units,) stoichiometry, and that per A/m2: surface = theta_base - theta_per_y y.
    near : (kinds,) exactly stepped diffusivity over that of the rates.
    rest : (units, modes) stoichiometry, flow minus its exactly stepped part.
    force, z_end : (modes + 1,) and (modes,) of one unit, see `solid_forcing`.
    nodes : (points of a particle,) stoichiometry.  kappa : (places,) S/m.  salt_before, forcing_before : one step ago.
    ohm : (places, points of an electrode) ohm m2.
    layer_c A/(V m2), layer_old A/m2, skew, lag A/m2 : (places,) double layers.
    metal_before mol/m3, metal_filled mol/m3 per A/m2 : (places,) plated lithium, see `interface_kernels.stripped`.
    y_back : (units,) A/m2, without what double layers lag by.
    total, before, change : (2,) A/m2, currents of both electrodes at the end of a step, at its start, and their
    difference.  faster : (3,) factors of diffusion: negative, positive, salt.
    no_spread : zeros, for a solution at an instant.  rates : (8,) Arrhenius factors, by `Electrodes.energies`.
    """

    base_z: Array
    base_mean: Array
    base_q: Array
    base_salt: Array
    theta_base: Array
    theta_per_y: Array
    y_start: Array
    reaction_start: Array
    psi_start: Array
    y_back: Array
    flow: Array
    largest: Array
    near: Array
    rest: Array
    force: Array
    forcing: Array
    forcing_before: Array
    salt_before: Array
    q: Array
    c: Array
    salt: Array
    nodes: Array
    kappa: Array
    ohm: Array
    layer_c: Array
    layer_old: Array
    skew: Array
    lag: Array
    metal_before: Array
    metal_filled: Array
    no_spread: Array
    z_end: Array
    rates: Array
    total: Array
    before: Array
    change: Array
    faster: Array


class NewtonScratch(NamedTuple):
    """Scratch of Newton's method, and its start values y_in and psi_in.

    By unit: pot V, slope V per y, by_salt V, d_y and y_in as y.  By place: excess, shift, d_reaction A/m2, conductance
    A/(V m2), d_psi, psi_in V, d_salt over rest.
    """

    pot: Array
    slope: Array
    by_salt: Array
    excess: Array
    shift: Array
    conductance: Array
    d_y: Array
    d_psi: Array
    d_reaction: Array
    d_salt: Array
    y_in: Array
    psi_in: Array
    matrix: Array
    rhs: Array


class Weights(NamedTuple):
    """Weights of step lengths in use, by slot: see `diffusion_kernels.renew_particles` and `renew_salt`.

    keys : (slots,) nanoseconds, -1 for none.  particle : (slots, kinds, 3, modes).  taken : (slots, kinds) s.
    salt : (slots, 3, salt modes).  spread : (slots, places, places) m2/A.
    """

    keys: IntArray
    particle: Array
    taken: Array
    salt: Array
    spread: Array
