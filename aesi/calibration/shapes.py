"""Corrections of potentials, linear in their knots: what a full cell's voltage tells of them needs no simulation.

The record of a full cell tells the sum of both electrodes' potentials. The positive electrode's correction has knots
over its whole window; the negative one's are dense where it is all but empty, since there it falls by volts within a
few per cent of stoichiometry and the positive one's are too far apart to follow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from aesi.numerics.typing import Array
from aesi.physics.cell import Cell, Electrode
from aesi.physics.cell.relations import Constant, LookupTable, Relation, Sum

SPAN_K = 8.0
"""Records have to span this many kelvins before activation energies and entropy move."""
POSITIVE_KNOTS, NEGATIVE_KNOTS = 23, 13
"""Of the corrections of both potentials, dense where they are steep."""
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


@dataclass(frozen=True, eq=False)
class Course:
    """Cardinal cubic splines over the stoichiometries [low, high], constant beyond, times a deviation."""

    low: float
    high: float
    spline: CubicSpline
    sd: float

    @classmethod
    def over(cls, low: float, high: float, places: Array, sd: float) -> Course:
        """places : (knots,) shares of [low, high], from 0 to 1."""
        return cls(
            low, high, CubicSpline(low + (high - low) * places, np.eye(len(places)), bc_type="natural"), sd
        )

    @property
    def knots(self) -> int:
        """How many."""
        return len(self.spline.x)

    def at(self, theta: Array) -> Array:
        """(n, knots) the correction per working unit of each knot."""
        return np.asarray(self.sd * self.spline(np.clip(theta, self.low, self.high)))

    def added(self, base: Relation, z: Array) -> Relation:
        """`base` with the correction of working coordinates z (knots,)."""
        if not np.any(z):
            return base
        x = np.linspace(max(self.low - BEYOND, 1e-3), min(self.high + BEYOND, 1.0 - 1e-3), TABLE_POINTS)
        table = LookupTable(tuple(map(float, x)), tuple(map(float, self.at(x) @ z)))
        return table if base == Constant(0.0) else Sum(base, table)


@dataclass(frozen=True, eq=False)
class Shapes:
    """Corrections of both potentials and of the positive electrode's entropic coefficient (None where not fitted)."""

    positive: Course
    negative: Course
    entropic: Course | None

    @classmethod
    def over(cls, cell: Cell, span_k: float) -> Shapes:
        """For the cell's windows, and a little beyond them."""
        places = np.linspace(0.0, 1.0, POSITIVE_KNOTS)
        dense_at_ends = places - 0.7 * np.sin(2.0 * np.pi * places) / (2.0 * np.pi)
        dense_at_empty = np.linspace(0.0, 1.0, NEGATIVE_KNOTS) ** 2
        positive, negative = _range(cell.positive), _range(cell.negative)
        few = np.linspace(0.0, 1.0, ENTROPY_KNOTS)
        return cls(
            Course.over(*positive, dense_at_ends, OCP_SD_V),
            Course.over(*negative, dense_at_empty, OCP_SD_V),
            Course.over(*positive, few, ENTROPY_SD_V_K) if span_k > SPAN_K else None,
        )

    @property
    def size(self) -> int:
        """Knots of all."""
        entropic = 0 if self.entropic is None else self.entropic.knots
        return self.positive.knots + self.negative.knots + entropic

    def columns(self, theta_n: Array, theta_p: Array, rise_k: Array) -> Array:
        """(n, size) V per working unit: what the voltage gains, at surface stoichiometries and above the reference."""
        parts = [self.positive.at(theta_p), -self.negative.at(theta_n)]
        if self.entropic is not None:
            parts.append(rise_k[:, None] * self.entropic.at(theta_p))
        return np.concatenate(parts, axis=1)

    def on(self, cell: Cell, z: Array) -> Cell:
        """The cell with all corrections; z : (size,) working coordinates."""
        of_p, of_n, of_s = np.split(z, np.cumsum([self.positive.knots, self.negative.knots]))
        positive = replace(cell.positive, ocp=self.positive.added(cell.positive.ocp, of_p))
        if self.entropic is not None:
            positive = replace(positive, entropic=self.entropic.added(positive.entropic, of_s))
        negative = replace(cell.negative, ocp=self.negative.added(cell.negative.ocp, of_n))
        return replace(cell, positive=positive, negative=negative)


def _range(electrode: Electrode) -> tuple[float, float]:
    margin = 0.02 * (electrode.theta_max - electrode.theta_min)
    return max(electrode.theta_min - margin, 1e-3), min(electrode.theta_max + margin, 1.0 - 1e-3)
