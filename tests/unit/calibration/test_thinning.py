"""Fewer rows for fits: charge is kept, pulses stay pulses."""

import numpy as np
import pytest

from aesi.calibration.model import leniency, saturated
from aesi.calibration.thinning import thinned
from aesi.records import Measurement


def pulses(step_s: float = 0.1) -> Measurement:
    time = np.arange(0.0, 4000.0, step_s)
    current = np.where((time % 800 > 400) & (time % 800 < 430), 5.0, 0.0)
    return Measurement(time, current, 3.7 - 0.03 * current, np.full(len(time), 25.0))


def charge_ah(data: Measurement, hold: str) -> float:
    mean = data.current_a[1:] if hold == "backward" else 0.5 * (data.current_a[1:] + data.current_a[:-1])
    return float(np.sum(mean * np.diff(data.time_s))) / 3600.0


def test_a_pulse_test_keeps_its_charge_and_its_pulses_in_a_tenth_of_the_rows():
    data = pulses()
    thin = thinned(data, 3.0)
    assert len(thin.data) < 0.1 * len(data)
    assert charge_ah(thin.data, thin.hold) == pytest.approx(charge_ah(data, "backward"), rel=1e-3)
    assert thin.data.current_a.max() == pytest.approx(5.0, abs=1e-6)


def test_a_drive_is_averaged_to_its_window_and_keeps_its_charge():
    time = np.arange(0.0, 600.0, 0.1)
    current = 3.0 * np.sin(time / 3.0) + 1.0
    thin = thinned(Measurement(time, current, 3.7 - 0.02 * current), 3.0)
    assert np.median(np.diff(thin.data.time_s)) == pytest.approx(1.0, abs=0.05)
    assert charge_ah(thin.data, thin.hold) == pytest.approx(
        charge_ah(Measurement(time, current, current), "linear"), rel=0.01
    )


def test_a_row_in_the_middle_of_a_step_is_not_believed_where_another_follows_soon():
    thin = thinned(pulses(), 3.0)
    after = np.flatnonzero(np.abs(np.diff(thin.data.current_a)) > 1.0) + 1
    assert not thin.trusted[after].any()
    assert thin.trusted.mean() > 0.9


def test_the_loss_is_square_when_small_and_linear_when_large():
    small, large = np.array([1e-3]), np.array([0.3, 0.6])
    assert saturated(small) == pytest.approx(small, rel=2e-3)
    assert np.diff(saturated(large) ** 2) == pytest.approx(2.0 * 0.015 * 0.3, rel=0.01)
    error = np.array([-0.2, -0.01, 0.003, 0.05])
    slope = (saturated(error + 1e-7) - saturated(error - 1e-7)) / 2e-7
    assert leniency(error) == pytest.approx(slope, rel=1e-5)
