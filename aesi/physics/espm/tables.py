"""Constitutive relations sampled on uniform grids, ready for the compiled steps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from aesi.errors import CellError
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.cell.relations import (
    LEAST_TRANSPORT,
    OCP_POINTS,
    WORKING_SPAN,
    Constant,
    Relation,
    tabulated,
    without_poles,
)

RATE_POINTS = 513
"""Points of the tables of rate factors, whose logarithms are smooth: one every 0.2 % of stoichiometry."""
ELECTROLYTE_POINTS = 2049
ELECTROLYTE_SPAN = 4.0
"""Tables of electrolyte properties run from zero to this many times the rest concentration."""
EXTRAPOLATED_MARGIN = 0.76
"""Share of the largest diffusivity that is stepped exactly where the explicit rest is extrapolated from two steps:
above three quarters, this is stable for steps of any length."""
CORRECTED_MARGIN = 0.55
"""The same share where the rest is predicted and corrected within the step: above one half is stable."""


def ocp_table(ocp: Relation, side: str, what: str = "open-circuit potential") -> Array:
    """(OCP_POINTS,) V on [0, 1]; a pole at either end is replaced by its finite neighbour.

    Raises CellError where it is not finite inside.
    """
    values = tabulated(ocp, 0.0, 1.0, OCP_POINTS)
    if np.isfinite(values).all():
        return values
    values = without_poles(values)
    if not np.isfinite(values).all():
        bad = float(np.flatnonzero(~np.isfinite(values))[0]) / (OCP_POINTS - 1)
        raise CellError(
            f"the {what} of the {side} electrode is not finite at x = {bad:.4f}; write there a table, or a formula "
            "that holds from 0 to 1: surfaces leave the limits of the file under load."
        )
    return values


def ocp_tables(cell: Cell) -> Array:
    """(2, OCP_POINTS) V of the negative and the positive electrode, as `ocp_table`."""
    return np.array([ocp_table(x.ocp, side) for side, x in cell.electrodes.items()])


def entropic_tables(cell: Cell) -> Array:
    """(2, OCP_POINTS) V/K of the negative and the positive electrode, as `ocp_table`."""
    what = "entropic change coefficient"
    return np.array([ocp_table(x.entropic, side, what) for side, x in cell.electrodes.items()])


def rate_tables(cell: Cell) -> Array:
    """(2, points) factors on the rates of the negative and the positive electrode over stoichiometry [0, 1].

    Raises CellError where one is not positive.
    """
    factors = [cell.negative.rate_factor, cell.positive.rate_factor]
    points = 2 if all(isinstance(f, Constant) for f in factors) else RATE_POINTS
    tables = np.array([tabulated(f, 0.0, 1.0, points) for f in factors])
    for table, side in zip(tables, ("negative", "positive"), strict=True):
        if not (np.isfinite(table).all() and (table > 0.0).all()):
            raise CellError(f"the reaction rate factor of the {side} electrode has to be positive on [0, 1].")
    return tables


def film_tables(cell: Cell) -> Array:
    """(2, points) ohm m2 of the films of the negative and the positive electrode over stoichiometry [0, 1].

    Raises CellError where one is negative.
    """
    films = [cell.negative.film_ohm_m2, cell.positive.film_ohm_m2]
    points = 2 if all(isinstance(f, Constant) for f in films) else RATE_POINTS
    tables = np.array([tabulated(f, 0.0, 1.0, points) for f in films])
    for table, side in zip(tables, ("negative", "positive"), strict=True):
        if not (np.isfinite(table).all() and (table >= 0.0).all()):
            raise CellError(f"the film resistance of the {side} electrode must not be negative on [0, 1].")
    return tables


@dataclass(frozen=True, eq=False)
class DiffusionTable:
    """Diffusivity split into a constant `d0` and the integral `psi` of the rest over the variable.

    psi : (points,) on [0, top]; zeros where the diffusivity is constant.  The flux is d0 grad c + grad psi(c).
    """

    d0: float
    psi: Array
    top: float
    linear: bool

    @property
    def strength(self) -> float:
        """Factor on psi beside rates that are of d0, s/m2; 0 where the diffusivity is constant."""
        return 0.0 if self.linear else 1.0 / self.d0


@lru_cache(maxsize=128)
def electrolyte_diffusion(diffusivity: Relation, c0: float) -> DiffusionTable:
    """Split of the electrolyte diffusivity about the rest concentration c0 (mol/m3)."""
    top = ELECTROLYTE_SPAN * c0
    if isinstance(diffusivity, Constant):
        return DiffusionTable(diffusivity.value, np.zeros(2), top, True)
    at_rest = f"the electrolyte's diffusivity is {{:g}} m2/s at {c0:g} mol/m3"
    return _split(diffusivity, c0, top, tuple(c0 * s for s in WORKING_SPAN), EXTRAPOLATED_MARGIN, at_rest)


@lru_cache(maxsize=128)
def solid_diffusion(diffusivity: Relation) -> DiffusionTable:
    """Split of a solid diffusivity over stoichiometry."""
    if isinstance(diffusivity, Constant):
        return DiffusionTable(diffusivity.value, np.zeros(2), 1.0, True)
    half_full = "the diffusivity of an electrode is {:g} m2/s at a stoichiometry of 0.5"
    return _split(diffusivity, 0.5, 1.0, (0.0, 1.0), CORRECTED_MARGIN, half_full)


def solid_diffusions(cell: Cell) -> list[DiffusionTable]:
    """The splits of both electrodes with psi of one length, the negative one first."""
    solids = [solid_diffusion(x.diffusivity) for x in cell.electrodes.values()]
    longest = max(len(x.psi) for x in solids)
    return [replace(x, psi=np.zeros(longest)) if x.linear else x for x in solids]


def _split(
    diffusivity: Relation, reference: float, top: float, working: tuple[float, ...], margin: float, told: str
) -> DiffusionTable:
    """Split of a diffusivity. Values that are not positive, outside the range of a fit, become `LEAST_TRANSPORT` of
    that at the reference.

    told : format of a clause on the value at the reference.  Raises CellError where that is not positive.
    """
    grid = np.linspace(0.0, top, ELECTROLYTE_POINTS)
    values = diffusivity(grid)
    at_reference = float(diffusivity(np.array([reference]))[0])
    if not at_reference > 0:
        raise CellError(
            f"{told.format(at_reference)}; it has to be positive: give a table, or a formula that holds."
        )
    values = np.where(np.isfinite(values) & (values > 0.0), values, LEAST_TRANSPORT * at_reference)
    largest = float(values[(grid >= working[0]) & (grid <= working[1])].max())
    d0 = max(at_reference, margin * largest)
    rest = values - d0
    psi = np.concatenate([[0.0], np.cumsum(0.5 * (rest[1:] + rest[:-1])) * (grid[1] - grid[0])])
    return DiffusionTable(d0, psi, top, False)


def conductivity_table(conductivity: Relation, c0: float) -> Array:
    """(ELECTROLYTE_POINTS,) S/m on [0, ELECTROLYTE_SPAN c0], with a positive lower limit: without salt it would be 0.

    Raises CellError unless positive at rest.
    """
    values = tabulated(conductivity, 0.0, ELECTROLYTE_SPAN * c0, ELECTROLYTE_POINTS)
    at_rest = float(conductivity(np.array([c0]))[0])
    if not at_rest > 0:
        raise CellError(f"the electrolyte conductivity is {at_rest:g} S/m at rest; it has to be positive.")
    floor = LEAST_TRANSPORT * at_rest
    return np.maximum(np.where(np.isfinite(values), values, floor), floor)
