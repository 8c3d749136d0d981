"""Scaling of error and inputs to [-1, 1] by the ranges of the training records, the paper's equation (10).

    x' = 2 (x - low) / (high - low) - 1

The range of the error is symmetric, -max |e| to max |e|, so that a scaled error of zero is no error: a ridge then
shrinks a model towards the physics, and not towards the middle of the training errors.

Outside the trained range Chebyshev polynomials grow like a power and tan has poles, so that terms are meaningless
there. Scaled values are therefore held at -1 or 1, and the samples are flagged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aesi.numerics.files.restored import saved_array
from aesi.numerics.typing import Array, BoolArray

HELD = "clip"
"""How a saved scaling says that it holds what is outside: no other one can be read."""


@dataclass(frozen=True, eq=False)
class Scaling:
    """low, high : (n_variables,) the trained range of each variable, SI."""

    low: Array
    high: Array

    @classmethod
    def of(cls, blocks: Sequence[Array]) -> Scaling:
        """The range over several (n, n_variables) blocks, the error first."""
        low = np.min([block.min(axis=0) for block in blocks], axis=0)
        high = np.max([block.max(axis=0) for block in blocks], axis=0)
        high[0] = max(-low[0], high[0])
        low[0] = -high[0]
        return cls(low, high)

    def apply(self, data: Array) -> Array:
        """Scale (n, n_variables), held within [-1, 1]."""
        return np.clip(self._not_clipped(data), -1.0, 1.0)

    def cut_off(self, data: Array) -> Array:
        """(n, n_variables) what `apply` has cut off the scaled values, 0 within the trained range."""
        return self._not_clipped(data) - self.apply(data)

    def is_outside(self, data: Array) -> BoolArray:
        """(n,) True where any variable leaves its trained range."""
        slack = 1e-9 * (self.high - self.low)
        return np.asarray(((data < self.low - slack) | (data > self.high + slack)).any(axis=1))

    def error_to_scaled(self, error_v: Array) -> Array:
        """The error alone, not clipped (it is a target, or the state of a free run)."""
        return 2.0 * (error_v - self.low[0]) / (self.high[0] - self.low[0]) - 1.0

    def error_to_volts(self, scaled: Array) -> Array:
        """Inverse of `error_to_scaled`."""
        return self.low[0] + 0.5 * (scaled + 1.0) * (self.high[0] - self.low[0])

    @property
    def error_volts_per_unit(self) -> float:
        """Volts of error in one unit of scaled error."""
        return float(0.5 * (self.high[0] - self.low[0]))

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values."""
        return {"low": self.low.tolist(), "high": self.high.tolist(), "outside": HELD}

    @classmethod
    def from_dict(cls, data: dict[str, Any], n_variables: int) -> Scaling:
        """Inverse of `to_dict`, for so many variables.  Raises ValueError for anything else."""
        low, high = (saved_array(data[key], key, (n_variables,)) for key in ("low", "high"))
        if not (low < high).all():
            raise ValueError("a variable has no range, from low to high")
        if data["outside"] != HELD:
            raise ValueError(f"outside = {data['outside']!r} is not known")
        return cls(low, high)

    def _not_clipped(self, data: Array) -> Array:
        return 2.0 * (data - self.low) / (self.high - self.low) - 1.0
