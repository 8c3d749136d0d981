"""Fewer or even rows: charge kept, averages where there is something to average."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aesi.data.resample import (
    BetweenStamps,
    decimate,
    is_sparse,
    off_rows,
    to_even,
)
from aesi.errors import DataError, InputError
from aesi.records import Measurement
from aesi.records.steps import after_gap


def measurement(time, current, voltage=None):
    voltage = 3.7 - 0.01 * np.asarray(current) if voltage is None else voltage
    return Measurement(np.asarray(time, float), np.asarray(current, float), np.asarray(voltage, float))


def held_charge(m):
    return np.sum(m.current_a[1:] * np.diff(m.time_s))


def test_hand_worked_averages():
    # Rows at 0, 1, 3 s hold 0, 2, 5 A over the time before them: 2 C to 1 s, 10 C more to 3 s.
    intervals = BetweenStamps(np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.5, 3.0]))
    np.testing.assert_allclose(intervals.held(np.array([0.0, 2.0, 5.0])), [0.0, 4.5 / 1.5, 7.5 / 1.5])
    # Straight lines 0 -> 2 -> 5 have areas 1 + 0.5 (2 + 2.75) / 2 = 2.1875 and 5.8125.
    np.testing.assert_allclose(intervals.linear(np.array([0.0, 2.0, 5.0])), [0.0, 2.1875 / 1.5, 5.8125 / 1.5])


@given(
    steps=st.lists(st.floats(0.01, 100.0), min_size=2, max_size=60),
    share=st.floats(0.01, 1.0),
    seed=st.integers(0, 2**32 - 1),
)
def test_the_charge_up_to_the_last_stamp_is_kept(steps, share, seed):
    time = np.concatenate([[0.0], np.cumsum(steps)])
    current = np.random.default_rng(seed).uniform(-10, 10, len(time))
    even = to_even(measurement(time, current), share * time[-1])
    charge = np.interp(even.time_s[-1], time, np.concatenate([[0], np.cumsum(current[1:] * np.diff(time))]))
    assert held_charge(even) == pytest.approx(charge, rel=1e-9, abs=1e-9 * time[-1])


def test_rows_that_are_even_stay_as_they_are():
    record = measurement(np.arange(10.0), np.ones(10))
    assert to_even(record, 1.0) is record


def test_a_straight_voltage_between_sparse_rows_stays_straight():
    record = measurement([0.0, 60.0, 120.0], [1.0, 1.0, 1.0], [4.0, 3.9, 3.8])
    even = to_even(record, 1.0)
    np.testing.assert_allclose(even.voltage_v, 4.0 - 0.1 * even.time_s / 60)
    assert any("Resampled" in note for note in even.notes)


def test_temperature_goes_along():
    record = Measurement(np.arange(0, 10, 0.1), np.ones(100), np.full(100, 3.7), np.full(100, 25.0))
    np.testing.assert_allclose(to_even(record, 1.0).temperature_degc, 25.0)


@pytest.mark.parametrize("step", [0.0, -1.0, 100.0, np.nan, 1e-9])
def test_impossible_steps_are_refused(step):
    with pytest.raises(DataError):
        to_even(measurement(np.arange(10.0), np.ones(10)), step)


def test_a_record_without_rows_ended_in_an_index_error():
    with pytest.raises(DataError, match="has no row to resample"):
        to_even(Measurement([], [], []), 1.0)


def test_a_step_longer_than_its_record_was_answered_by_a_longer_record_alone():
    record = Measurement(np.arange(20.0), np.zeros(20), np.full(20, 3.7), name="short")
    with pytest.raises(
        DataError, match=r"lasts 19 s, .* a step of 5000 s; give a shorter step, or a longer record"
    ):
        to_even(record, 5000.0)


def test_a_step_in_words_ended_in_a_type_error():
    with pytest.raises(DataError, match="a step of '1' s is not possible"):
        to_even(measurement(np.arange(10.0), np.ones(10)), "1")


@pytest.mark.parametrize("most", [2.5, "10", True])
def test_decimation_to_no_whole_number_of_rows_is_refused(most):
    with pytest.raises(InputError, match=r"max_rows = .* is not a whole number"):
        decimate(measurement(np.arange(10.0), np.ones(10)), most)


@given(n=st.integers(3, 400), most=st.integers(2, 50))
def test_decimation_is_never_longer_than_asked(n, most):
    record = measurement(np.arange(float(n)), np.sin(np.arange(n)))
    few = decimate(record, most)
    assert len(few) <= max(most, 2)
    assert (few is record) == (n <= most)
    assert any("Decimated" in note for note in few.notes) == (n > most)


def test_decimation_to_one_row_is_refused():
    with pytest.raises(DataError):
        decimate(measurement(np.arange(10.0), np.ones(10)), 1)


def test_rows_behind_the_last_whole_run_are_said_to_be_left_out():
    few = decimate(measurement(np.arange(600.0), np.ones(600)), 10)
    assert few.time_s[-1] == 536.0
    assert few.notes[-1].endswith("the last 63 rows, no whole run, were left out.")
    one = decimate(measurement(np.arange(11.0), np.ones(11)), 5)
    assert one.notes[-1].endswith("the last row, no whole run, was left out.")
    whole = decimate(measurement(np.arange(601.0), np.ones(601)), 11)
    assert whole.time_s[-1] == 600.0
    assert "left out" not in whole.notes[-1]


def test_a_current_that_runs_straight_was_resampled_as_a_staircase():
    time = np.arange(0.0, 20.0, 2.0)
    record = measurement(time, 3.0 * time)
    straight, held = to_even(record, 1.0, "linear"), to_even(record, 1.0)
    np.testing.assert_allclose(straight.current_a, 3.0 * straight.time_s)
    np.testing.assert_allclose(held.current_a[1:3], 6.0)  # A, of the row that ends the first interval
    assert straight.notes[-1].endswith("every 1 s: current and voltage interpolated between rows.")
    assert held.notes[-1].endswith("current averaged over each interval, voltage interpolated between rows.")
    dense = to_even(measurement(np.arange(0.0, 10.5, 0.5), np.arange(0.0, 10.5, 0.5)), 1.0, "linear")
    np.testing.assert_allclose(dense.current_a[1:], dense.time_s[1:] - 0.5)  # averages of the second before


RESTS = np.cumsum(np.repeat([0.1, 4.0], [80, 20]))  # pulses, then a rest with few rows
EVEN = np.arange(101.0)


@pytest.mark.parametrize(("time", "hold"), [(RESTS, "linear"), (RESTS, None), (10.0 * EVEN, None)])
def test_a_record_of_uneven_or_held_rows_lost_charge_where_it_was_thinned(time, hold):
    record = measurement(time, 1.0 + time**2).held(hold)
    few = decimate(record, 11)
    stamps = np.searchsorted(time, few.time_s)
    taken_ah, given_ah = (m.discharged_ah(m.hold_taken) for m in (few, record))
    np.testing.assert_allclose(taken_ah, given_ah[stamps], rtol=1e-12)
    assert few.hold == "backward"
    assert "constant from here on" in few.notes[0]


@pytest.mark.parametrize("hold", ["linear", None])
def test_straight_lines_between_even_rows_stay_straight_half_a_run_late(hold):
    """The symptom: with the current held, a lag of less than a run did not show between the channels."""
    record = measurement(EVEN, 3.0 * EVEN).held(hold)
    few = decimate(record, 26)
    assert few.hold == hold
    assert few.hold_taken == "linear"
    np.testing.assert_allclose(few.current_a[1:], 3.0 * (few.time_s[1:] - 2.0))
    assert "constant from here on" not in few.notes[0]
    late = replace(record, voltage_v=np.interp(EVEN - 1.0, EVEN, np.sin(0.1 * EVEN)))
    early = replace(record, voltage_v=np.sin(0.1 * EVEN))
    lagged = decimate(late, 26).voltage_v
    straight = np.interp(few.time_s - 1.0, few.time_s, decimate(early, 26).voltage_v)
    np.testing.assert_allclose(lagged[2:], straight[2:], atol=0.02)


def test_a_row_is_after_a_gap_where_none_is_a_step_before_it():
    time_s = np.array([0.0, 1.0, 2.4, 5.0, 8.0])
    np.testing.assert_array_equal(after_gap(time_s, 1.0), [False, False, False, True, True])
    current_a = np.array([1.0, 1.0, 1.0, 1.0, 1.0])
    assert is_sparse(time_s, current_a, 1.0)
    assert not is_sparse(time_s[:3], current_a[:3], 1.0)


def test_a_rest_that_is_written_seldom_was_counted_against_a_dense_drive():
    time_s = np.r_[np.arange(1000.0), 1000.0 + 60.0 * np.arange(1200)]
    current_a = np.r_[np.full(1000, 3.0), np.zeros(1200)]
    assert not is_sparse(time_s, current_a, 1.0)
    assert is_sparse(time_s, np.full_like(current_a, 3.0), 1.0)
    assert is_sparse(np.cumsum(np.tile([0.1, 0.1, 60.0], 100)), np.ones(300), 1.0)  # a third of its rows


def test_how_far_rows_are_off_the_stamps_of_a_step():
    stamps_s = np.arange(100.0)
    assert off_rows(stamps_s, stamps_s) == 0.0
    # Of rows at 0, 1.25, 2.5, 3.75 and 5 the nearest is 0, 0.25, 0.5, 0.5 and 0.25 off stamps at 0 to 4, then again.
    assert off_rows(1.25 * stamps_s, stamps_s) == pytest.approx(0.3)
    assert off_rows(stamps_s + 0.01 * np.sin(stamps_s), stamps_s) < 0.01
    assert off_rows(stamps_s / 8.0, stamps_s[:12]) == 0.0
