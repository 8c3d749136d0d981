"""The interface of a regressor of the SPCI family: quantiles of the next residual from feature rows.

A new regressor is one small file with a `QuantileModel`, and a method that fits it in `aesi.conformal.registry`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from aesi.numerics.typing import Array, BoolArray, IntArray, SavedState


@dataclass(frozen=True, eq=False)
class FitTask:
    """The data and settings of a regressor's fit.

    rows : (n, p); the first n_history columns are residuals or linear in them, V.  targets : (n,) V.
    levels : (2 B,) quantile levels.  floor_v : least width of a band, V.
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
    def check_columns(self, count: int) -> None:
        """Raises ValueError where it is no map from rows of so many columns: compiled code would read beyond them."""

    @abstractmethod
    def to_state(self) -> SavedState:
        """Everything `from_state` needs."""

    @classmethod
    @abstractmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        """Inverse of `to_state`; `kinds` has the regressors that may be part of this one.  Raises ValueError, or
        KeyError, for anything else."""


def check_features(feature: IntArray, count: int) -> None:
    """Raises ValueError for a split by a column beyond the rows' `count`.  feature : (n,) columns of the splits."""
    if feature.size and feature.max() >= count:
        raise ValueError(f"feature holds {feature.max()}, and a row has {count} columns")


RegressorFit = Callable[[FitTask], QuantileModel]
Kinds = Mapping[str, type[QuantileModel]]
"""Kind, as in a saved state -> class of the regressor."""
