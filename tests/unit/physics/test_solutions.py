"""What effects do not change is not solved again, and belongs to whoever asked for it."""

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.effect import Record
from aesi.physics.effects import CATALOGUE
from aesi.physics.model import EspmModel
from aesi.physics.solutions import Solutions


@pytest.fixture
def record() -> Record:
    time_s = np.arange(5.0)
    return Record(time_s, np.ones(5), None)


def _counted(
    solutions: Solutions, model: EspmModel, record: Record, soc0: float = 0.5
) -> tuple[int, np.ndarray]:
    solved = []

    def solve():
        solved.append(True)
        return np.full((6, len(record.time_s)), soc0), {"temperature_k": np.zeros(5)}, -1, 0

    rows, *_ = solutions.of("espm", model, record, soc0, "linear", solve)
    return len(solved), rows


def test_the_same_question_is_solved_once_and_another_one_anew(lg_m50: Cell, record: Record):
    solutions, model = Solutions(), EspmModel(lg_m50)
    assert _counted(solutions, model, record)[0] == 1
    assert _counted(solutions, model, record)[0] == 0
    assert _counted(solutions, model, record, soc0=0.6)[0] == 1
    assert _counted(solutions, model.with_cell(contact_resistance_ohm=1.0), record)[0] == 1
    warm = Record(record.time_s, record.current_a, np.full(5, 300.0))
    assert _counted(solutions, model, warm)[0] == 1
    assert _counted(solutions, model, Record(record.time_s, 2.0 * record.current_a, None))[0] == 1


def test_who_changes_an_answer_changes_nobody_elses(lg_m50: Cell, record: Record):
    solutions, model = Solutions(), EspmModel(lg_m50)
    _, first = _counted(solutions, model, record)
    first[:] = np.nan
    _, second = _counted(solutions, model, record)
    second[:] = np.nan
    assert np.array_equal(_counted(solutions, model, record)[1], np.full((6, 5), 0.5))


def test_the_oldest_are_forgotten_and_long_records_never_kept(lg_m50: Cell, record: Record):
    solutions, model = Solutions(most=2), EspmModel(lg_m50)
    for soc0 in (0.1, 0.2, 0.3):
        _counted(solutions, model, record, soc0)
    assert [_counted(solutions, model, record, soc0)[0] for soc0 in (0.3, 0.2, 0.1)] == [0, 0, 1]
    short = Solutions(most_rows=4)
    assert [_counted(short, model, record)[0] for _ in range(2)] == [1, 1]


def test_an_effect_on_the_voltage_is_added_to_what_is_remembered(lg_m50: Cell):
    time_s, current_a = np.arange(60.0), np.linspace(0.0, 5.0, 60)
    bare = simulate(lg_m50, time_s, current_a, soc0=0.8)
    contact = CATALOGUE["series_resistance"].activate(resistance_ohm=0.01)
    added = simulate(lg_m50, time_s, current_a, soc0=0.8, effects=[contact])
    assert added.voltage_v == pytest.approx(bare.voltage_v - 0.01 * current_a, abs=1e-12)
