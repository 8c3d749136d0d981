"""Prediction intervals along a record: a lower and an upper bound per sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.typing import Array, BoolArray


@dataclass(frozen=True, eq=False)
class Intervals:
    """Prediction intervals of the residual, each made before its residual was seen.

    lower_v, upper_v : (n,) V, relative to the prediction (add the prediction for bounds of the measured voltage).
    warm : (n,) False where the interval is not calibrated. One step ahead that is where the history was too short, and
    the marginal interval of the calibration is used; in a free run, outside the trained range.
    """

    lower_v: Array
    upper_v: Array
    warm: BoolArray

    def __len__(self) -> int:
        return len(self.lower_v)

    def __repr__(self) -> str:
        width_mv = MV_PER_V * float(np.mean(self.width_v)) if len(self) else np.nan
        width = f"{width_mv:.3g} mV wide in the mean"
        return f"Intervals({len(self):,} samples, {width}, {np.sum(~self.warm):,} not calibrated)"

    @property
    def width_v(self) -> Array:
        """(n,) V, >= 0. One step ahead it is positive (`Calibrated.floor_v`), but for the refitted forest of the
        tables, which has no floor; of a free run it is 0 where nearly all errors of the calibration were."""
        return self.upper_v - self.lower_v

    def covers(self, residuals: Array) -> BoolArray:
        """(n,) True where the residual lies inside; a missing (NaN) residual is not covered."""
        return (residuals >= self.lower_v) & (residuals <= self.upper_v)
