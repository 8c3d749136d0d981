import numpy as np
import pytest

from aesi.numerics.trees.boosting import Growth, bin_edges, binned, fit_boosted


def boost(x: np.ndarray, y: np.ndarray, tau: float, growth: Growth | None = None):
    edges = bin_edges(x)
    return fit_boosted(
        binned(x, edges), edges, y, np.ones(len(y)), tau, growth or Growth(), np.random.default_rng(0)
    )


def test_finds_a_step_in_the_spread(rng: np.random.Generator) -> None:
    x = rng.uniform(-1, 1, (8000, 3))
    y = np.where(x[:, 1] > 0.2, 3.0, 1.0) * rng.standard_normal(8000)
    upper = boost(x, y, 0.9, Growth(depth=2))
    probe = rng.uniform(-1, 1, (4000, 3))
    found = upper.predict(probe)
    # 1.2816 times the deviation; means over half the range rest on thousands of rows each.
    assert found[probe[:, 1] < 0.15].mean() == pytest.approx(1.2816, rel=0.06)
    assert found[probe[:, 1] > 0.25].mean() == pytest.approx(3 * 1.2816, rel=0.06)


def test_the_share_below_is_the_level(rng: np.random.Generator) -> None:
    x = rng.standard_normal((6000, 4))
    y = np.sin(2 * x[:, 0]) + np.abs(x[:, 1]) * rng.standard_normal(6000)
    for tau in (0.05, 0.5, 0.95):
        assert np.mean(y <= boost(x, y, tau).predict(x)) == pytest.approx(tau, abs=0.03)


def test_weights_count_like_copies(rng: np.random.Generator) -> None:
    x = rng.standard_normal((400, 2))
    y = rng.standard_normal(400)
    edges = bin_edges(x)
    all_rows = Growth(rounds=5, row_share=1.1, min_leaf_rows=0.0)
    heavy = np.where(np.arange(400) < 100, 3.0, 1.0)
    weighted = fit_boosted(binned(x, edges), edges, y, heavy, 0.3, all_rows, np.random.default_rng(0))
    copies = np.repeat(np.arange(400), heavy.astype(int))
    repeated = fit_boosted(
        binned(x[copies], edges), edges, y[copies], np.ones(600), 0.3, all_rows, np.random.default_rng(0)
    )
    np.testing.assert_allclose(weighted.predict(x), repeated.predict(x), atol=1e-12)


def test_a_constant_column_and_a_constant_target_do_no_harm() -> None:
    x = np.column_stack([np.zeros(300), np.arange(300.0)])
    np.testing.assert_array_equal(boost(x, np.full(300, 2.0), 0.5).predict(x), np.full(300, 2.0))


def test_the_same_seed_grows_the_same_trees(rng: np.random.Generator) -> None:
    x, y = rng.standard_normal((500, 3)), rng.standard_normal(500)
    np.testing.assert_array_equal(boost(x, y, 0.9).predict(x), boost(x, y, 0.9).predict(x))
