"""The narrowest band between conditional quantiles of the next residual, given its history: the family of SPCI."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from aesi.conformal.bands.band import Band, RawBand
from aesi.conformal.bands.history import History
from aesi.conformal.bands.narrowest import narrowest
from aesi.conformal.regressors.model import Kinds, QuantileModel
from aesi.numerics.typing import Array, SavedState


@dataclass(frozen=True, eq=False)
class RegressionBand(Band):
    """The narrowest pair of conditional quantiles given the history."""

    history: History
    model: QuantileModel
    kind: ClassVar[str] = "regression"

    @property
    def needs_current(self) -> bool:
        return self.history.with_current

    def from_rows(self, rows: Array) -> tuple[Array, Array]:
        """(low, high), (n,) V each, of feature rows (n, p)."""
        low, high = np.empty(len(rows)), np.empty(len(rows))
        narrowest(self.model.quantiles(rows), low, high)
        return low, high

    def batch(self, residuals: Array, current_a: Array | None) -> RawBand:
        rows, ready = self.history.rows(residuals, current_a)
        low, high = self.from_rows(rows)
        return RawBand(low, high, ready)

    def row(self, past: Array, recent_current: Array) -> tuple[float, float] | None:
        features = self.history.row(past, recent_current)
        if features is None:
            return None
        low, high = self.from_rows(features[None, :])
        return float(low[0]), float(high[0])

    def to_state(self) -> SavedState:
        history, model = self.history.to_state(), self.model.to_state()
        return {"history": history, "model_kind": self.model.kind, "model": model}

    @classmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        history = History.from_state(state["history"])
        model = kinds[state["model_kind"]].from_state(state["model"], kinds)
        model.check_columns(history.n_columns)
        return cls(history, model)
