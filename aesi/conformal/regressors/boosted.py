"""Gradient-boosted quantiles (`aesi.numerics.trees.boosting`), one sum of trees a level; meant for normalised rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from aesi.conformal.regressors.model import FitTask, Kinds, QuantileModel, check_features
from aesi.numerics.files.restored import saved_array
from aesi.numerics.trees.boosting import BoostedTrees, Growth, bin_edges, binned, fit_boosted
from aesi.numerics.typing import Array, SavedState


@dataclass(frozen=True, eq=False)
class BoostedQuantiles(QuantileModel):
    """trees : one a level."""

    trees: tuple[BoostedTrees, ...]
    kind: ClassVar[str] = "boosted"

    @classmethod
    def fit(cls, task: FitTask, weights: Array, growth: Growth) -> Self:
        """weights : (n,) > 0 on the loss of each row."""
        edges = bin_edges(task.rows)
        bins = binned(task.rows, edges)
        return cls(
            tuple(
                fit_boosted(bins, edges, task.targets, weights, float(level), growth, task.rng)
                for level in task.levels
            )
        )

    def quantiles(self, rows: Array) -> Array:
        return np.column_stack([trees.predict(rows) for trees in self.trees])

    def check_columns(self, count: int) -> None:
        check_features(np.concatenate([each.feature.ravel() for each in self.trees]), count)

    def to_state(self) -> SavedState:
        return {
            "base": np.array([t.base for t in self.trees]),
            "feature": np.array([t.feature for t in self.trees]),
            "threshold": np.array([t.threshold for t in self.trees]),
            "leaf": np.array([t.leaf for t in self.trees]),
        }

    @classmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        base, threshold = (
            saved_array(state["base"], "base", (None,)),
            np.asarray(state["threshold"], dtype=float),
        )
        levels, rounds, nodes = threshold.shape
        leaf = saved_array(state["leaf"], "leaf", (levels, rounds, nodes + 1))
        feature = saved_array(state["feature"], "feature", (len(base), rounds, nodes), 0.0).astype(np.int64)
        return cls(
            tuple(BoostedTrees(float(base[j]), feature[j], threshold[j], leaf[j]) for j in range(len(base)))
        )
