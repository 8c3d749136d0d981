"""Error maps and profiles over the operating range."""

import numpy as np
import pytest

from aesi.pipeline.report.arrays.binning import LEAST_SAMPLES, error_map, profile


def test_map_puts_the_mean_where_the_samples_are():
    current = np.repeat([-10.0, 10.0], 50)
    soc = np.repeat([0.2, 0.8], 50)
    error = np.repeat([1.0, -3.0], 50)
    binned = error_map(current, soc, error, bins=2)
    assert binned.mean[0, 0] == pytest.approx(1.0)
    assert binned.mean[1, 1] == pytest.approx(-3.0)
    assert np.isnan(binned.mean[0, 1])
    assert binned.count.sum() == 100


def test_bins_with_few_samples_stay_blank():
    few = LEAST_SAMPLES - 1
    binned = error_map(np.r_[np.zeros(50), np.ones(few)], np.linspace(0, 1, 50 + few), np.ones(50 + few), 2)
    assert np.isnan(binned.mean[:, 1]).all()


def test_a_constant_current_makes_one_column():
    binned = error_map(np.full(100, 3.0), np.linspace(0, 1, 100), np.ones(100), bins=4)
    assert np.isfinite(binned.mean).any(axis=0).sum() == 1


def test_rows_that_are_not_finite_are_left_out():
    error = np.ones(100)
    error[:10] = np.nan
    binned = error_map(np.zeros(100), np.zeros(100), error, bins=2)
    assert binned.count.sum() == 90
    assert np.nanmax(binned.mean) == 1.0


def test_profile_follows_the_median():
    x = np.repeat(np.arange(10.0), 100)
    y = 2 * x + np.tile(np.linspace(-1, 1, 100), 10)
    binned = profile(x, y, bins=10)
    np.testing.assert_allclose(binned.median, 2 * np.arange(10.0), atol=1e-9)
    np.testing.assert_allclose(binned.high - binned.low, 1.0, atol=0.02)
