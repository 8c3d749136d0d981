"""What a record of the error tells of itself, in one place for all that ask."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.errors import InputError
from aesi.records import ErrorSeries
from aesi.records.horizons import in_whole_steps

N = 5
SERIES = ErrorSeries(
    "drive", 0.5, 0.5 * np.arange(N), np.zeros(N), np.zeros((N, 1)), np.full(N, 0.5), np.full(N, 3.7), ("I",)
)


@pytest.mark.parametrize(("horizon_s", "dt_s", "steps"), [(0.5, 0.5, 1), (10.0, 0.5, 20), (60.0, 0.1, 600)])
def test_a_horizon_is_so_many_samples(horizon_s, dt_s, steps):
    assert replace(SERIES, dt_s=dt_s).steps(horizon_s) == steps


@pytest.mark.parametrize("horizon_s", [0.1, 0.7])
def test_a_horizon_that_the_step_does_not_divide_was_rounded_to_one_that_it_does(horizon_s):
    with pytest.raises(InputError, match=rf"{horizon_s} s ahead is no whole number of steps of 0\.5 s"):
        SERIES.steps(horizon_s)


def test_the_tables_have_those_horizons_that_the_step_divides():
    assert [in_whole_steps(dt_s) for dt_s in (0.1, 2.0, 30.0, 7.0)] == [
        (1.0, 10.0, 60.0), (10.0, 60.0), (60.0,), (),
    ]  # fmt: skip


def test_a_temperature_that_was_not_measured_is_not_a_number():
    assert np.isnan(SERIES.degc_or_nan).tolist() == [True] * N
    warm = np.linspace(20.0, 24.0, N)
    np.testing.assert_array_equal(replace(SERIES, temperature_degc=warm).degc_or_nan, warm)


def test_a_piece_of_a_record_has_the_own_rows_of_its_steps_and_knows_the_one_before():
    time_s = np.array([0.0, 0.7, 1.4, 2.0])
    own = replace(
        SERIES,
        time_s=time_s,
        error_v=np.array([1.0, 2.0, 3.0, 4.0]),
        inputs=np.zeros((4, 1)),
        soc=np.full(4, 0.5),
        model_v=np.full(4, 3.7),
    )
    whole = replace(SERIES, own=own)  # stamps 0, 0.5, 1, 1.5 and 2
    np.testing.assert_array_equal(whole.with_known_error.error_v, [1.0, 1.0, 2.0, 3.0, 4.0])
    assert whole.take(slice(0, 5)).own is own
    for start in range(4):
        piece = whole.take(slice(start, 5))
        np.testing.assert_array_equal(piece.with_known_error.error_v, whole.with_known_error.error_v[start:])
    np.testing.assert_array_equal(whole.take(slice(2, 4)).own.time_s, [0.7, 1.4])
    np.testing.assert_array_equal(whole.take(slice(1, 2)).own.time_s, [0.0])  # none in its step
    assert SERIES.with_known_error is SERIES
