"""Recalibration under a search: what is freed, when, and that the settled cell says the same as its parameters did."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer import second_look
from aesi.tracer.fit import Fitter, fit_hypothesis
from aesi.tracer.problem import Problem
from aesi.tracer.records import prepare_all
from aesi.tracer.search import Archive

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


def test_a_recalibration_is_adopted_where_it_carries_to_what_it_has_not_seen(problem):
    search = second_look.SecondSearch(second_look.freed(problem), np.random.default_rng(0), Archive(None, ""))
    declared = fit_hypothesis(problem, ())
    assert search.improves(search.fit(()), declared)
    good = replace(declared, residual_v=1e-4 * np.ones_like(declared.residual_v))
    assert not search.improves(search.fit(()), good)


def test_large_errors_count_by_their_size_and_with_the_slope_of_what_they_count(problem):
    freed = second_look.freed(problem)
    e = np.array([-0.5, -0.015, -1e-4, 1e-4, 0.03, 2.0])
    h = 1e-7
    loss = [0.5 * freed.saturated(e + shift) ** 2 for shift in (-h, h)]
    assert (loss[1] - loss[0]) / (2 * h) == pytest.approx(freed.leniency(e) ** 2 * e, rel=1e-5)
    assert freed.saturated(e)[2:4] == pytest.approx(e[2:4], rel=1e-4)
    assert freed.saturated(np.array([2.0]))[0] ** 2 == pytest.approx(
        2 * second_look.OUTLIER_V * 2.0, rel=0.01
    )
    assert np.array_equal(problem.saturated(e), e)


def test_a_state_of_charge_moves_its_own_record_alone(problem):
    fitter = Fitter(problem, ())
    x = np.zeros(len(fitter.knobs))
    residual = fitter.residual(x)
    slopes = fitter.jacobian(x, residual)
    own = [j for j, k in enumerate(fitter.knobs) if k.owner == "soc0"]
    for rows, j in zip(problem.slices, own, strict=True):
        moved = x.copy()
        moved[j] += fitter.steps[j]
        assert slopes[:, j] == pytest.approx((residual - fitter.residual(moved)) / fitter.steps[j])
        assert np.abs(slopes[rows, j]).max() > 0


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
