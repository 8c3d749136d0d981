"""Constants and state of the compiled steps of the plain path, by name; see `layout`."""

from __future__ import annotations

from typing import NamedTuple

from aesi.numerics.typing import Array, IntArray


class PlainSolid(NamedTuple):
    """Constants of both particles.

    rates, gains : (2, modes) 1/s and stoichiometry/(A s), mean excluded.  lump : (2,) of the means.
    """

    rates: Array
    gains: Array
    lump: Array


class PlainSalt(NamedTuple):
    """Constants of the electrolyte's modes.

    rates : (modes,) 1/s.  gains : (modes,) mol/m3 per A s of cell current.
    to_nodes, project : (nodes, modes) both ways.  gauss, mean : weights of Gauss points and of the mean over the nodes.
    psi, strength : table and factor of the variable part of diffusion.  nonlinear : whether there is one.
    substep, most, finer : of the steps in which it is taken explicitly, see `layout.Drive`.
    """

    rates: Array
    gains: Array
    to_nodes: Array
    project: Array
    gauss: Array
    mean: Array
    psi: Array
    strength: float
    nonlinear: bool
    substep: float
    most: int
    finer: float


class PlainCell(NamedTuple):
    """Tables and numbers of the voltage.

    ocp_n, ocp_p : tables over stoichiometry.  kappa : S/m on [0, top].  area : m2.  c0, top : mol/m3.
    reactive_n, reactive_p : reactive area per area of cell.  exchange_n, exchange_p : A/m2 at unit salt and occupancy.
    thermal_v : R T / F.  salt_v : 2 (1 - t+) R T / F.  path : m, thickness over transport efficiency, all layers.
    solid : ohm m2.  contact : ohm.
    """

    ocp_n: Array
    ocp_p: Array
    kappa: Array
    area: float
    c0: float
    top: float
    reactive_n: float
    reactive_p: float
    exchange_n: float
    exchange_p: float
    thermal_v: float
    salt_v: float
    path: float
    solid: float
    contact: float


class PlainMemory(NamedTuple):
    """What the steps of the plain path change.

    z_n, z_p : (modes,) of the particles.  q, forcing, before : (salt modes,).  c, rest : (nodes,) mol/m3.
    g : (6,) salt over rest at the Gauss points.
    keys, parts : (slots,) nanoseconds of the steps whose weights are kept, and into how many each is divided.
    w_n, w_p : (slots, 3, modes).  w_e : (slots, 5, salt modes).
    """

    z_n: Array
    z_p: Array
    q: Array
    c: Array
    g: Array
    forcing: Array
    before: Array
    rest: Array
    keys: IntArray
    parts: IntArray
    w_n: Array
    w_p: Array
    w_e: Array
