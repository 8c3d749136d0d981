"""What a calibration may move: parameters of the cell with priors from the literature, and how a cell takes them.

Every parameter moves in the coordinate z = (value - start)/sd, of the logarithm where it is a factor, so that its prior
is a standard normal deviate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from aesi.numerics.typing import Array
from aesi.physics.cell import Cell, Electrode
from aesi.physics.cell.relations import Constant, Expression, LookupTable, Relation, Sum, scaled

LIMIT_SD = 4.0
"""No parameter goes further than this many of its prior's deviations."""
KNOTS = 23
"""Of the correction of each open-circuit potential, dense at the ends where potentials are steep."""
ENTROPY_KNOTS = 5
"""Of the correction of an entropy, which is smoother."""
TABLE_POINTS = 513
"""Of the table that a corrected potential becomes."""
BEYOND = 0.06
"""Of the stoichiometry window, that the table reaches further: surfaces leave it under load."""
OCP_SD_V = 0.04
"""Of a potential at each knot: what half-cell measurements of one material differ by."""
ENTROPY_SD_V_K = 1.5e-4
"""Of an entropic coefficient at each knot: its own size."""


@dataclass(frozen=True)
class Free:
    """One free scalar: start (a factor starts at 1), prior deviation (of the logarithm for a factor), unit, source."""

    name: str
    start: float
    sd: float
    unit: str
    source: str
    factor: bool = False
    low: float = -np.inf
    high: float = np.inf

    def value(self, z: float) -> float:
        """The value at a working coordinate."""
        if self.factor:
            return self.start * float(np.exp(self.sd * z))
        return min(max(self.start + self.sd * z, self.low), self.high)

    @property
    def bounds(self) -> tuple[float, float]:
        """Of the working coordinate."""
        low = -LIMIT_SD if self.factor else max(-LIMIT_SD, (self.low - self.start) / self.sd)
        high = LIMIT_SD if self.factor else min(LIMIT_SD, (self.high - self.start) / self.sd)
        return min(low, -1e-9), max(high, 1e-9)


RATE_SD, SALT_SD = 0.8, 0.35
"""Deviations of logarithms. Wider ones let a drive at one temperature trade kinetics for a slow electrolyte, and an LG
18650HG2 then runs out of salt under its US06."""
RATE_ENERGY = 40e3
"""J/mol, the mean of 53 and 44 (Ecker et al. 2015), 35 and 18 (Chen et al. 2020), 55 and 35 (About:Energy 2022)."""
CONTACT_V = 0.03
"""Of the drop at 1C: what contacts, and films, are expected to take at most."""
FULLEST = 0.95
"""Stoichiometry of an electrode that is as full as a charged cell's may be: beyond, its kinetics stand still."""
RATES = "rates of commercial cells of one chemistry scatter by a factor of three either way"
TORTUOSITY = "scatter of tortuosities, Landesfeind et al. 2016, doi:10.1149/2.1141607jes"
ENERGIES = "30 to 81 kJ/mol in Ecker et al. 2015, doi:10.1149/2.0551509jes; 12 to 25 in O'Regan et al. 2022"
KINETIC_ENERGIES = (
    "44 to 53 kJ/mol in Ecker et al. 2015; 18 to 35 in Chen et al. 2020, doi:10.1149/1945-7111/ab9050"
)
SALT_ENERGIES = (
    "17.1 kJ/mol in Ecker et al. 2015; 12 to 25 over concentration in Landesfeind & Gasteiger 2019"
)
FILMS = "25 to 60 kJ/mol for films on graphite, Waldmann et al. 2014, doi:10.1016/j.jpowsour.2014.03.112"
HALF_CELLS = "scatter of half-cell potentials, tens of millivolts, Chen et al. 2020"


