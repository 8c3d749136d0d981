"""Fewer rows for fits: the charge is kept, and what is too short for a window stays as it is."""

import numpy as np
import pytest

from aesi.data.thinning import averaged_over
from aesi.records import Measurement


def record(n: int, dt_s: float = 0.1) -> Measurement:
    time = dt_s * np.arange(n)
    return Measurement(time, np.sin(time), 4.0 - 0.01 * time)


@pytest.mark.parametrize("rows", [1, 2, 5, 10])
def test_a_record_shorter_than_a_window_stays_as_it_is(rows):
    short = record(rows)
    assert averaged_over(short, step_s=1.0) is short


@pytest.mark.parametrize("rows", [11, 12, 205])
def test_windows_are_centred_averages_of_a_straight_line(rows):
    thin = averaged_over(record(rows), step_s=1.0)
    assert len(thin) < rows
    np.testing.assert_allclose(np.diff(thin.time_s)[1:], 1.0)
    np.testing.assert_allclose(
        thin.voltage_v, 4.0 - 0.01 * thin.time_s, rtol=1e-12
    )  # the mean of a line is its middle
