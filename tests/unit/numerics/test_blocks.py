"""Means of consecutive blocks of rows."""

import numpy as np

from aesi.numerics.blocks import block_means


def test_each_block_ends_where_the_next_one_starts():
    values, starts = np.array([1.0, 3.0, 5.0, 2.0, 4.0, 9.0]), np.array([0, 2, 3])
    np.testing.assert_allclose(block_means(values, starts), [2.0, 5.0, 5.0])
    both = np.column_stack([values, -2.0 * values])
    np.testing.assert_allclose(block_means(both, starts), [[2.0, -4.0], [5.0, -10.0], [5.0, -10.0]])
