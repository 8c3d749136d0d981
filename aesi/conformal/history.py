"""What a regression sees of the past: the raw window, or causal features of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np

from aesi.conformal.band import State
from aesi.numerics.typing import Array, BoolArray
from aesi.numerics.windows import N_LAGS, history_features, history_row, n_features, raw_lags, spans

View = Literal["features", "lags"]


@dataclass(frozen=True)
class History:
    """window : samples.  view : "features" (lags, rolling means, deviations, steps: `numerics.windows`),
    ready after N_LAGS samples; or "lags" (the last `window` residuals as they are), ready after `window`."""

    window: int
    view: View = "features"

    @property
    def needed(self) -> int:
        """Samples before the first row."""
        return N_LAGS if self.view == "features" else self.window

    def rows(self, residuals: Array) -> tuple[Array, BoolArray]:
        """Rows (n, p) for every sample of a record, and (n,) whether the history suffices."""
        if self.view == "features":
            return history_features(residuals, self.window)
        return raw_lags(residuals, self.window)

    def row(self, past: Array) -> Array | None:
        """The row after `past` (most recent last, at most the window), None where it is too short."""
        if len(past) < self.needed:
            return None
        if self.view == "lags":
            return past[::-1].copy()
        out = np.empty(n_features(self.window))
        history_row(past, spans(self.window), out)
        return out

    def to_state(self) -> State:
        return {"window": self.window, "view": self.view}

    @classmethod
    def from_state(cls, state: State) -> Self:
        return cls(int(state["window"]), state["view"])
