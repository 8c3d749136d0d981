"""A correction fades where nothing supports it: never worse than the physics by much.

    e'(x) = a w(x) e(x),     1 / w = 1 + KAPPA max(h(x) / h_u - 1, 0)**2 + sum_j (d_j(x) / DISTANCE)**2          (1)
    a = b - SE s_b,     b = sum_d <e_d, w e'_d> / sum_d (|w e'_d|**2 + DOUBT |e_d|**2)    within [0, 1]             (2)

e is what the terms say, h the leverage of x in their fit (leverage.py), d_j how far the scaled input j lies outside its
trained range, -1 to 1. The amplitude a is the slope of the error on the correction over drives d that the terms had not
seen, less a share of its standard error s_b by the jackknife over these drives. A correction that left-out drives do
not bear out is no correction, and neither is one of which they see next to nothing (DOUBT), because each drive lies
outside of what the others visit. As the terms' coefficients are shrunk by a ridge for the noise they were fitted to,
(2) shrinks their sum for what differs from drive to drive. Efron & Morris, J. Am. Stat. Assoc. 68 (1973) 117.

It is for models whose terms are free of the error: in one that feeds back, an amplitude would change its dynamics.

DISTANCE, KAPPA, SE and DOUBT were chosen over the development splits of `aesi bench splits`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from aesi.numerics.blocks import Span
from aesi.numerics.typing import Array

DISTANCE = 0.1
KAPPA = 0.1
SE = 0.5
DOUBT = 0.03


@dataclass(frozen=True, eq=False)
class Fade:
    """amplitude : a of (2).  low, high : (n_inputs,) the trained range, scaled."""

    amplitude: float
    low: Array
    high: Array

    def weight(self, scaled: Array, excess: Array | None) -> Array:
        """(n,) a w along scaled inputs (n, n_inputs) that were not held at the edge, with the leverage's excess."""
        return self.amplitude * range_weight(scaled, self.low, self.high, excess)

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {"amplitude": self.amplitude, "low": self.low.tolist(), "high": self.high.tolist()}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Inverse of `to_dict`."""
        return cls(float(data["amplitude"]), np.array(data["low"]), np.array(data["high"]))


def range_weight(scaled: Array, low: Array, high: Array, excess: Array | None = None) -> Array:
    """(n,) w of (1); scaled : (n, n_inputs)."""
    beyond = np.maximum(low - scaled, 0.0) + np.maximum(scaled - high, 0.0)
    leverage = 0.0 if excess is None else KAPPA * excess**2
    return np.asarray(1.0 / (1.0 + leverage + np.sum((beyond / DISTANCE) ** 2, axis=1)))


def amplitude(error: Array, correction: Array, folds: Sequence[Span], weights: Array) -> float:
    """a of (2).  error, correction, weights : (n,) of all folds; each row counts by its weight."""
    sums = [
        (w @ e**2, w @ (e * c), w @ c**2)
        for e, c, w in ((error[a:b], correction[a:b], weights[a:b]) for a, b in folds)
    ]
    return shrunken(np.array(sums))


def shrunken(sums: Array) -> float:
    """a of (2) from (n_drives, 3) sums of e**2, e e' and e'**2; nought where there is nothing to tell it from.

    One drive alone has no scatter to be wary of.
    """
    if not np.isfinite(sums).all() or not sums[:, 2].sum() > 0.0:
        return 0.0
    n, total = len(sums), sums.sum(axis=0)
    slopes = _slope(total - sums) if n > 1 else np.zeros(1)
    scatter = float(np.sqrt((n - 1) / n * np.sum((slopes - slopes.mean()) ** 2)))
    return float(np.clip(_slope(total[None, :])[0] - SE * scatter, 0.0, 1.0))


def _slope(sums: Array) -> Array:
    return np.asarray(sums[:, 1] / (sums[:, 2] + DOUBT * sums[:, 0]))
