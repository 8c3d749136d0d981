"""What an ensemble says of its members, in numbers that can be worked by hand."""

import numpy as np

from aesi.sparse.ensemble import combine
from aesi.sparse.stridge import STRidge


def test_members_are_summed_up_by_mean_share_and_the_middle_nine_tenths():
    first = np.linspace(0.0, 1.0, 101)  # zero in one of them
    second = np.where(np.arange(101) < 40, 2.0, 0.0)
    theta = np.column_stack([np.arange(5.0), np.ones(5)])
    factor = np.column_stack([theta, 3.0 * theta[:, 0]])
    found = combine(np.column_stack([first, second]), factor, 0.5, STRidge(0.0, 0.0))
    np.testing.assert_allclose(found.bagging, [0.5, 80.0 / 101.0])
    np.testing.assert_allclose(found.inclusion, [100.0 / 101.0, 40.0 / 101.0])
    np.testing.assert_allclose(found.low, [0.05, 0.0])
    np.testing.assert_allclose(found.high, [0.95, 2.0])
    np.testing.assert_allclose(found.stability, [3.0, 0.0], atol=1e-12)
