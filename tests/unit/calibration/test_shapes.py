"""Corrected potentials fall everywhere, whatever a fit makes of them, and their slopes are those that a fit is told."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aesi.calibration.shapes import Shapes
from aesi.constants import ZERO_CELSIUS_K
from aesi.physics.cell.relations import Constant
from aesi.physics.rest.open_circuit import OpenCircuit

INNER = np.linspace(0.002, 0.998, 4001)


@pytest.fixture(scope="module")
def shapes(start):
    return Shapes.over(start, span_k=20.0)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0.0, 4.0))
def test_a_corrected_potential_falls_wherever_lithium_is_added(shapes, start, seed, size):
    z = size * np.random.default_rng(seed).standard_normal(shapes.size)
    cell = shapes.on(start, z)
    for electrode in (cell.negative, cell.positive):
        assert (np.diff(electrode.ocp(INNER)) < 0.0).all()


def test_without_a_correction_the_potentials_are_those_of_the_file(shapes, start):
    cell = shapes.on(start, np.zeros(shapes.size))
    for ours, declared in ((cell.negative, start.negative), (cell.positive, start.positive)):
        theta = np.linspace(declared.theta_min, declared.theta_max, 401)
        assert np.abs(ours.ocp(theta) - declared.ocp(theta)).max() < 2e-3


def test_the_slopes_are_those_of_the_voltage_at_rest(shapes, start):
    rng = np.random.default_rng(2)
    z = rng.standard_normal(shapes.size)
    theta_n, theta_p = rng.uniform(0.02, 0.95, 50), rng.uniform(0.30, 0.83, 50)

    def volts(z):
        cell = shapes.on(start, z)
        return cell.positive.ocp(theta_p) - cell.negative.ocp(theta_n)

    columns = shapes.columns(z, theta_n, theta_p)
    assert columns.shape == (50, shapes.closed)
    for j in range(shapes.closed):
        step = np.zeros(shapes.size)
        step[j] = 1e-4
        slope = (volts(z + step) - volts(z - step)) / 2e-4
        assert columns[:, j] == pytest.approx(slope, abs=1e-3 * np.abs(slope).max())  # of tables


def test_a_potential_that_rises_in_the_start_file_falls_in_what_is_fitted(start):
    wavy = replace(start.positive, ocp=type(start.positive.ocp)("4.2 - 0.8 * x + 0.1 * tanh(50 * (x - 0.5))"))
    cell = replace(start, positive=wavy)
    flat = Shapes.over(cell, 0.0)
    ocp = flat.on(cell, np.zeros(flat.size)).positive.ocp(INNER)
    assert (np.diff(wavy.ocp(INNER)) > 0.0).any()
    assert (np.diff(ocp) < 0.0).all()


def test_a_corrected_entropy_is_what_its_knots_say_and_warms_the_voltage(start):
    entropic = Shapes.over(start, span_k=20.0).entropic
    z = np.array([1.0, 2.0, 0.5, 1.0, 3.0])
    theta = np.linspace(entropic.low, entropic.high, 50)
    added = entropic.added(Constant(0.0), z)
    assert added(theta) == pytest.approx(entropic.columns(theta) @ z, abs=1e-5)
    assert (added(theta) > 0.0).all()
    cell = replace(start, positive=replace(start.positive, entropic=added))
    warm, cold = (OpenCircuit(cell, degc + ZERO_CELSIUS_K).voltage_at(0.5) for degc in (45.0, 5.0))
    assert warm - cold == pytest.approx(40.0 * float(added(np.array([middle(cell)]))[0]), rel=1e-3)


def middle(cell):
    return cell.stoichiometries(0.5)[1]
