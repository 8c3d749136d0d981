"""Longer steps where samples are far apart, without another voltage."""

import numpy as np
import pytest

from aesi.data.thinning import condensed
from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer.case.fit_simulation import STEPS_A_SAMPLE, fit_simulation, stepping
from aesi.tracer.case.thinned import STEADY_SPACING, thinned_record


@pytest.fixture
def pulses(cell):
    """Pulses of 10 s at 2C and rests of an hour, thinned to rows that are dense after each step."""
    time = np.arange(14_400.0)
    current = np.where(time % 3600 < 10, 60.0, 0.0)
    current[0] = 0.0
    data = Measurement(time, current, np.full(len(time), 3.7), name="pulses")
    rows, _ = condensed(data, cell.nominal_capacity_ah, 300.0, STEADY_SPACING)
    return rows


def test_a_drive_at_a_sample_a_second_is_stepped_as_declared(make):
    assert stepping(make(n=600)) == ()


@pytest.mark.parametrize(
    "name", ["self_heating", "concentration_dependent_diffusivity", "reaction_nonuniformity"]
)
def test_few_steps_between_thinned_rows_are_as_good_as_many(cell, pulses, name):
    effect = CATALOGUE[name].activate()

    def voltage(*steps):
        return simulate(
            cell, pulses.time_s, pulses.current_a, 0.8, (effect, *steps), None, "backward"
        ).voltage_v

    coarse, fine = voltage(*stepping(pulses)), voltage()
    assert pulses.time_s[-1] > 20 * STEPS_A_SAMPLE * len(pulses)  # steps of a second would be many more
    assert coarse == pytest.approx(fine, abs=1e-4)


@pytest.mark.parametrize("name", ["double_layer", "series_resistance"])
def test_pulses_between_whose_rows_the_current_runs_straight_lose_nothing_when_thinned(cell, name):
    time = np.arange(3600.0)
    current = np.where(time % 600 < 20, 60.0, 0.0)
    data = Measurement(time, current, np.full(len(time), 3.7), name="pulses", hold="linear")
    record = thinned_record(cell, data)
    assert record.rows is not None
    assert len(record.thin) < 0.5 * len(time)
    assert record.thin_hold == "linear"
    effects = (CATALOGUE[name].activate(),)
    whole, thin = (
        simulate(cell, one.time_s, one.current_a, 0.8, effects, None, "linear").voltage_v
        for one in (record.whole, record.thin)
    )
    assert thin == pytest.approx(record.averaged(whole), abs=1e-3)
    assert np.sqrt(np.mean((thin - record.averaged(whole)) ** 2)) < 1e-4


def test_a_lag_of_a_tenth_of_a_second_is_what_it_was_in_the_rows_that_a_pulse_is_averaged_over(cell):
    time = np.arange(0.0, 1_200.0, 0.1)
    current = np.where((time % 400.0) > 350.0, cell.nominal_capacity_ah, 0.0)
    lag = CATALOGUE["clock_skew"].activate(lag_s=0.125)
    read = simulate(cell, time, current, 0.8, [lag], hold="linear").voltage_v
    record = thinned_record(cell, Measurement(time, current, read, name="pulses", hold="linear"))
    assert len(record.thin) < len(time) / 4
    run = fit_simulation(cell, record.thin, 0.8, [lag], record.thin_hold)
    without = fit_simulation(cell, record.thin, 0.8, [], record.thin_hold)
    assert np.abs(without.voltage_v - record.thin.voltage_v).max() > 20e-3
    assert np.abs(run.voltage_v - record.thin.voltage_v).max() < 2e-3
