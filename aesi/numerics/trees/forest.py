"""Regression trees as flat arrays, evaluated without the library that grew them.

A forest of quantile trees is a set of splits and, in each leaf, a distribution. Here each leaf holds its
distribution function on one common grid of values, so that the forest's conditional distribution (the average
over trees of the leaf distributions, the weights of the source) is a sum of grid rows, and every quantile is
one search. The grid costs resolution (half a grid step) and buys bounded memory and microseconds a row.

Between grid values that leave out samples a quantile is interpolated, as of a continuous distribution. At an atom, a
value of positive probability, the distribution function jumps, and all levels within the jump have that value for their
quantile: one interpolated between two atoms leaves out the samples that lie on the one beyond it.

Meinshausen, J. Machine Learning Research 7 (2006) 983.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import AnyArray, Array, IntArray


@dataclass(frozen=True, eq=False)
class Splits:
    """Trees laid end to end. Node i goes to left[i] where x[feature[i]] <= threshold[i], else to right[i].

    roots : (n_trees,) first node of each tree.  feature : (n_nodes,) -1 in a leaf.  threshold : (n_nodes,).
    left, right : (n_nodes,) absolute node numbers; in a leaf, left is the leaf's number.
    """

    roots: IntArray
    feature: IntArray
    threshold: Array
    left: IntArray
    right: IntArray


@kept_njit()
def leaf_of(
    x: AnyArray, root: int, feature: IntArray, threshold: Array, left: IntArray, right: IntArray
) -> int:
    """Number of the leaf that x falls into."""
    node = root
    while feature[node] >= 0:
        node = left[node] if x[feature[node]] <= threshold[node] else right[node]
    return left[node]


@kept_njit()
def _invert(cdf: Array, grid: Array, start: Array, level: float) -> float:
    """Inverse of a distribution function on a grid; see `forest_quantiles`."""
    last = cdf.size - 1
    if level <= cdf[0]:
        return grid[0]
    if level >= cdf[last]:
        return grid[last]
    i = np.searchsorted(cdf, level)
    step = cdf[i] - cdf[i - 1]
    share = (level - cdf[i - 1]) / step if step > 0 else 1.0
    return start[i] + share * (grid[i] - start[i])


@kept_njit()
def forest_quantiles(
    rows: AnyArray,
    levels: Array,
    grid: Array,
    start: Array,
    leaf_cdf: Array,
    roots: IntArray,
    feature: IntArray,
    threshold: Array,
    left: IntArray,
    right: IntArray,
    out: Array,
) -> None:
    """Fill out (n, L) with the conditional quantiles of rows (n, p) at `levels` (L,).

    grid : (g,) increasing.  start : (g,) value from which quantiles up to each grid value are interpolated: the grid
    value before it, or at an atom itself.  leaf_cdf : (n_leaves, g) distribution function of each leaf on the grid.
    """
    cdf = np.empty(grid.size)
    for k in range(rows.shape[0]):
        cdf[:] = 0.0
        for root in roots:
            leaf = leaf_of(rows[k], root, feature, threshold, left, right)
            for g in range(grid.size):
                cdf[g] += leaf_cdf[leaf, g]
        cdf /= roots.size
        for j in range(levels.size):
            out[k, j] = _invert(cdf, grid, start, levels[j])


def check_splits(splits: Splits, leaves: int) -> None:
    """Raises ValueError for splits through which a row may not reach one of so many leaves: each node's children come
    after it, as `flatten` numbers them."""
    inner = splits.feature >= 0
    nodes = np.arange(len(inner))
    for children in (splits.left[inner], splits.right[inner]):
        if ((children <= nodes[inner]) | (children >= len(nodes))).any():
            raise ValueError("a split leads to no node after it")
    numbers = splits.left[~inner]
    if ((numbers < 0) | (numbers >= leaves)).any():
        raise ValueError("a split leads to no leaf")


def flatten(trees: list[Any]) -> Splits:
    """The splits of fitted scikit-learn trees (their `tree_` attribute)."""
    roots, feature, threshold, left, right = [], [], [], [], []
    nodes = leaves = 0
    for tree in trees:
        t = tree.tree_
        is_leaf = t.children_left < 0
        numbers = leaves + np.cumsum(is_leaf) - 1
        roots.append(nodes)
        feature.append(np.where(is_leaf, -1, t.feature))
        threshold.append(np.where(is_leaf, 0.0, t.threshold))
        left.append(np.where(is_leaf, numbers, t.children_left + nodes))
        right.append(np.where(is_leaf, 0, t.children_right + nodes))
        nodes += t.node_count
        leaves += int(is_leaf.sum())
    return Splits(
        np.array(roots, dtype=np.int64),
        np.concatenate(feature).astype(np.int64),
        np.concatenate(threshold).astype(float),
        np.concatenate(left).astype(np.int64),
        np.concatenate(right).astype(np.int64),
    )
