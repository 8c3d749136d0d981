"""A record whose voltage contradicts the temperature that it is fitted at: a fit makes up for that without a trace."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.calibration import Conditions, calibrate
from aesi.calibration.fit import problem
from aesi.calibration.records.temperature import against_temperature
from aesi.physics import simulate


@pytest.fixture(scope="module")
def warm(start, records):
    """The current of a record at 40 degC, with the voltage of the start file."""
    degc = np.full(len(records[0]), 40.0)
    run = simulate(start, records[0].time_s, records[0].current_a, 1.0, (), degc, "backward")
    return replace(records[0], voltage_v=run.voltage_v, temperature_degc=degc, name="warm")


def told(start, record):
    model, _ = problem(start, [record], Conditions())
    return against_temperature(start, model.records, "espm")


def test_a_dead_column_is_told_before_the_fit_makes_up_for_it(start, warm):
    (sentence,) = told(start, replace(warm, temperature_degc=np.zeros(len(warm))))
    assert sentence.startswith("warm: its voltage contradicts its temperature. At 0 degC")
    assert "at 40 degC" in sentence
    assert told(start, warm) == ()
    assert told(start, replace(warm, temperature_degc=None)) == ()


def test_a_calibration_warns_of_it(start, warm):
    dead = replace(warm, temperature_degc=np.zeros(len(warm)))
    found = calibrate(start, [dead], evaluations=1)
    assert found.warnings[0] == told(start, dead)[0]
