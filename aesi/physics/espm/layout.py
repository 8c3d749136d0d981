"""Constants and state of the compiled steps of the single particle, by name.

numba takes named tuples of arrays as they are, without cost. Units are particles: of one size, in one region of an
electrode, those of the negative electrode first; regions are counted from the collector.
"""

from __future__ import annotations

from typing import NamedTuple

from aesi.numerics.typing import Array, IntArray

CACHE_SLOTS = 61
"""Number of step lengths whose weights are kept; the slot is the length in nanoseconds modulo this. A prime, since
whole milliseconds are multiples of 64: with 64 slots, weights of alternating steps were computed again at each step."""
VOLTAGE_ROWS = 7
"""Rows of the output of every path: voltage, surface stoichiometries (n, p), salt at the collectors (n, p) and mean
stoichiometries (n, p). Rows of further states follow."""


class Drive(NamedTuple):
    """A record for the compiled steps.

    time, current : (n,) s, A.  temperature : K, (n,) where `has_temperature`, else (1,) at the start.
    backward : a row's current holds since the row before.  substep, most : s and count of the steps within a row.
    finer : see `EspmModel.step_refinement`.
    unresolved_heat : (n,) W, see `aesi.physics.effect.Record`; (0,) for none.
    """

    time: Array
    current: Array
    temperature: Array
    has_temperature: bool
    backward: bool
    substep: float
    most: int
    finer: float
    unresolved_heat: Array


class Units(NamedTuple):
    """Constants of the particles.

    place : (units, 2) electrode and region.  rates, gains : (units, modes) 1/s and stoichiometry/(A/m2 s).
    lump : (units,) of the means.  share, volume : (units,) of the electrode's reaction and material.
    exchange : (units,) A/m2 of cell at unit salt and occupancy.  reactive : (units,) surface per area of cell.
    psi, strength, at, project : of the variable part of diffusion, see `tables.DiffusionTable` and `SphereModes`.
    """

    place: IntArray
    rates: Array
    gains: Array
    lump: Array
    share: Array
    volume: Array
    exchange: Array
    reactive: Array
    psi: Array
    strength: Array
    at: Array
    project: Array


class Salt(NamedTuple):
    """Constants of the electrolyte.

    rates : (modes,) 1/s.  gains : (2 regions, modes) mol/m3 per A/m2 s.  to_nodes, project : (nodes, modes) both ways.
    gauss, mean : weights of Gauss points and of the mean over the nodes.
    psi, strength, top : of the variable part of diffusion.  c0 : mol/m3.  kappa : S/m on [0, top].
    supply : 1 - t+.
    """

    rates: Array
    gains: Array
    to_nodes: Array
    project: Array
    gauss: Array
    mean: Array
    psi: Array
    strength: float
    top: float
    c0: float
    kappa: Array
    supply: float


class Surfaces(NamedTuple):
    """Constants of both electrodes' surfaces.

    ocp, entropic, rate, film : (2, table) V, V/K, factor of the rate constant, ohm m2 of surface.
    alpha : (2,) transfer coefficients.  capacity : (2,) F/m2 of cell a region.  plating : rate, A/m2 of cell per
    mol/m3 of salt, and transfer coefficient.
    plating_to_c : mol/m3 per C/m2.
    solid : (2, regions, regions) ohm m2.  salt : the same times the conductivity, by region crossed.
    """

    ocp: Array
    entropic: Array
    rate: Array
    film: Array
    alpha: Array
    capacity: Array
    plating: Array
    plating_to_c: float
    solid: Array
    salt: Array


class Whole(NamedTuple):
    """Numbers of the whole cell.

    energies : (8,) J/mol, see `activation_energies`.  heat : (3,) capacity J/K (0 for none), conductance W/K,
    surroundings K.  area : m2.  separator : m, thickness over transport efficiency.  contact : ohm.
    reference_k : K.
    """

    energies: Array
    heat: Array
    area: float
    separator: float
    contact: float
    reference_k: float


class Memory(NamedTuple):
    """Arrays that a step of the reaction reads and changes.

    y : (units,) A/m2 of cell.  theta, pred : (units,) surface stoichiometry, and that if each unit carried its share of
    the current.  theta_per_y : (units,) what 1 A/m2 of deviating current takes off theta.
    ohm : (regions, regions) ohm m2.
    salt, log_salt, region_salt : at Gauss points over rest; by region its mean logarithm and mean, mol/m3.
    delta, layer, ahead : (2 regions,) V and A/m2 of the double layers, and how far the latter is at the end of the step
    above its mean.  total : (2 regions,) A/m2.
    plated : (regions,) mol/m3.
    kappa : (2 regions + 1,) S/m, the separator's last.  deviation : (2 regions,) A/m2 beyond its share of the current.
    potential, slope, gain, matrix, move : scratch, by unit of one electrode.  new_delta, new_layer, new_plated, fitted,
    conductance : by its regions.
    """

    y: Array
    theta: Array
    pred: Array
    theta_per_y: Array
    ohm: Array
    salt: Array
    log_salt: Array
    region_salt: Array
    delta: Array
    layer: Array
    ahead: Array
    total: Array
    plated: Array
    new_plated: Array
    kappa: Array
    deviation: Array
    potential: Array
    slope: Array
    gain: Array
    matrix: Array
    move: Array
    new_delta: Array
    new_layer: Array
    fitted: Array
    conductance: Array


class Modes(NamedTuple):
    """State of the particles of one simulation, with scratch and kept weights of their steps of diffusion.

    z, means : (units, modes) and (units,).  nodes, force, force_end : scratch of the variable part.
    faster : (3,) factors of temperature, negative, positive, salt.
    near, largest : (units,) exactly stepped diffusivity, and the largest in the particle, over that of the rates.
    keys, w, w_e : (slots,) nanoseconds of the steps whose weights are kept, (slots, units, 3, modes) those of the
    particles, (slots, 3, salt modes) those of the salt.
    """

    z: Array
    means: Array
    nodes: Array
    force: Array
    force_end: Array
    faster: Array
    near: Array
    largest: Array
    keys: IntArray
    w: Array
    w_e: Array


class StepEnd(NamedTuple):
    """State of one electrode at the end of a step.

    dt : s.  held : True where the current jumped to its value at the beginning of the step; continuing a double layer's
    last current would then oscillate.  thermal : R T / F, V.  rise : K above the reference.
    chi : 2 (1 - t+) R T / F, V.  quicker, film : factors of temperature on rate constants and films.
    """

    dt: float
    held: bool
    thermal: float
    rise: float
    chi: float
    quicker: float
    film: float


class SaltMemory(NamedTuple):
    """State that a step of the electrolyte changes.  q, forcing, before : (modes,).  c, rest : (nodes,)."""

    q: Array
    c: Array
    rest: Array
    forcing: Array
    before: Array
