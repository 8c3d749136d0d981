"""Heat that rows which are averages do not resolve: it warms a cell with a heat balance, and is given step by step."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.physics import simulate
from aesi.physics.effect import Effect, Record
from aesi.physics.effects import CATALOGUE
from aesi.physics.simulation import _cached_solution, forget_solutions

TIME_S = np.cumsum([0.0, *np.tile([1.0, 4.0, 10.0, 35.0], 12)])
CONDUCTANCE_W_K = 0.5
WARMING = CATALOGUE["self_heating"].activate(heat_transfer_w_k=CONDUCTANCE_W_K)
MODELS = pytest.mark.parametrize("model", ["espm", "dfn"])
HOLDS = pytest.mark.parametrize("hold", ["linear", "backward"])


@pytest.fixture
def heat_w():
    """Another heat in each step, some of it negative; the first row ends no step."""
    return np.append(1e6, np.random.default_rng(5).normal(20.0, 30.0, len(TIME_S) - 1))


def excess_k(time_s, heat_w, capacity_j_k, at_s=None):
    """(n,) K, by hand: a lump warmed by a heat that is constant since the row before, at the rows or at times."""
    at_s = time_s if at_s is None else at_s
    decay = CONDUCTANCE_W_K / capacity_j_k
    out = np.zeros(len(at_s))
    for begin, end, watts in zip(time_s[:-1], time_s[1:], heat_w[1:], strict=True):
        since, until = (np.maximum(at_s - t, 0.0) for t in (begin, end))
        out += watts / CONDUCTANCE_W_K * (np.exp(-decay * until) - np.exp(-decay * since))
    return out


@MODELS
@HOLDS
def test_a_resting_cell_warms_by_the_heat_that_it_is_given(nmc, heat_w, model, hold):
    run = simulate(
        nmc,
        TIME_S,
        np.zeros(len(TIME_S)),
        0.5,
        [WARMING],
        None,
        hold,
        model=model,
        unresolved_heat_w=heat_w,
    )
    expected = excess_k(TIME_S, heat_w, nmc.heat_capacity_j_k)
    assert expected.max() > 2.0
    warmed_k = run.series["temperature_k"] - nmc.ambient_temperature_k
    np.testing.assert_allclose(warmed_k, expected, atol=1e-3)


@MODELS
def test_a_winding_is_warmer_than_its_measured_case_by_that_heat(nmc, model):
    conducting = replace(nmc, thermal_conductivity_w_m_k=0.3)
    time = np.arange(0.0, 20_000.0, 50.0)
    case_degc = 20.0 + 1e-4 * time
    run = simulate(
        conducting,
        time,
        np.zeros(len(time)),
        0.5,
        (),
        case_degc,
        model=model,
        unresolved_heat_w=np.full(len(time), 3.0),
    )
    settled_k = run.series["temperature_k"][-1] - 273.15 - case_degc[-1]
    # The case itself warms by 0.1 mK a second, after which the winding lags.
    lag_k = 1e-4 * conducting.winding_resistance_k_w * conducting.heat_capacity_j_k
    assert settled_k == pytest.approx(3.0 * conducting.winding_resistance_k_w - lag_k, rel=1e-3)


@MODELS
@HOLDS
def test_no_heat_and_a_heat_of_zero_are_the_same_to_the_last_bit(nmc, load, model, hold):
    time, current = load
    without, zero = (
        simulate(nmc, time, current, 0.8, [WARMING], None, hold, model=model, unresolved_heat_w=heat)
        for heat in (None, np.zeros(len(time)))
    )
    assert np.ptp(without.series["temperature_k"]) > 0.5
    assert np.array_equal(without.voltage_v, zero.voltage_v)
    for name, values in without.series.items():
        assert np.array_equal(values, zero.series[name]), name


@MODELS
def test_a_cell_without_a_heat_balance_stays_as_it_is(nmc, load, model):
    time, current = load
    for degc in (None, 30.0, 30.0 + 1e-3 * time):
        without, given = (
            simulate(nmc, time, current, 0.8, (), degc, model=model, unresolved_heat_w=heat)
            for heat in (None, np.full(len(time), 5.0))
        )
        assert np.array_equal(without.voltage_v, given.voltage_v)
        assert np.array_equal(without.series["temperature_k"], given.series["temperature_k"])


def test_another_heat_is_another_question(nmc):
    forget_solutions()
    ends_k = [
        simulate(nmc, TIME_S, np.zeros(len(TIME_S)), 0.5, [WARMING], unresolved_heat_w=heat)
        .series["temperature_k"][-1]
        .item()
        for heat in (None, np.full(len(TIME_S), 1.0), np.full(len(TIME_S), 2.0))
    ]
    assert _cached_solution.cache_info().misses == 3
    assert ends_k[0] < ends_k[1] < ends_k[2]


def test_the_heat_stays_where_readings_lag_behind_the_current(nmc, heat_w):
    """Readings have rows of their own, between those of the current, some of which are left out."""
    lag_s = 2.3
    lag = CATALOGUE["clock_skew"].activate(skew=0.0, lag_s=lag_s)
    run = simulate(
        nmc, TIME_S, np.zeros(len(TIME_S)), 0.5, [WARMING, lag], hold="backward", unresolved_heat_w=heat_w
    )
    expected = excess_k(TIME_S, heat_w, nmc.heat_capacity_j_k, TIME_S - lag_s)
    warmed_k = run.series["temperature_k"] - nmc.ambient_temperature_k
    # Rows between readings are left out: a mean over 35 s cools otherwise than the steps that it is of.
    np.testing.assert_allclose(warmed_k, expected, atol=1e-2)


def test_an_effect_that_makes_a_new_record_does_not_lose_the_heat(nmc, heat_w):
    def anew(record):
        return Record(record.time_s, record.current_a)

    effect = Effect("anew", "physics", "A new record.", on_record=anew).activate()
    rest = np.zeros(len(TIME_S))
    plain, made = (
        simulate(nmc, TIME_S, rest, 0.5, [WARMING, *effects], unresolved_heat_w=heat_w)
        for effects in ((), (effect,))
    )
    assert np.array_equal(plain.series["temperature_k"], made.series["temperature_k"])


@pytest.mark.parametrize(
    ("heat", "said"),
    [
        (np.zeros(3), r"unresolved_heat_w has the shape \(3,\); give 49 numbers"),
        (1.0, r"unresolved_heat_w has the shape \(\); give 49 numbers"),
        (np.full(len(TIME_S), np.nan), "unresolved_heat_w"),
    ],
    ids=["too few", "one", "nan"],
)
def test_a_heat_that_is_no_row_of_numbers_is_refused(nmc, heat, said):
    with pytest.raises(DataError, match=said):
        simulate(nmc, TIME_S, np.zeros(len(TIME_S)), 0.5, [WARMING], unresolved_heat_w=heat)
