"""What effects do not change is not solved again, and its arrays belong to whoever asked."""

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.physics.simulation import _cached_solution, forget_solutions

TIME_S = np.arange(60.0)


@pytest.fixture
def solved():
    """How many solutions were found since the last time that this was asked."""
    forget_solutions()
    before = [0]

    def since() -> int:
        misses = _cached_solution.cache_info().misses
        before[0], found = misses, misses - before[0]
        return found

    return since


def test_an_effect_on_the_reading_is_added_to_what_is_known(lg_m50: Cell, solved):
    current_a = np.linspace(0.0, 5.0, 60)
    bare = simulate(lg_m50, TIME_S, current_a, soc0=0.8)
    offset = CATALOGUE["voltage_sensor_offset"].activate(offset_v=0.01)
    read = simulate(lg_m50, TIME_S, current_a, soc0=0.8, effects=[offset])
    assert solved() == 1
    assert read.voltage_v == pytest.approx(bare.voltage_v + 0.01, abs=1e-12)


@pytest.mark.parametrize(
    "other",
    [
        {"soc0": 0.7},
        {"temperature_degc": 30.0},
        {"temperature_degc": np.linspace(20.0, 30.0, 60)},
        {"hold": "backward"},
        {"model": "dfn"},
        {"current_a": np.full(60, 2.0)},
        {"time_s": 2.0 * TIME_S},
    ],
    ids=str,
)
def test_another_question_gets_its_own_answer(lg_m50: Cell, solved, other):
    asked = {"time_s": TIME_S, "current_a": np.linspace(0.0, 5.0, 60), "soc0": 0.8}
    first = simulate(lg_m50, **asked).voltage_v
    second = simulate(lg_m50, **asked | other).voltage_v
    assert solved() == 2
    assert not np.array_equal(first, second)


def test_who_changes_an_answer_changes_nobody_elses(lg_m50: Cell, solved):
    first, second = (simulate(lg_m50, TIME_S, np.ones(60), soc0=0.8) for _ in range(2))
    kept = second.voltage_v.copy()
    first.voltage_v[:] = np.nan
    first.series["c_e0"][:] = np.nan
    third = simulate(lg_m50, TIME_S, np.ones(60), soc0=0.8)
    assert solved() == 1
    assert np.array_equal(third.voltage_v, kept)
    assert np.array_equal(third.series["c_e0"], second.series["c_e0"])


def test_what_is_timed_is_solved_anew(lg_m50: Cell, solved):
    simulate(lg_m50, TIME_S, np.ones(60), soc0=0.8)
    forget_solutions()
    simulate(lg_m50, TIME_S, np.ones(60), soc0=0.8)
    assert _cached_solution.cache_info().misses == 1
