"""Scalars that fits move: their coordinates, bounds and starts, and what acts on a record beside good ones."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aesi.errors import ParameterError
from aesi.parameters import Parameter
from aesi.physics.effects import CATALOGUE
from aesi.tracer.case.free_parameter import (
    FURTHEST_SDS,
    STATE_OF_CHARGE,
    acting_on,
    coordinates_of,
    effect_parameters,
    own_parameter,
    shared_owner,
    starts,
    state_of_charge,
    values_of,
)
from aesi.tracer.case.trust import own_sd
from aesi.tracer.report.own_parameters import own_parameters

FACTOR = Parameter(2.0, "1", bounds=(0.1, 10.0), source="test", log=True, neutral=1.0)
OHM = Parameter(1e-3, "ohm", bounds=(0.0, 0.1), source="test", neutral=0.0)
SPREAD = Parameter(0.3, "1", bounds=(0.0, 0.8), source="test", neutral=0.0, even=True)


@given(st.floats(0.1, 10.0))
def test_a_value_comes_back_from_its_coordinate(value):
    for free in (
        *effect_parameters("effect", {"factor": FACTOR}, 5.0),
        own_parameter("effect", "factor", FACTOR, 0.2),
    ):
        inside = min(max(value, free.low), free.high)
        assert free.value(free.coordinate(inside)) == pytest.approx(inside)


@given(st.floats(0.0, 2.0))
def test_what_is_even_moves_by_its_square(x):
    (spread,) = effect_parameters("effect", {"sd": SPREAD}, 5.0)
    assert spread.bounds == pytest.approx((0.0, 2.0))  # the end of a range is two deviations off
    assert spread.value(x) ** 2 == pytest.approx(x / 2.0 * 0.8**2)
    assert spread.coordinate(spread.value(x)) == pytest.approx(x)


def test_what_stood_on_its_bound_was_told_as_what_round_off_left():
    for parameter in (OHM, FACTOR, SPREAD):
        (free,) = effect_parameters("effect", {"parameter": parameter}, 5.0)
        assert free.reported(free.low + 1e-12) == free.low
        assert free.reported(free.high - 1e-12) == free.high
        assert free.reported(0.3 * free.high) == 0.3 * free.high


def test_what_is_even_has_no_negative_values():
    with pytest.raises(ParameterError, match="bounds from zero"):
        Parameter(0.3, "1", bounds=(-0.1, 0.8), source="test", even=True)
    with pytest.raises(ParameterError, match="logarithmic"):
        Parameter(0.3, "1", bounds=(0.1, 0.8), source="test", log=True, even=True)


def test_the_currents_and_resistances_of_a_larger_cell_are_expected_to_be_so():
    amps = Parameter(
        0.1, "A", bounds=(-10.0, 10.0), source="test", neutral=0.0, expected=0.05, capacity_power=1
    )
    growth = replace(OHM, expected=0.04, capacity_power=-2)
    for capacity_ah in (1.0, 5.0):
        (current,) = effect_parameters("effect", {"offset_a": amps}, capacity_ah)
        (ohm,) = effect_parameters("effect", {"resistance_ohm": growth}, capacity_ah)
        assert current.sd == pytest.approx(0.05 * capacity_ah)
        assert ohm.sd == pytest.approx(0.04 / capacity_ah**2)
    with pytest.raises(ParameterError, match="capacity_power"):
        replace(FACTOR, capacity_power=1)


def test_an_own_parameter_stays_within_its_spread_and_its_range():
    narrow, wide = (
        own_parameter("effect", "factor", FACTOR, 0.2),
        own_parameter("effect", "factor", FACTOR, 2.0),
    )
    assert narrow.bounds == pytest.approx((-FURTHEST_SDS, FURTHEST_SDS))
    assert (wide.low, wide.high) == FACTOR.bounds
    assert not any(narrow.on_bound(x) for x in narrow.bounds)


def test_an_effect_ends_on_a_bound_but_not_on_its_neutral_point():
    (ohm,) = effect_parameters("effect", {"resistance_ohm": OHM}, 5.0)
    low, high = ohm.bounds
    assert low == 0.0
    assert (ohm.on_bound(low), ohm.on_bound(high)) == (False, True)


def test_a_state_of_charge_is_known_to_its_deviation():
    soc = state_of_charge(1, 0.8, 0.01)
    assert soc.key == (STATE_OF_CHARGE, "1")
    assert soc.value(1.0) == pytest.approx(0.81)
    assert soc.value(99.0) == pytest.approx(0.8 + FURTHEST_SDS * 0.01)


def test_values_and_coordinates_are_one_anothers_inverse():
    free = [*effect_parameters("a", {"resistance_ohm": OHM}, 5.0), state_of_charge(0, 0.5, 0.02)]
    known = {("a", "resistance_ohm"): 2e-3}
    x = coordinates_of(free, known)
    assert values_of(free, x, ("a", "without")) == {
        "a": {"resistance_ohm": pytest.approx(2e-3)},
        "soc0": {"0": 0.5},
        "without": {},
    }


@pytest.mark.parametrize("effect", ["series_resistance", "film_growth"])
def test_a_resistance_of_a_coin_cell_was_beyond_bounds_in_ohm(effect):
    """A prior that goes with one over the capacity came to a fortieth of a deviation, at 5 mAh."""
    for capacity_ah in (1e-3, 5e-3, 0.25, 5.0):
        for free in effect_parameters(effect, CATALOGUE[effect].parameters, capacity_ah):
            assert free.bounds[1] >= FURTHEST_SDS


def test_fits_start_a_third_of_the_way_to_what_is_typical():
    (first,) = starts(effect_parameters("a", {"resistance_ohm": OHM}, 5.0))
    (ohm,) = effect_parameters("a", {"resistance_ohm": OHM}, 5.0)
    assert ohm.value(first[0]) == pytest.approx(OHM.default / 3.0)


def test_what_is_under_test_acts_beside_what_all_records_share_and_not_on_good_ones():
    name = "solid_diffusivity"
    both = {
        shared_owner(name): {"negative_factor": 2.0},
        name: {"negative_factor": 1.5},
        "soc0": {"0": 0.9},
    }
    assert acting_on(CATALOGUE, both, good=True) == {name: {"negative_factor": 2.0}}
    assert acting_on(CATALOGUE, both, good=False) == {name: {"negative_factor": pytest.approx(3.0)}}
    assert acting_on(CATALOGUE, {name: {"negative_factor": 1.5}}, good=True) == {}


def test_a_file_of_a_measured_cell_is_believed_where_its_instruments_are_not():
    declared, sensor = CATALOGUE["solid_diffusivity"], CATALOGUE["voltage_sensor_offset"]
    for effect in (declared, sensor):
        for p in (one for one in effect.parameters.values() if one.spread is not None):
            tight, exact, loose, measured = (
                own_sd(trust, effect, p, 1.0) for trust in ("tight", "exact", "loose", "measured")
            )
            assert (tight, loose) == (p.spread.tight, p.spread.loose)
            assert measured == (exact if effect is declared else loose)
            assert exact == (pytest.approx(0.1 * tight) if effect is declared else tight)
    open_here = {n for n, p in declared.parameters.items() if own_sd("tight", declared, p, 1.0) is not None}
    assert open_here


def test_a_parameter_that_vanishes_outside_its_bounds_is_refused():
    with pytest.raises(ParameterError, match=r"neutral = 0 dimensionless is outside \[0.5, 2\]"):
        Parameter(1.0, "1", bounds=(0.5, 2.0), source="test", neutral=0.0)
    with pytest.raises(ParameterError, match=r"neutral = 3 dimensionless is outside \[0.5, 2\]"):
        Parameter(1.0, "1", bounds=(0.5, 2.0), source="test", log=True, neutral=3.0)
    # A logarithmic scale does not reach the zero at which a conductance, say, vanishes.
    assert Parameter(1.0, "1", bounds=(0.5, 2.0), source="test", log=True, neutral=0.0).neutral == 0.0


def test_how_far_a_parameter_went_was_told_in_deviations_whose_size_nobody_said():
    """A tenth of the tolerance counted as one deviation in one fit, all of it in another."""
    diffusivity = CATALOGUE["solid_diffusivity"].parameters["negative_factor"]
    offset = CATALOGUE["voltage_sensor_offset"].parameters["offset_v"]
    open_ones = [
        own_parameter("solid_diffusivity", "negative_factor", diffusivity, 0.3),
        own_parameter("voltage_sensor_offset", "offset_v", offset, 3e-4),
    ]
    values = {
        "solid_diffusivity": {"negative_factor": float(np.exp(-0.6))},
        "voltage_sensor_offset": {"offset_v": 3e-4},
    }
    state = SimpleNamespace(
        values=values, hypothesis=(), problem=SimpleNamespace(free=lambda hypothesis: open_ones)
    )
    factor, shift = own_parameters(state)
    assert (factor.deviations, factor.one_sd) == (pytest.approx(-2.0), pytest.approx(1.0 - np.exp(-0.3)))
    assert (shift.deviations, shift.one_sd) == (pytest.approx(1.0), pytest.approx(3e-4))
