"""Levenberg-Marquardt inside a box."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.optimize import lsq_linear, rosen

from aesi.numerics.bounded import descend, slope_within


@dataclass
class Counted:
    """A residual with its slopes, and how often either was asked for."""

    of: object
    jacobian: object
    asked: list = field(default_factory=lambda: [0, 0])

    def residual(self, x):
        self.asked[0] += 1
        return self.of(x)

    def slopes(self, x, residual):
        self.asked[1] += 1
        return self.jacobian(x)


def rosenbrock():
    return Counted(
        lambda x: np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]]),
        lambda x: np.array([[-20 * x[0], 10.0], [-1.0, 0.0]]),
    )


def exponentials(n=40, k=6):
    t = np.linspace(0, 2, n)
    basis = np.cos(np.outer(t, np.arange(k)))
    y = np.exp(0.3 * basis @ np.linspace(-1, 1, k))
    return Counted(
        lambda x: np.exp(0.3 * basis @ x) - y, lambda x: 0.3 * basis * np.exp(0.3 * basis @ x)[:, None]
    ), np.linspace(-1, 1, k)


def test_rosenbrock_from_the_usual_start():
    found = descend(rosenbrock(), np.array([-1.2, 1.0]), np.full(2, -5.0), np.full(2, 5.0), 100, 1e-14)
    assert found.x == pytest.approx([1, 1], abs=1e-5)
    assert found.converged
    assert found.cost == pytest.approx(0.5 * rosen(found.x), abs=1e-12)


def test_a_minimum_outside_the_box_is_met_on_its_face():
    model = Counted(lambda x: x - np.array([3.0, 0.5]), lambda x: np.eye(2))
    found = descend(model, np.zeros(2), np.full(2, -1.0), np.full(2, 1.0), 20, 1e-12)
    assert found.x == pytest.approx([1.0, 0.5], abs=1e-6)


def test_a_start_that_fails_is_returned_as_it_is():
    found = descend(Counted(lambda x: None, None), np.zeros(2), -np.ones(2), np.ones(2), 5, 1e-3)
    assert found.cost == np.inf
    assert not found.converged


def test_a_start_where_the_model_gives_no_number_ended_in_an_error_of_linear_algebra():
    model = Counted(lambda x: np.array([np.nan, x[0]]), lambda x: np.array([[1.0], [1.0]]))
    found = descend(model, np.ones(1), np.zeros(1), 2.0 * np.ones(1), 5, 1e-9)
    assert found.x == pytest.approx([1.0])
    assert found.cost == np.inf
    assert not found.converged


def test_slopes_that_lead_nowhere_leave_the_start_as_it_is():
    model = Counted(lambda x: x - 3.0, lambda x: -np.eye(2))
    found = descend(model, np.zeros(2), np.full(2, -5.0), np.full(2, 5.0), 10, 1e-12)
    assert found.x == pytest.approx([0.0, 0.0])


def test_updates_take_the_place_of_slopes_which_are_taken_seldom():
    model, truth = exponentials()
    box = np.full(6, -5.0), np.full(6, 5.0)
    found = descend(model, np.zeros(6), *box, 20, 1e-12)
    assert found.x == pytest.approx(truth, abs=1e-4)
    assert model.asked[1] <= 3
    assert model.asked[0] < 20


def test_where_it_begins_with_the_slopes_of_another_place_it_ends_where_it_would_without_them():
    model, truth = exponentials()
    box = np.full(6, -5.0), np.full(6, 5.0)
    wrong = descend(model, np.zeros(6), *box, 20, 1e-12, -model.jacobian(np.zeros(6)))
    near = descend(model, truth + 0.05, *box, 20, 1e-12, model.jacobian(np.ones(6)))
    assert wrong.x == pytest.approx(truth, abs=1e-4)
    assert near.x == pytest.approx(truth, abs=1e-4)


def test_a_descent_that_stops_early_has_not_converged():
    model = rosenbrock()
    found = descend(model, np.array([-1.2, 1.0]), np.full(2, -5.0), np.full(2, 5.0), 1, 1e-14)
    assert (model.asked[1], found.converged) == (1, False)


def test_where_slopes_were_taken_last_is_as_good_within_the_tolerance():
    model, _ = exponentials()
    found = descend(model, np.zeros(6), np.full(6, -5.0), np.full(6, 5.0), 20, 1e-3)
    there = 0.5 * float(np.sum(model.of(found.known_x) ** 2))
    assert found.converged
    assert found.cost <= there < found.cost + 1e-3
    assert not np.array_equal(found.x, found.known_x)


def test_a_minimum_on_the_edge_is_reached_where_the_free_step_cut_off_leads_uphill():
    # Two nearly collinear slopes: the free step is 10 along the one and -9 along the other, cut off at 0 the latter.
    slopes = np.array([[1.0, 1.0], [0.0, 0.1], [0.1, 0.0]])
    target = np.array([1.0, -0.9, 1.0])
    model = Counted(lambda x: slopes @ x - target, lambda x: slopes)
    box = np.zeros(2), np.full(2, 20.0)
    found = descend(model, np.array([0.9, 0.1]), *box, 20, 1e-9)
    expected = lsq_linear(slopes, target, box)
    assert found.x == pytest.approx(expected.x, abs=1e-4)
    assert found.cost == pytest.approx(expected.cost, abs=1e-6)
    assert found.converged


def test_a_step_that_goes_too_far_is_damped_until_it_gains():
    # Slopes of a thousandth, as beside a kink: a step goes a thousand times too far.
    flat = Counted(lambda x: x, lambda x: np.array([[1e-3]]))
    found = descend(flat, np.array([1.0]), np.array([-9.0]), np.array([9.0]), 20, 1e-9)
    assert found.cost < 1e-6


@pytest.mark.parametrize(
    ("at", "fails", "slope"),
    [
        (0.0, lambda x: False, 1.0),  # forward
        (1.0, lambda x: False, -1.0),  # no room forward
        (0.5, lambda x: x > 0.5, -1.0),  # no value forward
        (0.0, lambda x: x > 0.0, None),  # and none within the bounds on the other side
        (0.5, lambda x: True, None),
    ],
)
def test_a_slope_is_taken_within_the_bounds_and_where_there_is_a_value(at, fails, slope):
    def kinked(x):  # about `at`: its slope tells on which side it was taken
        return None if fails(x[1]) else np.array([abs(x[1] - at), 3.0 * x[0]])

    found = slope_within(kinked, np.array([2.0, at]), np.array([0.0, 6.0]), 1, (0.0, 1.0), 1e-3)
    assert (found is None) == (slope is None)
    if slope is not None:
        assert found == pytest.approx([slope, 0.0])


def test_a_step_is_at_most_a_quarter_of_what_the_bounds_span():
    asked = []
    slope_within(lambda x: asked.append(x[0]), np.array([0.5]), np.zeros(1), 0, (0.5, 0.54), 1.0)
    assert asked == pytest.approx([0.51])


def test_bounds_without_room_between_them_gave_a_slope_of_no_number():
    assert slope_within(lambda x: 2.0 * x, np.array([0.5]), np.ones(1), 0, (0.5, 0.5), 1e-3) is None


@pytest.mark.parametrize("beyond", [lambda x: np.array([1e3, x[0], x[1]]), lambda x: None])
def test_a_descent_stayed_where_it_began_beside_a_jump_of_one_coordinate(beyond):
    # What one coordinate would gain below zero, where the residual jumps or has no value, is not to be had; the other
    # one's minimum is.
    slopes = np.array([[1.0, 1.0], [1.0, 0.0], [0.0, 2.0]])
    target = np.array([2.0, -1.0, 6.0])

    def residual(x):
        return beyond(x) if x[0] < 0.0 else slopes @ x - target

    box = np.array([-9.0, -9.0]), np.array([9.0, 9.0])
    found = descend(Counted(residual, lambda x: slopes), np.zeros(2), *box, 20, 1e-9)
    expected = lsq_linear(slopes, target, (np.array([0.0, -9.0]), box[1]))
    assert expected.x[0] == pytest.approx(0.0, abs=1e-6)
    assert found.x == pytest.approx(expected.x, abs=1e-4)
    assert found.converged


def test_a_wall_beside_an_end_of_the_box_left_a_step_no_room():
    model = Counted(
        lambda x: np.full(2, 50.0) if x[0] < 1.0 else x - np.array([-3.0, 2.0]), lambda x: np.eye(2)
    )
    found = descend(model, np.array([1.0, 0.0]), np.full(2, -5.0), np.array([1.0, 5.0]), 20, 1e-9)
    assert found.x == pytest.approx([1.0, 2.0], abs=1e-4)


def test_a_descent_ended_on_the_wrong_side_of_a_jump_beside_which_its_slopes_are_flat():
    target = np.array([30.0, -0.1, -2.0])

    def residual(x):  # the last one jumps by 2 where the second coordinate passes zero
        return np.array([10.0 * x[0], 0.1 * x[1], 0.0 if x[1] < 0.0 else -2.0]) - target

    model = Counted(residual, lambda x: np.diag([10.0, 0.1, 0.0])[:, :2])
    start, box = np.array([0.0, -0.5]), (np.full(2, -9.0), np.full(2, 9.0))
    beside = descend(model, start, *box, 20, 1e-9)
    found = descend(model, start, *box, 20, 1e-9, jumps=[1])
    assert beside.x == pytest.approx([3.0, -1.0], abs=1e-3)
    assert found.x == pytest.approx([3.0, 0.0], abs=1e-3)
    assert found.cost < beside.cost - 1.9
    assert found.converged


def test_a_point_past_a_jump_without_a_number_replaced_the_minimum():
    model = Counted(
        lambda x: np.array([np.nan if x[0] == 0.0 else x[0] + 1.0, 1.0]), lambda x: np.array([[1.0], [0.0]])
    )
    found = descend(model, np.array([-0.5]), np.full(1, -2.0), np.full(1, 2.0), 5, 1e-9, jumps=[0])
    assert found.x == pytest.approx([-1.0], abs=1e-4)
    assert found.cost == pytest.approx(0.5)
    assert found.converged


def test_what_is_no_gain_far_from_the_minimum_may_be_one_near_it():
    """A valley along which each step gains little beside what the first one gained: with the tolerance of the start the
    descent ends in it."""
    start, box = np.array([-60.0, 1.0]), (np.full(2, -100.0), np.full(2, 4000.0))

    def no_gain(residual):
        return 1e-4 * max(float(np.mean(residual**2)), 1.0)

    of_the_start = no_gain(rosenbrock().residual(start))
    early = descend(rosenbrock(), start, *box, 100, of_the_start)
    found = descend(rosenbrock(), start, *box, 100, no_gain)
    assert early.converged
    assert early.cost > 1.0
    assert found.converged
    assert found.cost < 1e-3
