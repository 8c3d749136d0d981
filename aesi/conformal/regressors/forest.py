"""Quantile regression forest, the regressor of the paper and of SPCI as published.

Grown by `quantile-forest` with all samples kept in each leaf (its default keeps one, and the bands then
cover far too little), then flattened: each leaf's distribution on a common grid (`numerics.trees`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from aesi.conformal.regressors.model import FitTask, Kinds, QuantileModel, check_features
from aesi.numerics.files.restored import saved_array
from aesi.numerics.trees.forest import Splits, check_splits, flatten, forest_quantiles
from aesi.numerics.typing import Array, SavedState

GRID_POINTS = 512
"""Levels of probability at which a forest's quantiles are kept; between them they are interpolated, unless several
levels have one value: an atom, of which rounded targets have many."""
TAIL = 2e-4
"""The grid is even in probability between the tails and even in its logarithm within them."""
MOST = 2.0**53
"""Bound of a saved number of a column, node or leaf: of whole numbers that a float holds."""


def _grid(targets: Array) -> tuple[Array, Array]:
    """(grid, start) of `forest_quantiles`: quantiles of all targets, dense in the tails."""
    tail = np.geomspace(TAIL, 0.02, GRID_POINTS // 8, endpoint=False)
    levels = np.concatenate(
        [[0.0], tail, np.linspace(0.02, 0.98, 3 * GRID_POINTS // 4), 1 - tail[::-1], [1.0]]
    )
    grid, repeats = np.unique(np.quantile(targets, levels), return_counts=True)
    return grid, np.where(repeats > 1, grid, _values_before(grid))


def _values_before(grid: Array) -> Array:
    """(g,) the grid value before each, for the first itself."""
    return np.concatenate([grid[:1], grid[:-1]])


def _leaf_distributions(forest: Any, grid: Array) -> Array:
    """(n_leaves, g) share of each leaf's own training samples at or below each grid value."""
    # quantile-forest numbers its samples by the order of their targets, from one; zero is padding.
    ordered = np.asarray(forest.forest_.y_train)[0]
    position = np.searchsorted(grid, ordered)  # first grid value at or above the target
    rows = []
    for tree, members in zip(forest.estimators_, forest.forest_.y_train_leaves, strict=True):
        for node in np.flatnonzero(tree.tree_.children_left < 0):
            inside = np.asarray(members[node][0])
            inside = inside[inside > 0] - 1
            counts = np.bincount(position[inside], minlength=len(grid))
            rows.append(np.cumsum(counts) / len(inside))
    return np.array(rows)


@dataclass(frozen=True, eq=False)
class ForestQuantiles(QuantileModel):
    """levels : (2 B,).  grid, start : (g,) V.  leaf_cdf : (n_leaves, g).  splits : the trees."""

    levels: Array
    grid: Array
    start: Array
    leaf_cdf: Array
    splits: Splits
    kind: ClassVar[str] = "forest"

    @classmethod
    def fit(cls, task: FitTask, **forest: Any) -> Self:
        """`forest` goes to RandomForestQuantileRegressor."""
        from quantile_forest import RandomForestQuantileRegressor

        regressor = RandomForestQuantileRegressor(
            max_samples_leaf=None, random_state=int(task.rng.integers(2**31)), **forest
        )
        regressor.fit(task.rows, task.targets)
        splits = flatten(regressor.estimators_)
        grid, start = _grid(task.targets)
        return cls(task.levels, grid, start, _leaf_distributions(regressor, grid), splits)

    def quantiles(self, rows: Array) -> Array:
        out = np.empty((len(rows), self.levels.size))
        s = self.splits
        # scikit-learn compares in single precision; the same rounding keeps every row in its leaf.
        single = np.ascontiguousarray(rows, dtype=np.float32)
        forest_quantiles(
            single,
            self.levels,
            self.grid,
            self.start,
            self.leaf_cdf,
            s.roots,
            s.feature,
            s.threshold,
            s.left,
            s.right,
            out,
        )
        return out

    def check_columns(self, count: int) -> None:
        check_features(self.splits.feature, count)

    def to_state(self) -> SavedState:
        own = {name: array for name, array in vars(self).items() if name != "splits"}
        return own | vars(self.splits)

    @classmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        levels = saved_array(state["levels"], "levels", (None,), 0.0, 1.0)
        grid = saved_array(state["grid"], "grid", (None,))
        leaf_cdf = saved_array(state["leaf_cdf"], "leaf_cdf", (None, len(grid)), 0.0, 1.0)
        # Quantiles of a model saved without it are interpolated between all values.
        start = saved_array(state.get("start", _values_before(grid)), "start", (len(grid),))
        threshold = saved_array(state["threshold"], "threshold", (None,))
        nodes = len(threshold)
        feature, left, right = (
            saved_array(state[key], key, (nodes,), -1.0, MOST).astype(np.int64)
            for key in ("feature", "left", "right")
        )
        roots = saved_array(state["roots"], "roots", (None,), 0.0, nodes - 1.0).astype(np.int64)
        splits = Splits(roots, feature, threshold, left, right)
        check_splits(splits, len(leaf_cdf))
        return cls(levels, grid, start, leaf_cdf, splits)
