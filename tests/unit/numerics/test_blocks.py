"""Means of consecutive blocks of rows, and intervals by resamples of them."""

import numpy as np

from aesi.numerics.blocks import block_means, resampled_interval


def test_each_block_ends_where_the_next_one_starts():
    values, starts = np.array([1.0, 3.0, 5.0, 2.0, 4.0, 9.0]), np.array([0, 2, 3])
    np.testing.assert_allclose(block_means(values, starts), [2.0, 5.0, 5.0])
    both = np.column_stack([values, -2.0 * values])
    np.testing.assert_allclose(block_means(both, starts), [[2.0, -4.0], [5.0, -10.0], [5.0, -10.0]])


def test_an_interval_by_few_blocks_is_about_that_of_student():
    # Of eight normal values with their own standard deviation s the interval of the mean is t s / sqrt(8).
    rng = np.random.default_rng(0)
    values = np.array([-1.4, -0.9, -0.5, -0.2, 0.2, 0.5, 0.9, 1.4])
    means = values[rng.integers(8, size=(20_000, 8))].mean(axis=1)
    low, high = resampled_interval(means, 8, 0.9)
    half = 1.895 * values.std(ddof=1) / np.sqrt(8.0)
    np.testing.assert_allclose([low, high], [-half, half], rtol=0.05)
