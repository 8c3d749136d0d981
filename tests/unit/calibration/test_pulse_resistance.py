"""The resistance that a calibrated cell predicts where no record was, with its intervals."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.calibration import calibrate
from aesi.calibration.uncertainty.pulse_resistance import (
    PULSE_S,
    late_pulses,
    log_resistance,
    measured_pulses,
    pulse_resistance,
)
from aesi.physics import simulate
from aesi.records import Measurement

DEGC, SOC = (-10.0, 0.0, 25.0), (0.8, 0.5)


def pulse_test(cell, hold="backward"):
    """An hour from 60 % charge, a row a second."""
    time_s = np.arange(0.0, 3600.0)
    current_a = np.zeros(len(time_s))
    for start, seconds, c_rate in (
        (300, 30, 1.0),
        (1000, 5, 1.0),
        (1500, 30, 2.0),
        (2000, 30, -1.0),
        (2500, 12, 1.0),
    ):
        current_a[start : start + seconds] = c_rate * cell.nominal_capacity_ah
    voltage_v = simulate(cell, time_s, current_a, 0.6, (), 25.0, hold).voltage_v
    return Measurement(time_s, current_a, voltage_v, hold=hold)


@pytest.fixture(scope="module")
def at_25(start, records):
    return pulse_resistance(calibrate(start, records[:1]), DEGC, SOC)


def test_it_is_the_drop_of_a_pulse_over_its_current(truth):
    (got,) = np.exp(log_resistance(truth, np.array([0.0]), np.array([0.5])))
    time_s = np.linspace(0.0, PULSE_S[-1], 2001)
    current_a = np.full(len(time_s), truth.nominal_capacity_ah)
    current_a[0] = 0.0
    voltage_v = simulate(truth, time_s, current_a, 0.5, (), 0.0, "backward").voltage_v
    assert got == pytest.approx([(voltage_v[0] - voltage_v[-1]) / truth.nominal_capacity_ah], rel=0.01)


def test_it_holds_the_true_one_and_widens_away_from_the_records(at_25, truth):
    true_ohm = np.exp(log_resistance(truth, np.array(DEGC), np.array(SOC)))
    assert np.all((at_25.low_ohm <= true_ohm) & (true_ohm <= at_25.high_ohm))
    width = at_25.high_ohm / at_25.low_ohm
    assert np.all(width[0] > width[1])
    assert np.all(width[1] > width[2])


def test_a_record_in_the_cold_tells_the_resistance_there(at_25, start, records):
    both = pulse_resistance(calibrate(start, records), DEGC, SOC)
    assert np.all(both.high_ohm[:2] / both.low_ohm[:2] < 0.7 * (at_25.high_ohm / at_25.low_ohm)[:2])


def test_a_state_that_cannot_give_the_pulse_has_no_resistance(truth):
    got = log_resistance(truth, np.array([-20.0]), np.array([0.5, 0.0]))
    assert list(np.isfinite(got[0])) == [True, False]


@pytest.mark.parametrize("hold", ["backward", "linear"])
def test_the_pulses_of_a_record_show_the_resistance_of_its_cell(truth, hold):
    """Two at 1C; one that is too short, one at 2C and a charge do not count."""
    record = pulse_test(truth, hold)
    soc, ohm = measured_pulses(truth, record, 0.6)
    charged_ah = (30.0 + 5.0 + 60.0 - 30.0) / 3600.0 * truth.nominal_capacity_ah
    assert soc == pytest.approx([0.6, 0.6 - charged_ah / truth.capacity_ah], abs=3e-4)
    assert ohm == pytest.approx(np.exp(log_resistance(truth, np.array([25.0]), soc))[0], rel=0.008)


def test_the_pulses_of_an_aged_cell_are_of_its_nominal_capacity(truth):
    """With a rate of what it has left, its 1C pulses were of 1.16C and did not count."""
    aged, share = truth.with_material(0.86), 0.86
    soc, ohm = measured_pulses(truth, pulse_test(aged), 0.6, share)
    drawn_ah = (30.0 + 5.0 + 60.0 - 30.0) / 3600.0 * truth.nominal_capacity_ah
    assert soc == pytest.approx([0.6, 0.6 - drawn_ah / (share * truth.capacity_ah)], abs=3e-4)
    assert ohm == pytest.approx(np.exp(log_resistance(aged, np.array([25.0]), soc))[0], rel=0.008)


def test_a_pulse_that_begins_between_two_rows_seconds_apart_was_read_too_low(truth, start, records):
    """The rest is last seen 4 s before the pulse begins, and 6 s of this were read as its 10 s."""
    dense = pulse_test(truth)
    kept = np.arange(len(dense.time_s)) % 5 == 1
    sparse = Measurement(
        dense.time_s[kept], dense.current_a[kept], dense.voltage_v[kept], name="sparse", hold="backward"
    )
    assert [len(found) for found in measured_pulses(truth, sparse, 0.6)] == [0, 0]
    assert (late_pulses(truth, sparse), late_pulses(truth, dense)) == (2, 0)
    got = pulse_resistance(calibrate(start, [records[0], sparse]), DEGC, SOC)
    assert got.left_out == {"sparse": 2}
    assert (got.measured, got.model_error) == ((), None)


def test_a_record_without_pulses_shows_none(truth):
    time_s = np.arange(0.0, 600.0)
    flat = Measurement(time_s, np.zeros(600), np.full(600, 3.7))
    assert [len(found) for found in measured_pulses(truth, flat, 0.5)] == [0, 0]


def test_intervals_are_as_wide_as_the_file_is_off_at_measured_pulses(at_25, start, records, truth):
    """The second pulse of a test shows 3 mohm that no other record does, so that no parameter can explain it."""
    test = pulse_test(truth)
    lower_v = np.where((test.time_s >= 2500.0) & (test.current_a > 0.0), 3e-3 * test.current_a, 0.0)
    odd = replace(test, voltage_v=test.voltage_v - lower_v, name="odd")
    got = pulse_resistance(calibrate(start, [records[0], odd]), DEGC, SOC)
    assert [pulse.record for pulse in got.measured] == ["odd", "odd"]
    first, second = got.measured
    assert second.ohm - first.ohm == pytest.approx(3e-3, rel=0.1)
    least = abs(np.log(second.ohm / first.ohm)) / 2.0  # the predicted two are equal to within a percent
    assert least - 0.01 <= got.model_error <= 2.0 * least
    assert np.all(np.log(got.high_ohm / got.ohm) >= 1.96 * got.model_error)
    assert at_25.measured == ()
    assert at_25.model_error is None
