"""Bands from the distribution of the residuals alone: fixed (split conformal) or rolling (EnbPI)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from aesi.conformal.bands.band import Band, RawBand
from aesi.conformal.bands.narrowest import narrowest
from aesi.conformal.regressors.model import Kinds
from aesi.numerics.compiled import kept_njit
from aesi.numerics.files.restored import saved_array, saved_count, saved_number
from aesi.numerics.typing import Array, BoolArray, SavedState

ROUND_OFF = 1e-9
"""Tolerance for round-off in a rank."""


@dataclass(frozen=True, eq=False)
class FixedBand(Band):
    """Split conformal prediction: two constant quantiles.  low, high : V."""

    low: float
    high: float
    kind: ClassVar[str] = "fixed"

    def batch(self, residuals: Array, current_a: Array | None) -> RawBand:
        n = len(residuals)
        return RawBand(np.full(n, self.low), np.full(n, self.high), np.ones(n, dtype=bool))

    def row(self, past: Array, recent_current: Array) -> tuple[float, float] | None:
        return self.low, self.high

    def to_state(self) -> SavedState:
        return {"low": self.low, "high": self.high}

    @classmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        low, high = (saved_number(state[key], key) for key in ("low", "high"))
        if low > high:
            raise ValueError(f"low = {low:g} V lies above high = {high:g} V")
        return cls(low, high)


@kept_njit()
def _window_quantiles(past: Array, levels: Array, out: Array) -> None:
    # Position (n + 1) level among the order statistics: the rank of conformal prediction, interpolated. A rank that n
    # residuals do not have is infinite: the extreme in its place would make the band narrower than its level.
    ordered = np.sort(past)
    n = ordered.size
    for j in range(levels.size):
        position = (n + 1) * levels[j] - 1
        if -ROUND_OFF < position < n - 1 + ROUND_OFF:
            i = min(max(int(position), 0), n - 2)
            out[j] = ordered[i] + (position - i) * (ordered[i + 1] - ordered[i])
        else:
            out[j] = np.inf if position > 0 else -np.inf


@kept_njit()
def _rolling(series: Array, window: int, needed: int, levels: Array, out: Array, ready: BoolArray) -> None:
    run = 0
    for k in range(series.size):
        if run >= needed:
            _window_quantiles(series[k - min(run, window) : k], levels, out[k])
            ready[k] = True
        run = run + 1 if np.isfinite(series[k]) else 0


@dataclass(frozen=True, eq=False)
class RollingBand(Band):
    """EnbPI's interval: the narrowest pair of quantiles of the last `window` residuals.

    levels : (2 B,) pairs beta, 1 - alpha + beta; a pair may be chosen once there are enough residuals for its ranks.
    needed : number of residuals before any pair may be chosen.
    Xu & Xie, ICML 2021 (EnbPI).
    """

    window: int
    needed: int
    levels: Array
    kind: ClassVar[str] = "rolling"

    def batch(self, residuals: Array, current_a: Array | None) -> RawBand:
        quantiles = np.zeros((len(residuals), len(self.levels)))
        ready = np.zeros(len(residuals), dtype=bool)
        _rolling(residuals, self.window, self.needed, self.levels, quantiles, ready)
        low, high = np.empty(len(residuals)), np.empty(len(residuals))
        narrowest(quantiles, low, high)
        return RawBand(low, high, ready)

    def row(self, past: Array, recent_current: Array) -> tuple[float, float] | None:
        if len(past) < self.needed:
            return None
        quantiles = np.empty((1, len(self.levels)))
        _window_quantiles(past, self.levels, quantiles[0])
        low, high = np.empty(1), np.empty(1)
        narrowest(quantiles, low, high)
        return float(low[0]), float(high[0])

    def to_state(self) -> SavedState:
        return {"window": self.window, "needed": self.needed, "levels": self.levels}

    @classmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        window, needed = (saved_count(state[key], key) for key in ("window", "needed"))
        return cls(window, needed, saved_array(state["levels"], "levels", (None,), 0.0, 1.0))
