"""The rows of a record that a calibration leaves out: how far off the written file is there."""

import re

import numpy as np
import pytest

from aesi.calibration import Conditions, calibrate
from aesi.physics import initial_state, simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement

HALF_GAP_V = 0.02


def cycle(cell, stop_s=np.inf) -> Measurement:
    """A discharge at 1C, a rest and a charge at C/2 of a cell with two branches of the open-circuit voltage."""
    time = np.arange(0.0, 7200.0, 10.0)
    time = time[time <= stop_s]
    current = np.select([time <= 100.0, time <= 3000.0, time <= 3600.0], [0.0, 5.0, 0.0], -2.5)
    branches = [CATALOGUE["ocv_hysteresis"].activate(magnitude_v=HALF_GAP_V, start=0.0)]
    voltage = simulate(cell, time, current, 0.95, branches, 25.0, "backward").voltage_v
    return Measurement(time, current, voltage, np.full(len(time), 25.0), "cycle")


def test_the_error_on_a_charge_that_was_not_fitted_is_told(start):
    whole = cycle(start)
    found = calibrate(start, [whole], Conditions(same_cell=True), evaluations=5)
    assert found.model.records[0].data.time_s[-1] < whole.time_s[-1]
    (told,) = [note for note in found.notes if "rows under current" in note]
    soc = initial_state(found.cell, whole, hold=whole.hold_taken).soc
    run = simulate(found.cell, whole.time_s, whole.current_a, soc, (), whole.temperature_degc, "backward")
    left_out = (whole.voltage_v - run.voltage_v)[whole.current_a < 0.0]
    rms_mv, mean_mv = (float(one) for one in re.findall(r"([+-]?\d+\.\d+) mV", told))
    assert rms_mv == pytest.approx(1e3 * np.sqrt(np.mean(left_out**2)), abs=0.01)
    assert mean_mv == pytest.approx(1e3 * left_out.mean(), abs=0.01)
    assert HALF_GAP_V < 1e-3 * mean_mv < 3.0 * HALF_GAP_V  # the fit to the discharge is on its branch


def test_nothing_is_told_of_a_record_that_is_fitted_whole(start):
    found = calibrate(start, [cycle(start, 3600.0)], Conditions(same_cell=True), evaluations=1)
    assert not [note for note in found.notes if "rows under current" in note]
