"""The two models that cost nothing, beside which every figure stands: no correction, and persistence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import ErrorSeries, FreeRun


@dataclass(frozen=True)
class Bare:
    """The physics model as it is: the predicted error is zero."""

    name: str = "ESPM"

    def one_step(self, series: ErrorSeries) -> Array:
        """(n,) V: zero, but for the first sample, which is the measured error_v[0]."""
        return np.append(series.error_v[:1], np.zeros(len(series) - 1))

    def free_run(self, series: ErrorSeries, error0_v: float | None = None) -> FreeRun:
        """Zero throughout; it was trained on nothing, so no sample lies outside its range."""
        return FreeRun(np.zeros(len(series)), None, np.zeros(len(series), dtype=bool))

    def k_step(self, series: ErrorSeries, steps: int) -> Array:
        """(n,) V, as `one_step`."""
        return self.one_step(series)


@dataclass(frozen=True)
class Persistence:
    """e[k + 1] = e[k]: the last measured error is held."""

    name: str = "persistence"

    def one_step(self, series: ErrorSeries) -> Array:
        """(n,) V: the error one sample before; the first is error_v[0]."""
        return self.k_step(series, 1)

    def free_run(self, series: ErrorSeries, error0_v: float | None = None) -> FreeRun:
        """The error at the start, held."""
        start = float(series.error_v[0]) if error0_v is None else error0_v
        return FreeRun(np.full(len(series), start), None, np.zeros(len(series), dtype=bool))

    def k_step(self, series: ErrorSeries, steps: int) -> Array:
        """(n,) V: the error `steps` samples before; error_v[0] for the first ones."""
        return series.error_v[np.maximum(np.arange(len(series)) - steps, 0)]
