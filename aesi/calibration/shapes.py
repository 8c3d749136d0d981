"""Corrections of entropic coefficients, and of open-circuit potentials that stay monotonic in stoichiometry.

A potential falls with stoichiometry: if it rose, a particle would have two states at one voltage, and a porous
electrode no solution. The fitted quantity is therefore the logarithm of its slope over that of the start file:

    -dU/dx = s(x) exp(sum_k z_k B_k(x)),      s = max(-dU_start/dx, LEAST_SLOPE)

B_k are cardinal cubic splines over the whole range of stoichiometry. The record of a full cell determines only the
difference of both electrodes' potentials, so that one level is fitted, that of the positive electrode. The derivatives
of the voltage in z follow by quadrature from the surface stoichiometries of a run; they need no simulation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from aesi.numerics.typing import Array
from aesi.physics.cell import Cell, Electrode
from aesi.physics.cell.energies import SPAN_K
from aesi.physics.cell.relations import Constant, LookupTable, Relation, Sum

POSITIVE_KNOTS, NEGATIVE_KNOTS = 23, 15
"""Knots of the corrections of both potentials, dense where these are steep."""
ENTROPY_KNOTS = 5
"""Knots of the correction of an entropy, which is smoother."""
GRID = 2049
"""Points from 0 to 1 at which a corrected potential is tabulated."""
LEAST_SLOPE = 5e-3
"""Least slope of a potential, V per unit of stoichiometry: plateaus of graphite fall by some hundredths of a volt,
formulas of them by less."""
LOG_SLOPE_SD = 0.7
"""Standard deviation of the logarithm of a slope: half-cell measurements of one material differ by a factor of two
in it."""
LEVEL_SD_V = 0.04
"""Standard deviation of the difference of both potentials, V: half-cell measurements of one material differ by as
much."""
ENTROPY_SD_V_K = 1.5e-4
"""Standard deviation of an entropic coefficient at each knot, V/K: equal to its typical size."""
BEYOND = 0.06
"""Extension of an entropy's table beyond the stoichiometry window, as a share of it: surfaces leave it under load."""


@dataclass(frozen=True, eq=False)
class Potential:
    """An open-circuit potential whose slope is that of a file times a positive factor, and always negative.

    grid : (n,) stoichiometries 0..1.  slope : (n - 1,) V per unit of stoichiometry, -dU/dx of the file between them.
    anchor : index of the grid point where the potential is that of the file, `level` V.  basis : (n - 1, knots) change
    of the log slope per working unit of each knot.
    """

    grid: Array
    slope: Array
    anchor: int
    level: float
    basis: Array

    @classmethod
    def of(cls, electrode: Electrode, places: Array) -> Potential:
        """The electrode's potential, with knots at these places: (knots,) stoichiometries from 0 to 1."""
        grid = np.linspace(0.0, 1.0, GRID)
        inner = np.clip(grid, 1e-6, 1.0 - 1e-6)
        slope = np.maximum(-np.diff(electrode.ocp(inner)) / np.diff(grid), LEAST_SLOPE)
        anchor = int(np.argmin(np.abs(grid - 0.5 * (electrode.theta_min + electrode.theta_max))))
        middle = np.clip(0.5 * (grid[1:] + grid[:-1]), places[0], places[-1])
        basis = LOG_SLOPE_SD * CubicSpline(places, np.eye(len(places)), bc_type="natural")(middle)
        return cls(grid, slope, anchor, float(electrode.ocp(grid[anchor : anchor + 1])[0]), np.asarray(basis))

    @property
    def knots(self) -> int:
        """Number of knots."""
        return self.basis.shape[1]

    def falls(self, z: Array) -> Array:
        """(n - 1,) V, fall of the potential from one point of the grid to the next, >= 0."""
        return self.slope * np.exp(self.basis @ z) * np.diff(self.grid)

    def at(self, z: Array) -> LookupTable:
        """The potential at working coordinates z (knots,)."""
        fallen = np.concatenate([[0.0], np.cumsum(self.falls(z))])
        volts = self.level - (fallen - fallen[self.anchor])
        return LookupTable(tuple(map(float, self.grid)), tuple(map(float, volts)))

    def columns(self, z: Array, theta: Array) -> Array:
        """(n, knots) V, derivative of the potential in each working coordinate, at stoichiometries theta (n,)."""
        fallen = np.cumsum(self.falls(z)[:, None] * self.basis, axis=0)
        fallen = np.concatenate([np.zeros((1, self.knots)), fallen])
        volts = -(fallen - fallen[self.anchor])
        place = np.clip(theta, 0.0, 1.0) * (GRID - 1)
        k = np.minimum(place.astype(int), GRID - 2)
        share = (place - k)[:, None]
        return volts[k] * (1.0 - share) + volts[k + 1] * share


