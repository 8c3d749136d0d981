"""Longer steps where samples are far apart, without another voltage."""

from pathlib import Path

import numpy as np
import pytest

from aesi.data.thinning import condensed
from aesi.physics import Cell, simulate
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


@pytest.fixture(scope="module")
def hg2():
    """An LG 18650HG2 in its file, with a winding that conducts heat to its case."""
    return Cell.from_bpx(
        Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_18650hg2.bpx.json"
    )


@pytest.fixture(scope="module")
def swings():
    """(1,800 s at 10 Hz; a current that changes by up to 2C each half second, about a discharge in waves)."""
    time = np.arange(0.0, 1800.0, 0.1)
    fast = np.repeat(np.random.default_rng(2).uniform(-1.0, 1.0, 3600), 5)
    return time, 3.0 * (0.5 + 0.5 * np.sin(time / 200.0) + fast)


def excess_k(run, from_degc):
    """(n,) K of the winding above these temperatures."""
    return run.series["temperature_k"] - 273.15 - from_degc


WARMING = CATALOGUE["self_heating"].activate(heat_transfer_w_k=0.02)


@pytest.mark.parametrize("model", ["espm", "dfn"])
@pytest.mark.parametrize("hold", ["linear", "backward"])
@pytest.mark.parametrize("step_s", [1.0, 8.0])
def test_a_drive_in_averages_was_warmed_by_less_than_its_own_rows(hg2, swings, model, hold, step_s):
    """By 0.7 to 0.8 of it, from which a fit made another conductance or heat capacity."""
    time, current = swings
    whole = simulate(hg2, time, current, 0.8, [WARMING], None, hold, model=model)
    record = thinned_record(hg2, Measurement(time, current, whole.voltage_v, name="drive", hold=hold), step_s)
    thin = fit_simulation(hg2, record.thin, 0.8, [WARMING], record.thin_hold, model)
    own_k, thin_k = excess_k(whole, 25.0), excess_k(thin, 25.0)
    assert own_k.max() > 3.0
    assert thin_k[-1] == pytest.approx(np.interp(record.thin.time_s[-1], time, own_k), rel=0.02)
    assert thin_k.mean() == pytest.approx(record.averaged(own_k).mean(), rel=0.02)
    bare = simulate(
        hg2, record.thin.time_s, record.thin.current_a, 0.8, [WARMING], None, "linear", model=model
    )
    assert excess_k(bare, 25.0).mean() < 0.9 * thin_k.mean()


def test_a_winding_in_averages_is_as_much_warmer_than_its_case_as_in_its_own_rows(hg2, swings):
    time, current = swings
    case_degc = 25.0 + 1e-4 * time
    whole = simulate(hg2, time, current, 0.8, (), case_degc)
    data = Measurement(time, current, whole.voltage_v, case_degc, "drive", hold="linear")
    record = thinned_record(hg2, data, 8.0)
    thin = fit_simulation(hg2, record.thin, 0.8, (), record.thin_hold)
    own_k = record.averaged(excess_k(whole, case_degc))
    thin_k = excess_k(thin, record.thin.temperature_degc)
    assert own_k.mean() > 0.2
    assert thin_k.mean() == pytest.approx(own_k.mean(), rel=0.02)


def test_the_heat_of_averages_is_of_the_rows_with_a_lag_undone(hg2, swings):
    """Beside a voltage that lags by half a swing, a current as written swings against it by less than it did."""
    time, current = swings
    lag = CATALOGUE["clock_skew"].activate(skew=0.0, lag_s=0.3)
    true = simulate(hg2, time, current, 0.8, [WARMING])
    late = Measurement(time, current, np.interp(time - 0.3, time, true.voltage_v), name="late", hold="linear")
    record = thinned_record(hg2, late)
    undone, bare = (
        fit_simulation(hg2, record.thin, 0.8, effects, record.thin_hold)
        for effects in ([WARMING, lag], [WARMING])
    )
    own_k = record.averaged(excess_k(true, 25.0)).mean()
    assert excess_k(undone, 25.0).mean() == pytest.approx(own_k, rel=0.02)
    assert excess_k(bare, 25.0).mean() < 0.9 * own_k
