"""The weight of a correction at a sample by its distance from the rows of the fit.

    w(x) = exp(-(sum_j d_j(x)**2 + d_T(x)**2) / (2 DISTANCE**2)) rho(g(x))                                  (1)

d_j is the distance of the scaled input j from its trained range, -1 to 1. d_T is the distance of the temperature from
its trained range, in units that change overpotentials e-fold. g is the distance in state of charge to the nearest
trained row, since a gap between two drives lies within the range of each input. rho is the correlation of errors that
far apart (`aesi.numerics.visited`): (1) is the mean of a Gaussian process at x over its value at the nearest fitted
row, if that row alone is known. No term is in the temperature, which varies too little in drives at one ambient. Its
scale is therefore from Arrhenius' law, not half its trained range, which is 2 K there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from aesi.numerics.files.restored import saved_array
from aesi.numerics.typing import Array
from aesi.numerics.visited import Visited

DISTANCE = 0.3
"""Distance of (1) in units of a scaled input, half a range being 1.
Over the development splits of the NMC drive in `aesi bench splits` (16 candidates), a distance of 0.1 takes 3.2 points
less off the declared model's squared error in the mean and 5.3 less at worst, and 7.4 and 4.2 less off the recalibrated
one's. A distance of 0.2 loses 0.6 and 1.4, and 1.2 and 0.9; one of 0.5 loses 0.5 and 8.5, and 0.5 and 4.2."""


@dataclass(frozen=True, eq=False)
class TrainedRegion:
    """The range of fitted rows.  low, high : (n_inputs,) of the scaled inputs.  visited : states of charge and
    temperatures."""

    low: Array
    high: Array
    visited: Visited

    @classmethod
    def of(cls, scaled: Array, soc: Array, temperature_degc: Array) -> Self:
        """The region of rows with scaled inputs (n, n_inputs), states of charge and temperatures (n,), NaN where not
        measured."""
        return cls(scaled.min(axis=0), scaled.max(axis=0), Visited.of(soc, temperature_degc))

    def nearness(self, scaled: Array, soc: Array, temperature_degc: Array | None) -> Array:
        """(n,) of (1), 0 to 1; scaled : (n, n_inputs), not held at the edge; a temperature that was not measured counts
        as fitted."""
        beyond = np.maximum(self.low - scaled, 0.0) + np.maximum(scaled - self.high, 0.0)
        squared = np.sum(beyond**2, axis=1) + self.visited.thermal_distance(temperature_degc) ** 2
        return np.asarray(np.exp(-0.5 * squared / DISTANCE**2) * self.visited.correlation(soc))

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {"low": self.low.tolist(), "high": self.high.tolist(), **self.visited.to_state()}

    @classmethod
    def from_dict(cls, data: dict[str, Any], n_inputs: int) -> Self:
        """Inverse of `to_dict`, for so many inputs.  Raises ValueError for anything else."""
        low, high = (saved_array(data[key], key, (n_inputs,)) for key in ("low", "high"))
        return cls(low, high, Visited.from_state(data))