@dataclass(frozen=True, eq=False)
class Entropy:
    """Correction of an entropic coefficient: cardinal cubic splines over the stoichiometries [low, high], constant
    beyond, times ENTROPY_SD_V_K."""

    low: float
    high: float
    spline: CubicSpline

    @classmethod
    def over(cls, electrode: Electrode) -> Entropy:
        """Splines over the electrode's window."""
        low, high = electrode.theta_min, electrode.theta_max
        places = np.linspace(low, high, ENTROPY_KNOTS)
        return cls(low, high, CubicSpline(places, np.eye(ENTROPY_KNOTS), bc_type="natural"))

    def columns(self, theta: Array) -> Array:
        """(n, knots) V/K, derivative of the coefficient in each working coordinate, at stoichiometries theta (n,)."""
        return np.asarray(ENTROPY_SD_V_K * self.spline(np.clip(theta, self.low, self.high)))

    def added(self, base: Relation, z: Array) -> Relation:
        """`base` with the correction of working coordinates z (knots,)."""
        if not np.any(z):
            return base
        reach = BEYOND * (self.high - self.low)
        x = np.linspace(max(self.low - reach, 0.0), min(self.high + reach, 1.0), 129)
        table = LookupTable(tuple(map(float, x)), tuple(map(float, self.columns(x) @ z)))
        return table if base == Constant(0.0) else Sum(base, table)


@dataclass(frozen=True, eq=False)
class Shapes:
    """Corrections of both potentials and of the positive electrode's entropic coefficient (None where not fitted)."""

    positive: Potential
    negative: Potential
    entropic: Entropy | None

    @classmethod
    def over(cls, cell: Cell, span_k: float) -> Shapes:
        """Corrections of the cell's electrodes."""
        p, n = cell.positive, cell.negative
        least = max(p.theta_min - 0.08, 0.0)
        places = np.linspace(0.0, 1.0, POSITIVE_KNOTS)
        dense_at_ends = places - 0.7 * np.sin(2.0 * np.pi * places) / (2.0 * np.pi)
        dense_at_empty = np.linspace(0.0, 1.0, NEGATIVE_KNOTS) ** 2
        return cls(
            Potential.of(p, least + (1.0 - least) * dense_at_ends),
            Potential.of(n, dense_at_empty),
            Entropy.over(p) if span_k > SPAN_K else None,
        )

    @property
    def size(self) -> int:
        """Number of all working coordinates: knots, and the level of the positive potential."""
        return self.closed + (0 if self.entropic is None else ENTROPY_KNOTS)

    @property
    def closed(self) -> int:
        """Number of the working coordinates with closed-form derivatives, which come first: those of the potentials."""
        return self.positive.knots + self.negative.knots + 1

    def columns(self, z: Array, theta_n: Array, theta_p: Array) -> Array:
        """(n, closed) V, derivatives of the voltage in the working coordinates, at surface stoichiometries (n,)."""
        of_p, of_n, _, _ = self._split(z)
        level = np.full((len(theta_p), 1), LEVEL_SD_V)
        parts = [self.positive.columns(of_p, theta_p), -self.negative.columns(of_n, theta_n), level]
        return np.concatenate(parts, axis=1)

    def on(self, cell: Cell, z: Array) -> Cell:
        """The cell with all corrections; z : (size,) working coordinates."""
        of_p, of_n, of_level, of_s = self._split(z)
        shift = replace(self.positive, level=self.positive.level + LEVEL_SD_V * float(of_level[0]))
        positive = replace(cell.positive, ocp=shift.at(of_p))
        if self.entropic is not None:
            positive = replace(positive, entropic=self.entropic.added(positive.entropic, of_s))
        return replace(cell, positive=positive, negative=replace(cell.negative, ocp=self.negative.at(of_n)))

    def _split(self, z: Array) -> list[Array]:
        ends = np.cumsum([self.positive.knots, self.negative.knots, 1])
        return np.split(z, ends)
