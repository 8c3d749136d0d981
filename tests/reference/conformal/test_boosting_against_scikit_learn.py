"""Boosted quantiles against scikit-learn's histogram boosting at like size."""

import numpy as np
import pytest

from aesi.numerics.trees.boosting import Growth, bin_edges, binned, fit_boosted


@pytest.mark.parametrize("tau", [0.05, 0.95])
def test_no_worse_on_unseen_rows(rng: np.random.Generator, tau: float) -> None:
    from sklearn.ensemble import HistGradientBoostingRegressor

    rows = rng.standard_normal((12_000, 8))
    y = np.sin(2 * rows[:, 0]) + np.exp(0.5 * rows[:, 1]) * rng.standard_normal(12_000)
    train, test = slice(0, 8000), slice(8000, None)
    edges = bin_edges(rows[train])
    ours = fit_boosted(
        binned(rows[train], edges),
        edges,
        y[train],
        np.ones(8000),
        tau,
        Growth(depth=4),
        np.random.default_rng(0),
    )
    theirs = HistGradientBoostingRegressor(
        loss="quantile",
        quantile=tau,
        max_iter=60,
        max_leaf_nodes=16,
        learning_rate=0.15,
        early_stopping=False,
    ).fit(rows[train], y[train])

    def loss(fitted: np.ndarray) -> float:
        r = y[test] - fitted
        return float(np.mean(np.maximum(tau * r, (tau - 1) * r)))

    # Both overfit a little, by their own row sampling and growth order: five per cent covers the difference.
    assert loss(ours.predict(rows[test])) < 1.05 * loss(theirs.predict(rows[test]))
