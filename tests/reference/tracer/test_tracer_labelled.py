"""Labelled cases that another program made: the two quickest by default, all of them when asked (-m slow)."""

import json

import pytest

from aesi.bench.scoring import is_right
from aesi.data import read_measurement
from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.discovery.discover import discovery_content
from aesi.tracer import discover

CHEAP = (
    "series_resistance",
    "ocv_hysteresis",
    "current_sensor_gain",
    "current_sensor_offset",
    "voltage_sensor_offset",
    "electrolyte_transport",
    "solid_diffusivity",
    "ambient_temperature",
)


def traced(shared_data, name, effects=CATALOGUE):
    label = json.loads((shared_data / "virtual" / "labels.json").read_text())[name]
    cell = Cell.from_bpx(shared_data / "measured" / "about_energy_nmc" / "cell.bpx.json")
    data = read_measurement(shared_data / "virtual" / f"{name}.csv")
    return label, discovery_content(discover(cell, [data], soc0=label["soc0"], effects=effects))


@pytest.mark.parametrize("name", ["v01", "v03"])
def test_quick_cases_among_cheap_effects(shared_data, name):
    label, content = traced(shared_data, name, {k: CATALOGUE[k] for k in CHEAP})
    assert is_right(label["label"], tuple(label["also"]), content)
    assert content["after"]["test"]["rmse_mv"] < 1.3 * content["noise_floor_mv"]


@pytest.mark.slow
@pytest.mark.parametrize("number", range(1, 9))
def test_every_case_among_all_effects(shared_data, number):
    label, content = traced(shared_data, f"v{number:02d}")
    assert is_right(label["label"], tuple(label["also"]), content)
    if content["verdict"] == "found":
        assert content["after"]["test"]["rmse_mv"] < 1.3 * content["noise_floor_mv"]
