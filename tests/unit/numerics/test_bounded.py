"""Levenberg-Marquardt inside a box."""

import numpy as np
import pytest

from aesi.numerics.bounded import descend


def problem(residual, jacobian):
    def cost(x):
        r = residual(x)
        return 0.5 * float(r @ r)

    return (lambda x: (residual(x), jacobian(x))), cost


def rosenbrock():
    return problem(
        lambda x: np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]]),
        lambda x: np.array([[-20 * x[0], 10.0], [-1.0, 0.0]]),
    )


def test_rosenbrock_from_the_usual_start():
    linearise, cost = rosenbrock()
    found = descend(linearise, cost, np.array([-1.2, 1.0]), np.full(2, -5.0), np.full(2, 5.0), 100, 1e-14)
    assert found.x == pytest.approx([1, 1], abs=1e-5)


def test_a_minimum_outside_the_box_is_met_on_its_face():
    linearise, cost = problem(lambda x: x - np.array([3.0, 0.5]), lambda x: np.eye(2))
    found = descend(linearise, cost, np.zeros(2), np.full(2, -1.0), np.full(2, 1.0), 20, 1e-12)
    assert found.x == pytest.approx([1.0, 0.5], abs=1e-6)


def test_a_start_that_fails_is_returned_as_it_is():
    found = descend(lambda x: None, lambda x: np.inf, np.zeros(2), -np.ones(2), np.ones(2), 5, 1e-3)
    assert found.cost == np.inf
    assert found.steps == 0


def test_slopes_that_lead_nowhere_leave_the_start_as_it_is():
    linearise, cost = problem(lambda x: x - 3.0, lambda x: -np.eye(2))
    found = descend(linearise, cost, np.zeros(2), np.full(2, -5.0), np.full(2, 5.0), 10, 1e-12)
    assert found.x == pytest.approx([0.0, 0.0])
