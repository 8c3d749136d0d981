"""What a record of the error tells of itself, in one place for all that ask."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.records import ErrorSeries

N = 5
SERIES = ErrorSeries(
    "drive", 0.5, 0.5 * np.arange(N), np.zeros(N), np.zeros((N, 1)), np.full(N, 0.5), np.full(N, 3.7), ("I",)
)


@pytest.mark.parametrize(("horizon_s", "steps"), [(0.1, 1), (0.5, 1), (10.0, 20)])
def test_a_horizon_is_so_many_samples_and_at_least_one(horizon_s, steps):
    assert SERIES.steps(horizon_s) == steps


def test_a_temperature_that_was_not_measured_is_not_a_number():
    assert np.isnan(SERIES.degc_or_nan).tolist() == [True] * N
    warm = np.linspace(20.0, 24.0, N)
    np.testing.assert_array_equal(replace(SERIES, temperature_degc=warm).degc_or_nan, warm)
