"""A record whose voltage contradicts the temperature that it is fitted at: a fit makes up for that without a trace."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.calibration import Conditions, calibrate
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.temperature import against_temperature
from aesi.physics import simulate
from aesi.records import Measurement


@pytest.fixture(scope="module")
def warm(start, records):
    """The current of a record at 40 degC, with the voltage of the start file."""
    degc = np.full(len(records[0]), 40.0)
    run = simulate(start, records[0].time_s, records[0].current_a, 1.0, (), degc, "backward")
    return replace(records[0], voltage_v=run.voltage_v, temperature_degc=degc, name="warm")


def told(start, record):
    model, _ = prepared_model(start, [record], Conditions())
    return against_temperature(start, model.records, "espm")


def test_a_dead_column_is_told_before_the_fit_makes_up_for_it(start, warm):
    (sentence,) = told(start, replace(warm, temperature_degc=np.zeros(len(warm))))
    assert sentence.startswith("warm: its voltage contradicts its temperature. The error of ")
    assert "at 40 degC" in sentence
    assert told(start, warm) == ()
    assert told(start, replace(warm, temperature_degc=None)) == ()


def test_a_calibration_warns_of_it(start, warm):
    dead = replace(warm, temperature_degc=np.zeros(len(warm)))
    found = calibrate(start, [dead], evaluations=1)
    assert found.warnings[0] == told(start, dead)[0]
    assert "or the start file is of a cell with other kinetics" in found.warnings[0]


def test_of_a_temperature_that_was_given_the_advice_was_about_a_column(start, warm):
    untold = replace(warm, temperature_degc=None)
    found = calibrate(
        start, [untold], Conditions(temperatures_degc={"warm": 0.0}, same_cell=True), evaluations=1
    )
    assert "its voltage contradicts its temperature" in found.warnings[0]
    assert "correct --temperature FILE=DEGC" in found.warnings[0]
    assert "column" not in found.warnings[0]


def test_a_start_file_of_half_the_size_hid_a_dead_temperature(start, warm):
    """A discharge tells the size, and the start file as it is does not follow the record at any temperature."""
    time = np.arange(0.0, 3600.0 * 20.5, 60.0)
    current = np.full(len(time), start.nominal_capacity_ah / 20.0)
    current[:5] = 0.0
    degc = np.full(len(time), 25.0)
    run = simulate(start, time, current, 1.0, (), degc, "backward", on_depletion="clip")
    end = int(np.argmax(run.voltage_v < start.lower_voltage_v)) or len(time)
    slow = Measurement(time[:end], current[:end], run.voltage_v[:end], degc[:end], "slow", hold="backward")
    dead = replace(warm, temperature_degc=np.zeros(len(warm)), hold="backward")
    half = [replace(record, current_a=0.5 * record.current_a) for record in (dead, slow)]
    found = calibrate(start, half, evaluations=1)
    assert found.warnings[0].startswith("warm: its voltage contradicts its temperature. The error of ")
