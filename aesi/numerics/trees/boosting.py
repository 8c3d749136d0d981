"""Gradient-boosted quantiles: a sum of small trees that descends the pinball loss.

    F_0 = quantile of y;    F_m = F_(m-1) + rate * tree_m,    tree_m fitted to tau - 1[y < F_(m-1)]       (1)

and the value of each leaf the tau-quantile of y - F_(m-1) inside it. Trees are perfect binary trees of a fixed
depth over features cut into at most N_BINS ranges; each round sees a random share of the rows. Written out
here because a hundred thousand rows then take a second, one row takes a microsecond, and the fitted model is
five plain arrays.

Friedman, Annals of Statistics 29 (2001) 1189; Friedman, Comput. Stat. Data Anal. 38 (2002) 367 (row samples).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import AnyArray, Array, IntArray

N_BINS = 64
"""Ranges that a feature is cut into; their numbers fit into a byte. A convention of histogram boosting."""


@dataclass(frozen=True)
class Growth:
    """rounds of boosting, depth of each tree, learning rate, share of the rows a round sees, and what a leaf
    holds at least: a share of their weight, and this many rows of mean weight (a tail quantile of few rows is
    their extreme)."""

    rounds: int = 60
    depth: int = 5
    rate: float = 0.15
    row_share: float = 0.5
    min_leaf_share: float = 2e-3
    min_leaf_rows: float = 25.0


@dataclass(frozen=True, eq=False)
class BoostedTrees:
    """base : value before the first tree.  feature, threshold : (rounds, 2**depth - 1), nodes in heap order, a
    row goes left where x[feature] <= threshold.  leaf : (rounds, 2**depth), learning rate included."""

    base: float
    feature: IntArray
    threshold: Array
    leaf: Array

    def predict(self, rows: Array) -> Array:
        """(n,) of rows (n, p)."""
        out = np.full(len(rows), self.base)
        add_trees(rows, self.feature, self.threshold, self.leaf, out)
        return out


def bin_edges(rows: Array) -> list[Array]:
    """For each column, up to N_BINS - 1 increasing values that cut it into ranges of like counts."""
    levels = np.linspace(0, 1, N_BINS + 1)[1:-1]
    return [np.unique(np.quantile(column, levels, method="lower")) for column in rows.T]


def binned(rows: Array, edges: list[Array]) -> AnyArray:
    """(n, p) small integers: how many edges lie below each value."""
    return np.column_stack(
        [np.searchsorted(edge, column).astype(np.uint8) for edge, column in zip(edges, rows.T, strict=True)]
    )


def fit_boosted(
    bins: AnyArray,
    edges: list[Array],
    y: Array,
    weights: Array,
    tau: float,
    growth: Growth,
    rng: np.random.Generator,
) -> BoostedTrees:
    """Boost the tau-quantile of y (n,) given `binned` rows (n, p), `weights` (n,) > 0 on the pinball loss."""
    n = len(y)
    n_nodes, n_leaves = 2**growth.depth - 1, 2**growth.depth
    order = np.argsort(y)
    base = float(y[order[np.searchsorted(np.cumsum(weights[order]), tau * weights.sum())]])
    f = np.full(n, base)
    feature = np.zeros((growth.rounds, n_nodes), dtype=np.int64)
    cut = np.zeros((growth.rounds, n_nodes), dtype=np.int64)
    leaf = np.zeros((growth.rounds, n_leaves))
    for m in range(growth.rounds):
        sample = np.flatnonzero(rng.random(n) < growth.row_share)
        least = max(growth.min_leaf_share, growth.min_leaf_rows / max(1, sample.size)) * weights[sample].sum()
        _grow(bins, y, f, weights, tau, sample, growth.depth, least, feature[m], cut[m])
        _leaf_quantiles(bins, y - f, weights, tau, sample, growth.depth, feature[m], cut[m], leaf[m])
        leaf[m] *= growth.rate
        _add_binned(bins, growth.depth, feature[m], cut[m], leaf[m], f)
    threshold = np.full(cut.shape, np.inf)
    for m, node in np.ndindex(*cut.shape):
        if cut[m, node] < N_BINS:
            threshold[m, node] = edges[feature[m, node]][cut[m, node]]
    return BoostedTrees(base, feature, threshold, leaf)


@kept_njit()
def add_trees(rows: Array, feature: IntArray, threshold: Array, leaf: Array, out: Array) -> None:
    """Add the trees' values of rows (n, p) to out (n,)."""
    rounds, n_nodes = feature.shape
    for k in range(rows.shape[0]):
        for m in range(rounds):
            node = 0
            while node < n_nodes:
                node = 2 * node + (1 if rows[k, feature[m, node]] <= threshold[m, node] else 2)
            out[k] += leaf[m, node - n_nodes]


