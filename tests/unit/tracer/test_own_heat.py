"""A cell in the cold that warms itself, whose temperature nobody measured."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE, self_heating
from aesi.records import Measurement
from aesi.tracer import discover, discovery
from aesi.tracer.decide.evidence import Evidence
from aesi.tracer.decide.own_heat import heat_of_file, with_heat_told

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.fixture(scope="module")
def m50():
    return Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")


@pytest.fixture(scope="module")
def cold_drive(m50):
    """An hour at -10 degC, in which the cell warms by its file's heat."""
    rng, time = np.random.default_rng(3), np.arange(0.0, 3600.0, 2.0)
    current = np.repeat(np.clip(rng.normal(2.5, 3.0, len(time) // 20), -2.0, 8.0), 20)
    current[:30] = 0.0
    truth = (self_heating.of_file(m50), CATALOGUE["ambient_temperature"].activate(shift_k=-35.0))
    run = simulate(m50, time, current, 0.85, truth)
    assert np.ptp(run.series["temperature_k"]) > 4.0
    return Measurement(
        time, current, run.voltage_v + 1e-3 * rng.normal(size=len(time)), name="cold", hold="linear"
    )


def test_the_temperature_of_a_cell_that_warms_itself_was_looked_for_as_a_constant_one(m50, cold_drive):
    effects = {name: CATALOGUE[name] for name in ("ambient_temperature", "self_heating", "series_resistance")}
    told = discover(m50, [cold_drive], soc0=0.85, max_effects=1, effects=effects)
    assert told.verdict.effects == ("ambient_temperature",)
    shift = told.candidates[0].parameters["shift_k"]
    assert shift.value == pytest.approx(-35.0, abs=1.0)
    assert shift.low < -35.0 < shift.high
    assert [active for active in told.model_effects if active.id == "self_heating"] == [
        self_heating.of_file(m50)
    ]
    assert any("warms itself by the thermal data" in note for note in told.notes)
    # Where self-heating is not to be tried, nothing warms.
    del effects["self_heating"]
    alone = discover(m50, [cold_drive], soc0=0.85, max_effects=1, effects=effects)
    assert not any(active.id == "self_heating" for active in alone.model_effects)


def case(
    m50,
    word="unknown",
    degc=None,
    competing=("self_heating",),
    cell=None,
    good=False,
    total=0.0,
    trust="tight",
):
    problem = SimpleNamespace(
        has_good=good,
        records=[SimpleNamespace(data=SimpleNamespace(temperature_degc=degc))],
        cell=cell or m50,
        competing=lambda: competing,
        trust=trust,
        fixed=(self_heating.of_file(m50),),
    )
    path = SimpleNamespace(problem=problem, chosen=SimpleNamespace(score=SimpleNamespace(total=total)))
    return SimpleNamespace(verdict=SimpleNamespace(word=word), path=path, paths={trust: path})


def test_the_heat_of_the_file_is_asked_where_it_is_known_and_nothing_explains_the_data(m50):
    assert heat_of_file(case(m50)) == self_heating.of_file(m50)
    assert heat_of_file(case(m50, word="found")) is None
    assert heat_of_file(case(m50, degc=np.zeros(3))) is None
    assert heat_of_file(case(m50, competing=())) is None
    assert heat_of_file(case(m50, good=True)) is None
    assert heat_of_file(case(m50, cell=replace(m50, heat_transfer_w_m2_k=None))) is None
    assert heat_of_file(case(m50, cell=replace(m50, specific_heat_j_kg_k=None))) is None


@pytest.mark.parametrize(("ahead", "told"), [(-3.1, False), (-2.9, True), (8.0, True)])
def test_the_heat_of_the_file_is_taken_unless_the_data_speak_against_it(m50, ahead, told):
    cold, warm = case(m50, total=10.0), case(m50, total=10.0 + ahead)
    evidence = Evidence(warm.path, warm.paths, None, None, warm.verdict)
    assert (with_heat_told(evidence, cold) is not None) == told


def test_records_that_no_warm_cell_can_have_given_are_answered_without_heat(m50, cold_drive, monkeypatch):
    checked = discovery.check_same_cell

    def refuses_heat(problem, record, run):
        if problem.fixed:
            raise DataError("another cell's")
        checked(problem, record, run)

    monkeypatch.setattr(discovery, "check_same_cell", refuses_heat)
    effects = {name: CATALOGUE[name] for name in ("self_heating", "series_resistance")}
    told = discover(m50, [cold_drive], soc0=0.85, max_effects=1, effects=effects)
    assert told.verdict.word == "unknown"
    assert not any("warms itself by the thermal data" in note for note in told.notes)
