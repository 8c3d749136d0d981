"""Free and tolerated knobs."""

import numpy as np
import pytest

from aesi.parameters import Parameter
from aesi.tracer.knobs import TOLERATED_SDS, free_knobs, soc_knob, starts, tolerated_knob, values_by_owner

RATE = Parameter(20.0, "1", (1.0, 500.0), "test", log=True)
SIZE = Parameter(0.01, "V", (-0.1, 0.1), "test", neutral=0.0)
FACTOR = Parameter(0.5, "1", (0.1, 10.0), "test", log=True, neutral=1.0)


@pytest.mark.parametrize("parameter", [RATE, SIZE, FACTOR])
def test_working_coordinates_invert(parameter):
    knob = free_knobs("e", {"p": parameter})[0]
    for value in (*parameter.bounds, parameter.default):
        assert knob.to_value(knob.to_working(value)) == pytest.approx(value)
    low, high = knob.working_bounds
    assert high - low == pytest.approx(1.0)


def test_a_factor_starts_where_it_changes_nothing():
    knob = free_knobs("e", {"p": FACTOR})[0]
    assert knob.to_value(0.0) == 1.0


def test_a_tolerated_knob_stays_within_its_tolerance():
    knob = tolerated_knob("e", "p", FACTOR, 0.03)
    assert knob.high == pytest.approx(np.exp(0.03 * TOLERATED_SDS))
    assert knob.to_working(knob.high) == pytest.approx(TOLERATED_SDS)
    assert not knob.at_bound(knob.high)


def test_bounds_that_mean_something_and_neutral_points_are_no_bounds():
    size, rate = free_knobs("e", {"s": Parameter(1e-3, "ohm", (0.0, 0.1), "t", neutral=0.0), "r": RATE})
    assert not size.at_bound(0.0)
    assert size.at_bound(0.1)
    assert rate.at_bound(500.0)
    state = free_knobs("e", {"start": Parameter(0.0, "1", (-1.0, 1.0), "t")})[0]
    assert not state.at_bound(1.0)


def test_a_lower_bound_that_stands_for_nought_is_none():
    limit = Parameter(20.0, "1", (1.0, 500.0), "test", log=True, low_is_limit=True)
    rate, open_below = free_knobs("e", {"r": RATE, "l": limit})
    assert rate.at_bound(1.0)
    assert not open_below.at_bound(1.0)
    assert open_below.at_bound(500.0)


def test_shapes_have_several_starts_and_amplitudes_one():
    assert len(starts(free_knobs("e", {"s": SIZE}))) == 1
    assert len(starts(free_knobs("e", {"s": SIZE, "r": RATE}))) == 3


def test_values_are_sorted_by_owner():
    knobs = [soc_knob("0", 0.9, 0.001), *free_knobs("e", {"s": SIZE})]
    values = values_by_owner(knobs, np.array([1.0, 0.25]))
    assert values["soc0"]["0"] == pytest.approx(0.901)
    assert values["e"]["s"] == pytest.approx(0.05)
