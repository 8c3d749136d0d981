"""A measured temperature is an input: every simulation runs at it, and nothing is found that would infer it."""

import json
from dataclasses import replace

import numpy as np

from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.discovery.discover import discovery_content
from aesi.tracer import discover

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
    assert any("simulated at 10 degC in every row, as its column states" in note for note in found.notes)
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
