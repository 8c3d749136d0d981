"""Thinning and continuations."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.data.thinning import averaged_over
from aesi.physics import simulate
from aesi.records import Measurement
from aesi.tracer.case.checks import check_record
from aesi.tracer.case.records import leading_record, prepare_all, prepare_test
from aesi.tracer.case.thinned import thinned_record, thinned_together
from aesi.tracer.discovery import inverse_problem
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.report.outcome import outcomes


def measured(cell, time_s, current_a, soc0=0.8, **more):
    voltage = np.full(len(time_s), float(cell.rest_voltage_v(soc0)[0]))
    return Measurement(time_s, current_a, voltage, name="m", **more)


def test_thinning_keeps_charge_and_the_first_row(cell, rng):
    time = np.arange(0, 600, 0.1)
    current = 5 + np.cumsum(rng.normal(0, 0.1, len(time)))
    thin = averaged_over(measured(cell, time, current), 1.0)
    assert thin.time_s[0] == 0.0
    assert np.median(np.diff(thin.time_s)) == pytest.approx(1.0)
    whole = np.trapezoid(current, time)
    # windows are centred: the ends differ by half a second of a current that wanders by a tenth an instant
    assert np.trapezoid(thin.current_a, thin.time_s) == pytest.approx(whole, rel=5e-3)


def test_a_lag_of_half_a_second_is_seen_in_rows_of_a_second(cell, rng):
    time = np.arange(0.0, 600.0, 0.1)
    current = np.interp(time, np.arange(0.0, 601.0, 2.0), np.append(0.0, rng.normal(0.0, 10.0, 300)))
    true = simulate(cell, time, current, soc0=0.8).voltage_v
    late = Measurement(time, current, np.interp(time - 0.54, time, true), name="late")
    problem = inverse_problem(cell, [late], soc0=0.8)
    assert len(problem.measured) < len(time) / 10

    def left_v(lag_s):
        predicted = problem.predict({"soc0": {"0": 0.8}, "clock_skew": {"skew": 0.0, "lag_s": lag_s}})
        return float(np.sqrt(np.mean((problem.measured - predicted) ** 2)))

    assert left_v(0.54) < 0.25 * min(left_v(0.44), left_v(0.64))
    bare = problem.predict({"soc0": {"0": 0.8}})
    still = problem.predict({"soc0": {"0": 0.8}, "clock_skew": {"skew": 0.0, "lag_s": 0.0}})
    assert np.array_equal(still, bare)


def test_a_lag_of_less_than_a_row_is_seen_where_the_current_is_held(cell, rng):
    """The symptom: a held current at the instant of a reading does not change within a row, so that no slope told of a
    lag, and one of 2 s in a drive at 5 Hz stayed at 0."""
    time = np.arange(0.0, 600.0, 0.2)
    current = np.repeat(rng.normal(0.0, 10.0, 300), 10)
    true = simulate(cell, time, current, soc0=0.8, hold="backward").voltage_v
    late = Measurement(time, current, np.interp(time - 2.0, time, true), hold="backward", name="late")
    problem = inverse_problem(cell, [late], soc0=0.8)
    assert len(problem.measured) < len(time) / 4

    def predicted_v(lag_s):
        return problem.predict({"soc0": {"0": 0.8}, "clock_skew": {"skew": 0.0, "lag_s": lag_s}})

    slopes = [(predicted_v(lag_s) - predicted_v(0.0)) / lag_s for lag_s in (0.002, 0.02, 0.2)]
    for slope in slopes[:2]:
        np.testing.assert_allclose(slope[2:-2], slopes[2][2:-2], atol=0.1 * np.abs(slopes[2]).max())
    left_v = [np.sqrt(np.mean((problem.measured - predicted_v(lag_s)) ** 2)) for lag_s in (0.0, 1.0, 2.0)]
    assert left_v[2] < 0.1 * left_v[1] < 0.1 * left_v[0]


def test_a_thinned_record_of_the_declared_cell_leaves_nothing(cell, rng):
    time = np.arange(0.0, 900.0, 0.1)
    jumps = np.repeat(rng.normal(5.0, 60.0, 180), 50)
    drive = Measurement(time, jumps, simulate(cell, time, jumps, 0.8).voltage_v, name="drive")
    plain = averaged_over(drive, 1.0)
    record = prepare_all(cell, [drive], 0.8, 0.0)[0]
    assert len(record.thin) == len(plain) < len(time) / 9
    thin_v = simulate(cell, plain.time_s, plain.current_a, 0.8, hold="linear").voltage_v
    assert np.max(np.abs(plain.voltage_v - thin_v)) > 2e-3  # kinetics are no linear function of the current
    np.testing.assert_allclose(record.thin.voltage_v, thin_v, atol=1e-9)
    lost = np.abs(plain.voltage_v - thin_v)
    assert np.all(record.white_v >= 0.5 * lost)


def pulses(amplitude_a):
    """Ten-second pulses at 10 Hz, each followed by ten minutes of rest, logged once a minute."""
    one = np.concatenate([np.arange(0.1, 10.05, 0.1), np.arange(60.0, 610.0, 60.0)])
    time = np.concatenate([[0.0], *(one + 600.0 * k for k in range(8))])
    since = (time[1:] - 1e-6) % 600.0
    return time, np.concatenate([[0.0], np.where(since < 10.0, amplitude_a, 0.0)])


def test_pulses_logged_unevenly_keep_their_charge_and_their_height(cell):
    time, current = pulses(60.0)
    record = prepare_all(cell, [measured(cell, time, current)], None, 0.0)[0]
    thin = record.thin
    assert record.thin_hold == "backward"
    assert len(thin) < len(time) / 3
    charge = np.cumsum(thin.current_a[1:] * np.diff(thin.time_s))
    assert charge[-1] == pytest.approx(8 * 600.0)
    assert set(np.round(thin.current_a, 9)) == {0.0, 60.0}
    check_record(
        cell, replace(record, start=replace(record.start, soc=0.02))
    )  # straight lines would take out three times as much
    on = thin.time_s[thin.current_a > 0]
    assert np.count_nonzero(on < 1.05) >= 4, "rows are dense after a step"
    assert on[0] == pytest.approx(0.1)


def test_another_voltage_is_thinned_as_the_records_own(cell, rng):
    even = np.arange(0.0, 300.0, 0.1)
    drive = measured(cell, even, rng.normal(0.0, 5.0, len(even)))
    pulsed = measured(cell, *pulses(60.0))
    slow = measured(cell, np.arange(300.0), rng.normal(0.0, 5.0, 300))
    for data, kept in ((drive, 0.2), (pulsed, 0.4), (slow, 1.0)):
        data = replace(data, voltage_v=3.8 + 0.1 * rng.normal(size=len(data)))
        found = thinned_record(cell, data)
        assert len(found.thin) <= kept * len(data)
        np.testing.assert_array_equal(found.averaged(data.voltage_v), found.thin.voltage_v)


def test_records_that_are_too_many_rows_together_are_thinned_further(cell, rng):
    time = np.arange(7000.0)
    drives = [measured(cell, time, rng.normal(0.0, 5.0, len(time))) for _ in range(2)]
    assert [len(r.thin) for r in thinned_together(cell, drives[:1])] == [7000]
    assert [len(r.thin) for r in thinned_together(cell, drives)] == [3500, 3500]


def test_a_long_discharge_needs_few_rows(cell):
    time = np.arange(0.0, 36_000.0)
    record = prepare_all(cell, [measured(cell, time, np.where(time > 10, 3.0, 0.0))], None, 0.0)[0]
    assert 500 < len(record.thin) < 800
    assert np.diff(record.thin.time_s).max() < 100.0


def test_averages_are_not_noisier_than_the_rows_of_a_drive_that_never_rests(cell, rng):
    time = np.arange(0.0, 900.0, 0.1)
    current = 10.0 + np.convolve(rng.normal(0.0, 30.0, len(time)), np.ones(15) / 15, mode="same")
    voltage = simulate(cell, time, current, soc0=0.8).voltage_v + 1e-3 * rng.normal(size=len(time))
    record = prepare_all(cell, [Measurement(time, current, voltage, name="restless")], 0.8, 0.0)[0]
    assert record.noise_full_v == pytest.approx(1e-3, rel=0.05)
    assert 1e-3 / np.sqrt(10.0) < record.noise_v < record.noise_full_v


def test_the_resolution_of_a_voltage_was_averaged_away_as_white_noise(cell):
    time = np.arange(6000.0)
    current = np.where((time > 600) & (time < 3000), 3.0, 0.0)
    voltage = simulate(cell, time, current, soc0=0.8).voltage_v
    data = Measurement(time, current, 5e-3 * np.round(voltage / 5e-3), name="coarse")
    record = prepare_all(cell, [data], 0.8, 0.0)[0]
    assert len(record.thin) < 1000
    assert record.white_v.min() > 0.99 * 5e-3 / np.sqrt(12.0)
    last = (record.thin.time_s > 3000.0) & (np.abs(record.thin.voltage_v - data.voltage_v[-1]) < 1e-3)
    assert np.count_nonzero(last) > 20  # rows of a rest that were rounded to one value
    together = np.sum(record.equivalent_white_v[last] ** -2.0) ** -0.5
    assert together > 0.9 * 5e-3 / np.sqrt(12.0)


@pytest.mark.parametrize("degc", [None, 20.0])
def test_a_continuation_is_judged_only_after_what_was_seen(cell, degc):
    time = np.arange(900.0)
    kelvin = None if degc is None else degc + 0.01 * time
    whole = measured(cell, time, np.where(time < 30, 0.0, 5.0), temperature_degc=kelvin)
    seen, rest = whole.between(0, 600), whole.between(600, 900)
    for test in (whole, rest):
        record = prepare_test(cell, test, [seen], None)
        assert record.lead_rows == 600
        assert len(record.data) == 900
        assert record.continues == 0
        assert (record.data.temperature_degc is None) == (degc is None)
    column = np.full(300, 20.0) if degc is None else None
    apart = prepare_test(cell, replace(rest, temperature_degc=column), [seen], 0.9)
    assert (apart.lead_rows, apart.continues) == (0, None)  # what was measured in one of them is not left out
    other = replace(rest, time_s=rest.time_s + 5000.0, current_a=np.zeros(300))
    stranger = prepare_test(cell, other, [seen], None)
    assert (stranger.lead_rows, stranger.continues) == (0, None)


def test_an_error_that_only_another_start_explains_is_forgiven_where_the_start_is_not_that_of_a_fit(cell):
    time = np.arange(900.0)
    whole = measured(cell, time, np.where(time < 30, 0.0, 5.0))
    seen = whole.between(0, 600)
    problem = inverse_problem(cell, [seen])
    states = dict.fromkeys(("before", "recalibrated", "after"), ModelState(problem))
    tests = [prepare_test(cell, whole, given, None) for given in ([seen], [])]
    continued, apart = outcomes(problem.records, states, tests, np.random.default_rng(0))[-2:]
    assert continued.start_slope_v is None
    assert np.abs(apart.start_slope_v).max() > 1e-4


def test_a_continuation_was_said_to_start_at_the_first_row_of_what_it_continues(cell):
    time = np.arange(900.0)
    whole = measured(cell, time, np.full(900, 5.0))
    seen = replace(whole.between(0, 600), name="first")
    for test in (replace(whole, name="all"), replace(whole.between(600, 900), name="rest")):
        told = prepare_test(cell, test, [seen], None).notes
        assert told[0] == (
            f"{test.name} is judged from 600 s on, after the rows of first that were fitted; the model is run from 0 s "
            "to get there."
        )
        assert not any("starts under" in note for note in told)
    alone = prepare_test(cell, replace(whole, name="all"), [], None).notes
    assert any("all starts under 5 A" in note for note in alone)


def test_of_two_fitted_records_that_lead_to_a_test_the_one_it_begins_with_was_judged(cell):
    time = np.arange(900.0)
    whole = measured(cell, time, np.where(time < 30, 0.0, 5.0))
    first, second = whole.between(0, 300), whole.between(300, 600)
    assert (
        leading_record(whole.between(300, 900), [first, second])[0] == 1
    )  # which continues the first one, too
    assert leading_record(whole, [first, whole.between(0, 600)])[0] == 1
    index, data = leading_record(whole.between(600, 900), [first, second])
    assert (index, data.time_s[0]) == (1, 300.0)


def test_a_full_charge_left_out_begins_where_the_fitted_full_charges_do():
    records = [
        SimpleNamespace(start=SimpleNamespace(basis=b)) for b in ("full charge", "rest", "full charge")
    ]
    problem = SimpleNamespace(
        records=records, active=lambda values, good: (), run=lambda data, soc0, *_, share: soc0
    )
    left_out = SimpleNamespace(
        continues=None, data=None, hold="linear", good=False, soc0=1.0, start=records[0].start
    )
    fitted = ModelState(problem, {"soc0": {"0": 0.98, "1": 0.5, "2": 1.0}})
    assert fitted.simulated(left_out, None, thin=False) == pytest.approx(0.99)
