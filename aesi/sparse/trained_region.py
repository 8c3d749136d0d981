"""How remote a sample is from the rows that a correction was fitted to.

    r(x) = sum_j (d_j(x) / DISTANCE)**2 + (g(x) / g_t)**2                                                   (1)

d_j is how far the scaled input j lies outside its trained range, -1 to 1, and g the distance in the state of charge to
the nearest trained row, since a gap between two drives lies within the range of each input. g_t is the largest g of a
left-out drive to the rows of the others: so far from fitted rows the correction has been tested.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from aesi.numerics.blocks import Span
from aesi.numerics.typing import Array
from aesi.numerics.visited import distance_to_visited, visited

DISTANCE = 0.1
"""Of a scaled input, half a range being 1: there half of a correction is left. Chosen on the development splits of
`aesi bench splits`, but no figure of another value was kept."""
LEAST_TESTED = 0.05
"""Of g_t: DISTANCE of an input that grows with the charge and was trained over all of it."""


@dataclass(frozen=True, eq=False)
class TrainedRegion:
    """low, high : (n_inputs,) the trained range, scaled.  charge : (k,) states of charge that were visited, sorted.
    tested : g_t of (1)."""

    low: Array
    high: Array
    charge: Array
    tested: float

    @classmethod
    def of(cls, scaled: Array, soc: Array, tested: float) -> Self:
        """Of rows with scaled inputs (n, n_inputs) and states of charge (n,)."""
        return cls(scaled.min(axis=0), scaled.max(axis=0), visited(soc), max(tested, LEAST_TESTED))

    def remoteness(self, scaled: Array, soc: Array) -> Array:
        """(n,) of (1), >= 0; scaled : (n, n_inputs), not held at the edge."""
        beyond = np.maximum(self.low - scaled, 0.0) + np.maximum(scaled - self.high, 0.0)
        gap = distance_to_visited(soc, self.charge) / self.tested
        return np.asarray(np.sum((beyond / DISTANCE) ** 2, axis=1) + gap**2)

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "charge": self.charge.tolist(),
            "tested": self.tested,
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Inverse of `to_dict`."""
        low, high, charge = (np.array(data[key], dtype=float) for key in ("low", "high", "charge"))
        return cls(low, high, charge, float(data["tested"]))


def farthest_left_out(soc: Array, folds: Sequence[Span]) -> float:
    """g_t of (1): the largest distance of any left-out row to the rows of the other folds."""
    farthest = 0.0
    for a, b in folds:
        others = np.sort(np.delete(soc, np.s_[a:b]))
        if len(others):
            farthest = max(farthest, float(distance_to_visited(soc[a:b], others).max()))
    return farthest
