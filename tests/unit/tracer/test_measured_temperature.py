"""A measured temperature is an input: every simulation runs at it, and nothing is found that would infer it."""

from dataclasses import replace

import numpy as np

from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
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
    assert any("measured temperature, 10.0 to 10.0 degC" in note for note in found.notes)
    untold = discover(cell, [replace(told, temperature_degc=None)], soc0=0.9, effects=TRIED)
    assert untold.verdict.effects == ("ambient_temperature",)
