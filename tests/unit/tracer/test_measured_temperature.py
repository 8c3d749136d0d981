"""A measured temperature is an input: every simulation runs at it, and nothing is found that would infer it."""

import json
from dataclasses import replace

import numpy as np

from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.discovery.discover import discovery_content
from aesi.pipeline.report.words.discoveries import short_finding
from aesi.tracer import discover
from aesi.tracer.case.fit_simulation import fit_simulation
from aesi.tracer.decide.temperatures import other_temperatures, still_contradicting, temperature_fault
from aesi.tracer.discovery import inverse_problem
from aesi.tracer.likelihood.model_state import ModelState

KINETICS = {"charge_transfer_kinetics": CATALOGUE["charge_transfer_kinetics"]}
TRIED = {n: CATALOGUE[n] for n in ("self_heating", "ambient_temperature", "series_resistance")}


def test_a_cold_record_is_explained_by_its_own_column(cell, make):
    data = make()
    cold = np.full(len(data), 10.0)
    voltage = simulate(cell, data.time_s, data.current_a, 0.9, temperature_degc=cold).voltage_v
    noise = 1e-3 * np.random.default_rng(3).normal(size=len(data))
    told = replace(data, voltage_v=voltage + noise, temperature_degc=cold)
    found = discover(cell, [told], soc0=0.9, effects=TRIED)
    assert found.verdict.word == "none"
    assert "ambient_temperature" not in {c.effect for c in found.candidates}
    assert any("simulated at 10 degC in every row, as stated" in note for note in found.notes)
    untold = discover(cell, [replace(told, temperature_degc=None)], soc0=0.9, effects=TRIED)
    assert untold.verdict.effects == ("ambient_temperature",)


def test_a_search_for_nothing_but_what_was_measured_ended_in_a_traceback(cell, make, recwarn):
    data = make(n=1200)
    told = replace(data, temperature_degc=np.full(len(data), 25.0))
    alone = {"self_heating": CATALOGUE["self_heating"]}
    found = discover(cell, [told], soc0=0.9, effects=alone)
    assert (found.verdict.word, found.candidates) == ("none", ())
    json.dumps(
        discovery_content(found), allow_nan=False
    )  # its margin was infinite, which JSON has no number for
    assert not [str(one.message) for one in recwarn if "invalid value" in str(one.message)]
    off = replace(told, voltage_v=told.voltage_v - 5e-3 * np.sign(told.current_a))
    unknown = discover(cell, [off], soc0=0.9, effects=alone).verdict
    assert unknown.word == "unknown"
    assert "with no effect added" in unknown.reason


def test_a_fit_at_a_measured_case_left_out_the_heat_capacity_that_a_simulation_has(cell, make):
    data, conducting = make(n=600), replace(cell, thermal_conductivity_w_m_k=0.3)
    heavy = [CATALOGUE["self_heating"].activate(heat_capacity_factor=3.0)]
    told = replace(data, temperature_degc=np.full(len(data), 25.0))
    fitted = fit_simulation(conducting, told, 0.9, heavy, "linear")
    run, file = (
        simulate(conducting, data.time_s, data.current_a, 0.9, effects, 25.0) for effects in (heavy, ())
    )
    assert np.array_equal(fitted.voltage_v, run.voltage_v)
    assert np.abs(run.voltage_v - file.voltage_v).max() > 1e-4


def warm_record(cell, make, column_degc):
    """A record at 35 degC whose column has one number in every row."""
    data = make()
    warm = np.full(len(data), 35.0)
    voltage = simulate(cell, data.time_s, data.current_a, 0.9, temperature_degc=warm).voltage_v
    noise = 1e-3 * np.random.default_rng(3).normal(size=len(data))
    return replace(data, voltage_v=voltage + noise, temperature_degc=np.full(len(data), column_degc))


def test_a_model_was_written_that_made_up_for_a_dead_temperature(cell, make):
    """Nine parameters at the ends of their ranges left three times what another temperature alone does."""
    problem = inverse_problem(cell, [warm_record(cell, make, 0.0)], soc0=0.9, effects=TRIED)
    others = other_temperatures(problem)
    assert others[0].there_degc in (30.0, 40.0)
    moved = ModelState(problem, {"soc0": {"0": 0.91}})
    fault = temperature_fault(moved, others)
    assert fault.startswith("the error on made is ")
    assert "with the fit at 0 degC" in fault
    assert fault.endswith("the fit compensates for a temperature that the record contradicts")
    assert temperature_fault(ModelState(problem), others) is None  # nothing was fitted
    as_good = {0: replace(others[0], there_v=others[0].left_v)}
    assert temperature_fault(moved, as_good) is None
    assert still_contradicting(moved, others) == others
    assert still_contradicting(ModelState(problem), others) == others
    assert still_contradicting(ModelState(problem), as_good) == {}


def test_a_temperature_that_the_record_contradicts_is_told(cell, make):
    found = discover(cell, [warm_record(cell, make, 0.0)], soc0=0.9, effects=TRIED)
    assert found.other_temperature == ("made",)
    assert found.warnings[0].startswith("made: its voltage contradicts its temperature. The error of ")
    fitted = next(f for f in found.files if f.part == "fit")
    assert np.array_equal(fitted.voltages["after"], fitted.voltages["before"])
    assert "the voltage of made contradicts its temperature" in short_finding(discovery_content(found))


def test_a_right_column_is_not_doubted(cell, make):
    found = discover(cell, [warm_record(cell, make, 35.0)], soc0=0.9, effects=TRIED)
    assert found.other_temperature == ()
    assert not any("contradicts" in warning for warning in found.warnings)


def test_slow_kinetics_at_a_right_temperature_were_told_as_a_contradiction_of_it(slow_kinetics):
    """What was found explained the record to the noise, and its temperature was doubted all the same."""
    cell, record = slow_kinetics
    assert other_temperatures(inverse_problem(cell, [record], soc0=0.9, effects=KINETICS))
    found = discover(cell, [record], soc0=0.9, effects=KINETICS, max_effects=1, model="espm")
    assert max(file.errors("after").rmse_v for file in found.files) < 1e-3
    assert found.other_temperature == ()
    assert not any("contradicts" in warning for warning in found.warnings)
    assert "contradicts" not in short_finding(discovery_content(found))


def test_a_dead_temperature_of_a_record_that_judges_was_taken_without_a_word(cell, make):
    right = warm_record(cell, make, 35.0)
    dead = replace(right, temperature_degc=np.zeros(len(right)), name="judge", time_s=right.time_s + 1e6)
    found = discover(cell, [right], [dead], soc0=0.9, effects=TRIED)
    assert found.other_temperature == ("judge",)
    assert found.warnings[0].startswith("judge: its voltage contradicts its temperature. The error of ")
    well = discover(
        cell, [right], [replace(dead, temperature_degc=right.temperature_degc)], soc0=0.9, effects=TRIED
    )
    assert well.other_temperature == ()
