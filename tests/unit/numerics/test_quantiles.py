import numpy as np
import pytest
from scipy.stats import norm

from aesi.errors import FitError
from aesi.numerics.quantile_regression import fit_quantiles
from aesi.numerics.quantiles import conformal_quantile


def test_the_rank_of_conformal_prediction() -> None:
    # Nine scores: the tenth is below their largest with probability 9/10.
    assert conformal_quantile(np.arange(1.0, 10.0), 0.1) == 9.0
    assert conformal_quantile(np.arange(1.0, 20.0), 0.1) == 18.0


def test_too_few_scores_for_the_level() -> None:
    with pytest.raises(FitError, match="at least 9 are needed"):
        conformal_quantile(np.arange(8.0), 0.1)


def test_the_miss_rate_of_a_tail_was_told_as_the_one_that_was_given() -> None:
    assert conformal_quantile(np.arange(1.0, 20.0), 0.1, tails=2) == 19.0
    with pytest.raises(FitError, match=r"miss rate of 0.1: at least 19 are needed"):
        conformal_quantile(np.arange(18.0), 0.1, tails=2)


def test_the_share_below_a_fitted_quantile_is_its_level(rng: np.random.Generator) -> None:
    x = np.column_stack([np.ones(5000), rng.standard_normal((5000, 3))])
    y = x @ [1.0, 2.0, -1.0, 0.5] + rng.standard_t(3, 5000)
    levels = np.array([0.05, 0.5, 0.95])
    fitted = x @ fit_quantiles(x, y, levels)
    # At the minimum of the smoothed loss the smoothed share is exact; the kernel moves it by far below this.
    np.testing.assert_allclose((y[:, None] <= fitted).mean(axis=0), levels, atol=0.004)


def test_quantiles_follow_a_scale_that_is_linear(rng: np.random.Generator) -> None:
    size = rng.uniform(0.5, 2.0, 40_000)
    x = np.column_stack([np.ones(40_000), size])
    slope = fit_quantiles(x, size * rng.standard_normal(40_000), np.array([0.05, 0.95]))
    # True coefficients 0 and -+1.645; the standard error of the slope is near 0.025.
    np.testing.assert_allclose(slope, [[0, 0], [-1.645, 1.645]], atol=0.1)


@pytest.mark.parametrize("slope", [0.0, 5.0])
def test_a_steep_line_does_not_widen_the_smoothing(slope: float) -> None:
    # The share of the population below the fitted quantile; the mean of twenty draws has a standard error of 0.2 %.
    shares = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        x = np.column_stack([np.ones(500), rng.standard_normal(500)])
        fitted = fit_quantiles(x, slope * x[:, 1] + rng.standard_normal(500), np.array([0.05]))[:, 0]
        shares.append(norm.cdf(x @ fitted - slope * x[:, 1]).mean())
    assert np.mean(shares) == pytest.approx(0.05, abs=0.007)


def test_every_quantile_of_rows_on_a_line_is_the_line() -> None:
    x = np.column_stack([np.ones(50), np.arange(50.0)])
    np.testing.assert_allclose(
        fit_quantiles(x, 1e-3 * x[:, 1], np.array([0.05, 0.9])), [[0, 0], [1e-3, 1e-3]], atol=1e-9
    )


def test_units_do_not_matter(rng: np.random.Generator) -> None:
    x = np.column_stack([np.ones(500), rng.standard_normal((500, 2))])
    y = x @ [0.1, 1.0, 2.0] + rng.standard_normal(500)
    level = np.array([0.9])
    microvolts = fit_quantiles(x * [1.0, 1e6, 1e-6], y * 1e-6, level)
    np.testing.assert_allclose(
        microvolts[:, 0], fit_quantiles(x, y, level)[:, 0] * 1e-6 / [1.0, 1e6, 1e-6], rtol=1e-3
    )


def test_fewer_rows_than_columns() -> None:
    with pytest.raises(FitError, match="cannot determine"):
        fit_quantiles(np.ones((3, 4)), np.ones(3), np.array([0.5]))
