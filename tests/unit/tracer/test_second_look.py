"""Recalibration under a search: what is freed, when, and that the settled cell says the same as its parameters did."""

import numpy as np
import pytest

from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer import second_look
from aesi.tracer.fit import Fitter, fit_hypothesis
from aesi.tracer.problem import Problem
from aesi.tracer.records import prepare_all

OFF = (
    CATALOGUE["charge_transfer_kinetics"].activate(negative_factor=0.5, positive_factor=0.7),
    CATALOGUE["solid_diffusivity"].activate(negative_factor=0.6, positive_factor=0.8),
    CATALOGUE["ocp_shape"].activate(a1_v=0.03, a3_v=-0.02, positive_share=1.0),
)


@pytest.fixture(scope="module")
def slow(cell):
    """A C/10 discharge over nearly the whole range of a cell that is off in many ways."""
    time = np.linspace(0.0, 9.3 * 3600.0, 400)
    current = np.full(400, 0.1 * cell.nominal_capacity_ah)
    current[0] = 0.0
    return Measurement(time, current, simulate(cell, time, current, 0.98, OFF).voltage_v, name="slow")


@pytest.fixture
def problem(cell, few, make, slow):
    return Problem(cell, prepare_all(cell, [slow, make(OFF)], None, 0.0), few)


def test_only_a_slow_and_wide_record_allows_a_second_look(cell, few, make, problem):
    assert second_look.is_possible(problem)
    assert not second_look.is_possible(Problem(cell, prepare_all(cell, [make()], 0.9, 0.0), few))


def test_what_is_freed_does_not_compete(problem):
    freed = second_look.freed(problem)
    assert set(freed.competing) == {"current_sensor_gain", "ocv_hysteresis"}
    assert {"ocp_shape", "solid_diffusivity", "lithium_inventory_loss"} <= {k.owner for k in freed.knobs(())}


def test_a_cell_that_is_off_in_many_ways_is_recalibrated_without_naming_physics(problem):
    declared = fit_hypothesis(problem, ())
    recalibrated = fit_hypothesis(second_look.freed(problem), ())
    assert recalibrated.rmse_v < 0.25 * declared.rmse_v
    assert second_look.nats_of_potential(second_look.freed(problem), recalibrated) > 10.0


def test_the_settled_cell_says_what_its_parameters_said(problem):
    freed = second_look.freed(problem)
    fitter = Fitter(freed, ("ocv_hysteresis",))
    x = 0.2 * np.random.default_rng(3).normal(size=len(fitter.knobs))
    fit = fit_hypothesis(freed, ("ocv_hysteresis",), [np.clip(x, fitter.low, fitter.high)])
    cell, effects, soc0 = second_look.settled(freed, fit)
    assert {active.id for active in effects} == {"ocv_hysteresis", "voltage_sensor_offset"}
    record = freed.records[0]
    run = simulate(cell, record.thin.time_s, record.thin.current_a, soc0, effects, None, record.thin_hold)
    predicted = freed.predict(fit.knobs, fit.x)[0]
    assert run.voltage_v == pytest.approx(predicted, abs=2e-4)