@kept_njit()
def _descend(bins: AnyArray, row: int, levels: int, feature: IntArray, cut: IntArray) -> int:
    node = 0
    for _ in range(levels):
        node = 2 * node + (1 if bins[row, feature[node]] <= cut[node] else 2)
    return node


@kept_njit()
def _add_binned(bins: AnyArray, depth: int, feature: IntArray, cut: IntArray, leaf: Array, f: Array) -> None:
    first = 2**depth - 1
    for k in range(bins.shape[0]):
        f[k] += leaf[_descend(bins, k, depth, feature, cut) - first]


@kept_njit()
def _grow(
    bins: AnyArray,
    y: Array,
    f: Array,
    weights: Array,
    tau: float,
    sample: IntArray,
    depth: int,
    least: float,
    feature: IntArray,
    cut: IntArray,
) -> None:
    """Grow one tree level by level on the gradients of the sampled rows; cut = N_BINS where no split helps."""
    p = bins.shape[1]
    node = np.zeros(sample.size, dtype=np.int64)
    for level in range(depth):
        first, width = 2**level - 1, 2**level
        gradients = np.zeros((width, p, N_BINS))
        masses = np.zeros((width, p, N_BINS))
        for s in range(sample.size):
            k = sample[s]
            g = weights[k] * (tau if y[k] >= f[k] else tau - 1)
            w = weights[k]
            here = node[s] - first
            for j in range(p):
                b = bins[k, j]
                gradients[here, j, b] += g
                masses[here, j, b] += w
        for here in range(width):
            j, b = _best_split(gradients[here], masses[here], least)
            feature[first + here], cut[first + here] = j, b
        for s in range(sample.size):
            at = node[s]
            node[s] = 2 * at + (1 if bins[sample[s], feature[at]] <= cut[at] else 2)


@kept_njit()
def _best_split(gradients: Array, masses: Array, least: float) -> tuple[int, int]:
    """(feature, bin) of the split that explains most of the gradients' variance; bin N_BINS for none."""
    g_all, m_all = gradients[0].sum(), masses[0].sum()
    best, best_j, best_b = 1e-12, 0, N_BINS
    if m_all <= 2 * least:
        return best_j, best_b
    whole = g_all**2 / m_all
    for j in range(gradients.shape[0]):
        g, m = 0.0, 0.0
        for b in range(N_BINS - 1):
            g += gradients[j, b]
            m += masses[j, b]
            if m < least or masses[j, b] == 0.0:
                continue
            if m_all - m < least:
                break
            gain = g**2 / m + (g_all - g) ** 2 / (m_all - m) - whole
            if gain > best:
                best, best_j, best_b = gain, j, b
    return best_j, best_b


@kept_njit()
def _leaf_quantiles(
    bins: AnyArray,
    rest: Array,
    weights: Array,
    tau: float,
    sample: IntArray,
    depth: int,
    feature: IntArray,
    cut: IntArray,
    leaf: Array,
) -> None:
    """leaf (2**depth,) : weighted tau-quantile of `rest` over the sampled rows of each leaf."""
    first = 2**depth - 1
    home = np.empty(sample.size, dtype=np.int64)
    total = np.zeros(leaf.size)
    for s in range(sample.size):
        home[s] = _descend(bins, sample[s], depth, feature, cut) - first
        total[home[s]] += weights[sample[s]]
    order = np.argsort(rest[sample])
    seen = np.zeros(leaf.size)
    done = np.zeros(leaf.size, dtype=np.bool_)
    for s in order:
        h = home[s]
        if done[h]:
            continue
        seen[h] += weights[sample[s]]
        if seen[h] >= tau * total[h]:
            leaf[h] = rest[sample[s]]
            done[h] = True
