"""What the model of a right hypothesis misses: its size in the likelihood, and how likely that size is.

    a(t)**2 = delta**2 + zeta**2 (dU/dz)**2        dU/dz in V, slope of the open-circuit voltage over state of charge

A model errs by some voltage, delta, and by some state of charge, zeta, which shows where the open-circuit voltage is
steep. delta has a log-normal prior: tight for a cell whose file was measured on it, loose for another of its make. zeta
is delta where the balance of the electrodes is held as declared; where it is free, it takes up errors of charge itself,
and zeta is no larger than for the cell that was measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array
from aesi.tracer.case.problem import Trust


@dataclass(frozen=True)
class SizePrior:
    """median_v : V.  sd : of the natural logarithm."""

    median_v: float
    sd: float

    def log_density(self, delta_v: float) -> float:
        """Up to a constant that all sizes share."""
        return -0.5 * (float(np.log(delta_v / self.median_v)) / self.sd) ** 2 - float(np.log(self.sd))


PRIORS: dict[Trust, SizePrior] = {
    "exact": SizePrior(2e-4, 0.7),
    "tight": SizePrior(2e-4, 0.7),
    "loose": SizePrior(4e-3, 0.7),
}
"""exact, tight : what this model and an independent solver of the same cell leave of each other.
loose : what calibrated measured cells leave."""
SIZES_V = tuple(float(v) for v in 1e-3 * np.geomspace(0.2, 25.6, 8))
"""Sizes that are tried, a factor of two apart."""


def amplitude_v(steepness: Array, delta_v: float, trust: Trust) -> Array:
    """(n,) V, standard deviation of the model error in each row."""
    charge = min(delta_v, PRIORS["tight"].median_v) if trust == "loose" else delta_v
    return np.sqrt(delta_v**2 + (charge * steepness) ** 2)
