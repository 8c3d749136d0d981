"""The family of SPCI: quantile regression of the next residual on its causal history.

A `QuantileModel` turns feature rows into quantiles; `RegressionBand` feeds it with the history and picks the
narrowest pair. A new regressor is one small file with a QuantileModel and two lines in the registry.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from aesi.conformal.bands.band import Band, RawBand, State
from aesi.conformal.bands.history import History
from aesi.conformal.bands.narrowest import narrowest
from aesi.numerics.typing import Array, BoolArray


@dataclass(frozen=True, eq=False)
class FitTask:
    """What a regressor is fitted to.

    rows : (n, p); the first n_history columns are residuals or linear in them, V.  targets : (n,) V.
    levels : (2 B,) quantile levels.  floor_v : V, no band is narrower.
    """

    rows: Array
    targets: Array
    levels: Array
    n_history: int
    floor_v: float
    rng: np.random.Generator

    def only(self, rows: BoolArray) -> FitTask:
        """The same task on some of the rows."""
        return replace(self, rows=self.rows[rows], targets=self.targets[rows])


class QuantileModel(ABC):
    """A fitted map from feature rows (n, p) to quantiles (n, 2 B): B lower levels, then B upper ones."""

    kind: ClassVar[str]

    @abstractmethod
    def quantiles(self, rows: Array) -> Array:
        """(n, 2 B) V."""

    @abstractmethod
    def to_state(self) -> State:
        """Everything `from_state` needs."""

    @classmethod
    @abstractmethod
    def from_state(cls, state: State) -> Self:
        """Inverse of `to_state`."""


Fitter = Callable[[FitTask], QuantileModel]


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

    def to_state(self) -> State:
        history, model = self.history.to_state(), self.model.to_state()
        return {"history": history, "model_kind": self.model.kind, "model": model}

    @classmethod
    def from_state(cls, state: State) -> Self:
        from aesi.conformal.registry import MODELS

        model = MODELS[state["model_kind"]].from_state(state["model"])
        return cls(History.from_state(state["history"]), model)
