"""The baseline without a fit: physics without a correction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import ErrorSeries, FreeRun


@dataclass(frozen=True)
class Bare:
    """A physics model without correction: the one in `ErrorSeries.physics` under this name, else that of the series."""

    name: str = "ESPM"

    def one_step(self, series: ErrorSeries) -> Array:
        """(n,) V, the difference of its voltage to that of the series; the first sample is the measured error_v[0]."""
        return self.k_step(series, 1)

    def free_run(self, series: ErrorSeries, error0_v: float | None = None) -> FreeRun:
        """The difference of its voltage to that of the series; without a trained range no sample is outside."""
        return FreeRun(self._voltage_difference_v(series), None, np.zeros(len(series), dtype=bool))

    def k_step(self, series: ErrorSeries, steps: int) -> Array:
        """(n,) V, as `one_step`."""
        return np.append(series.error_v[:1], self._voltage_difference_v(series)[1:])

    def _voltage_difference_v(self, series: ErrorSeries) -> Array:
        """(n,) V, voltage of this model minus that of the series' own."""
        return series.physics.get(self.name, series.model_v) - series.model_v
