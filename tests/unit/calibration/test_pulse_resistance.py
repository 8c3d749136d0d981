"""The resistance that a calibrated cell predicts where no record was, with its intervals."""

import numpy as np
import pytest

from aesi.calibration import calibrate
from aesi.calibration.uncertainty.pulse_resistance import PULSE_S, log_resistance, pulse_resistance
from aesi.physics import simulate

DEGC, SOC = (-10.0, 0.0, 25.0), (0.8, 0.5)


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