def free_parameters(cell: Cell, span_k: float) -> tuple[Free, ...]:
    """What moves, for records whose temperatures span `span_k` (K).

    Energies are free where the records tell them; at one temperature nothing does, and they stay.
    """
    ohm = CONTACT_V / cell.nominal_capacity_ah
    out = [
        Free("negative.capacity", 1.0, 0.10, "factor", HALF_CELLS, True),
        Free("positive.capacity", 1.0, 0.10, "factor", HALF_CELLS, True),
        Free("negative.full_stoichiometry", cell.negative.theta_max, 0.015, "1", HALF_CELLS, high=FULLEST),
        Free("positive.full_stoichiometry", cell.positive.theta_min, 0.03, "1", HALF_CELLS, low=1.0 - FULLEST),
        Free("negative.diffusivity", 1.0, 1.2, "factor", RATES, True),
        Free("positive.diffusivity", 1.0, 1.2, "factor", RATES, True),
        Free("negative.diffusivity_slope", 0.0, 1.0, "e-folds a window", "Ecker et al. 2015, figure 9"),
        Free("positive.diffusivity_slope", 0.0, 1.0, "e-folds a window", "Ecker et al. 2015, figure 9"),
        Free("negative.rate", 1.0, RATE_SD, "factor", RATES, True),
        Free("positive.rate", 1.0, RATE_SD, "factor", RATES, True),
        Free("electrolyte.conductivity", 1.0, SALT_SD, "factor", TORTUOSITY, True),
        Free("electrolyte.diffusivity", 1.0, SALT_SD, "factor", TORTUOSITY, True),
        Free("contact.resistance", cell.contact_resistance_ohm, ohm, "ohm", "a share of the drop at 1C", low=0.0),
    ]  # fmt: skip
    if span_k > SPAN_K:
        n, p, e = cell.negative, cell.positive, cell.electrolyte
        out += [
            Free("negative.diffusivity_energy", n.diffusivity_ea_j_mol, 20e3, "J/mol", ENERGIES, low=0.0),
            Free("positive.diffusivity_energy", p.diffusivity_ea_j_mol, 20e3, "J/mol", ENERGIES, low=0.0),
            Free("negative.rate_energy", RATE_ENERGY, 13e3, "J/mol", KINETIC_ENERGIES, low=0.0),
            Free("positive.rate_energy", RATE_ENERGY, 13e3, "J/mol", KINETIC_ENERGIES, low=0.0),
            Free("electrolyte.conductivity_energy", e.conductivity_ea_j_mol, 5e3, "J/mol", SALT_ENERGIES, low=0.0),
            Free("electrolyte.diffusivity_energy", e.diffusivity_ea_j_mol, 5e3, "J/mol", SALT_ENERGIES, low=0.0),
            Free("film.resistance", cell.film_resistance_ohm, ohm, "ohm", FILMS, low=0.0),
            Free("film.energy", cell.film_ea_j_mol or 40e3, 12e3, "J/mol", FILMS, low=0.0),
        ]  # fmt: skip
    return tuple(out)


SPAN_K = 8.0
"""Records have to span this many kelvins before activation energies and entropy move."""


@dataclass(frozen=True, eq=False)
class Shapes:
    """Corrections of the positive electrode's potential and of its entropic coefficient, linear in their knots.

    low, high : stoichiometry range of the knots.  ocp, entropic : cardinal cubic splines, None where not fitted.
    """

    low: float
    high: float
    ocp: CubicSpline
    entropic: CubicSpline | None

    @classmethod
    def over(cls, cell: Cell, span_k: float) -> Shapes:
        """For the cell's window, and a little beyond it."""
        p = cell.positive
        margin = 0.02 * (p.theta_max - p.theta_min)
        low, high = max(p.theta_min - margin, 1e-3), min(p.theta_max + margin, 1.0 - 1e-3)
        places = np.linspace(0.0, 1.0, KNOTS)
        dense_at_ends = places - 0.7 * np.sin(2.0 * np.pi * places) / (2.0 * np.pi)
        ocp = CubicSpline(low + (high - low) * dense_at_ends, np.eye(KNOTS), bc_type="natural")
        few = np.linspace(low, high, ENTROPY_KNOTS)
        entropic = CubicSpline(few, np.eye(ENTROPY_KNOTS), bc_type="natural") if span_k > SPAN_K else None
        return cls(low, high, ocp, entropic)

    @property
    def n_ocp(self) -> int:
        """Knots of the potential."""
        return KNOTS

    @property
    def n_entropic(self) -> int:
        """Knots of the entropic coefficient."""
        return 0 if self.entropic is None else ENTROPY_KNOTS

    def columns(self, theta_p: Array, rise_k: Array) -> Array:
        """(n, knots) V per working unit: what the voltage gains, at surface stoichiometries and above the reference."""
        at = np.clip(theta_p, self.low, self.high)
        parts = [OCP_SD_V * self.ocp(at)]
        if self.entropic is not None:
            parts.append(ENTROPY_SD_V_K * rise_k[:, None] * self.entropic(at))
        return np.concatenate(parts, axis=1)

    def on(self, electrode: Electrode, z: Array) -> Electrode:
        """The electrode with both corrections; z : (knots,) working coordinates."""
        x = np.linspace(max(self.low - BEYOND, 1e-3), min(self.high + BEYOND, 1.0 - 1e-3), TABLE_POINTS)
        at = np.clip(x, self.low, self.high)
        ocp = electrode.ocp
        if np.any(z[:KNOTS]):
            ocp = _plus(ocp, x, OCP_SD_V * self.ocp(at) @ z[:KNOTS])
        entropic = electrode.entropic
        if self.entropic is not None and np.any(z[KNOTS:]):
            entropic = _plus(entropic, x, ENTROPY_SD_V_K * self.entropic(at) @ z[KNOTS:])
        return replace(electrode, ocp=ocp, entropic=entropic)


def _plus(base: Relation, x: Array, y: Array) -> Relation:
    table = LookupTable(tuple(map(float, x)), tuple(map(float, y)))
    return table if base == Constant(0.0) else Sum(base, table)


def moved(cell: Cell, values: Mapping[str, float]) -> Cell:
    """The cell with global parameters replaced; windows as wide as its capacity in the new electrodes."""
    capacity_ah = cell.capacity_ah
    n = _electrode(cell.negative, "negative", values)
    p = _electrode(cell.positive, "positive", values)
    n1 = values.get("negative.full_stoichiometry", cell.negative.theta_max)
    p1 = values.get("positive.full_stoichiometry", cell.positive.theta_min)
    n0 = n1 - capacity_ah / cell.electrode_capacity_ah(n)
    p0 = p1 + capacity_ah / cell.electrode_capacity_ah(p)
    e = cell.electrolyte
    electrolyte = replace(
        e,
        conductivity=scaled(e.conductivity, values.get("electrolyte.conductivity", 1.0)),
        diffusivity=scaled(e.diffusivity, values.get("electrolyte.diffusivity", 1.0)),
        conductivity_ea_j_mol=values.get("electrolyte.conductivity_energy", e.conductivity_ea_j_mol),
        diffusivity_ea_j_mol=values.get("electrolyte.diffusivity_energy", e.diffusivity_ea_j_mol),
    )
    return replace(
        cell,
        negative=replace(n, theta_min=n0, theta_max=n1),
        positive=replace(p, theta_min=p1, theta_max=p0),
        electrolyte=electrolyte,
        contact_resistance_ohm=values.get("contact.resistance", cell.contact_resistance_ohm),
        film_resistance_ohm=values.get("film.resistance", cell.film_resistance_ohm),
        film_ea_j_mol=values.get("film.energy", cell.film_ea_j_mol),
    )


def _electrode(electrode: Electrode, side: str, values: Mapping[str, float]) -> Electrode:
    factor = values.get(f"{side}.diffusivity", 1.0)
    slope = values.get(f"{side}.diffusivity_slope", 0.0)
    return replace(
        electrode,
        area_per_volume_1_m=electrode.area_per_volume_1_m * values.get(f"{side}.capacity", 1.0),
        diffusivity=_sloped(electrode, factor, slope),
        rate_constant=electrode.rate_constant * values.get(f"{side}.rate", 1.0),
        diffusivity_ea_j_mol=values.get(f"{side}.diffusivity_energy", electrode.diffusivity_ea_j_mol),
        rate_ea_j_mol=values.get(f"{side}.rate_energy", electrode.rate_ea_j_mol),
    )


def _sloped(electrode: Electrode, factor: float, slope: float) -> Relation:
    """Diffusivity times a factor, and exponential in stoichiometry: `slope` e-folds across the window."""
    if slope == 0.0 or not isinstance(electrode.diffusivity, Constant):
        return scaled(electrode.diffusivity, factor)
    middle = 0.5 * (electrode.theta_min + electrode.theta_max)
    width = electrode.theta_max - electrode.theta_min
    value = electrode.diffusivity.value * factor
    return Expression(f"{value!r} * exp({slope / width!r} * (x - {middle!r}))")
