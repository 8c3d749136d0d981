"""A cell that heats itself, simulated into a file: the temperature of its case, and the cooling that is assumed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.simulation import ProfileRequest, simulate_file

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
HEATED = ProfileRequest(soc0=0.95, self_heating=True, hold="backward")


@pytest.fixture
def profile(tmp_path) -> Path:
    time = np.arange(0.0, 600.0, 1.0)
    path = tmp_path / "profile.csv"
    pd.DataFrame({"time_s": time, "current_a": np.where(time < 10.0, 0.0, 8.5)}).to_csv(path, index=False)
    return path


@pytest.mark.parametrize("model", ["espm", "dfn"])
def test_the_temperature_of_a_winding_was_written_as_that_of_its_case(profile, tmp_path, model):
    """What was written was simulated again with a winding that was warmer than itself, 12 mV off in the mean."""
    cell = CELLS / "lg_18650hg2_cold.bpx.json"
    first, again = tmp_path / "first.csv", tmp_path / "again.csv"
    heated = simulate_file(cell, profile, first, HEATED, model=model)
    followed = simulate_file(cell, first, again, replace(HEATED, self_heating=False), model=model)
    assert np.ptp(heated.series["temperature_k"]) > 8.0
    assert followed.voltage_v == pytest.approx(heated.voltage_v, abs=2e-4)
    assert followed.series["temperature_k"] == pytest.approx(heated.series["temperature_k"], abs=0.05)
    written = pd.read_csv(first)
    assert written.temperature_k.to_numpy() == pytest.approx(heated.series["temperature_k"])
    # The case is nearer to the air by the share of the heat's way that lies outside, 1/(1 + h A R).
    of_file = Cell.from_bpx(cell)
    way = of_file.heat_transfer_w_m2_k * of_file.surface_area_m2 * of_file.winding_resistance_k_w
    rise = (written.temperature_degc - 25.0) / (written.temperature_k - 298.15)
    assert rise[100:].to_numpy() == pytest.approx(1.0 / (1.0 + way), rel=1e-5)


def test_a_winding_that_conducts_less_than_the_cell_gives_off_tells_no_case(profile, tmp_path):
    said, out = [], tmp_path / "out.csv"
    effect = CATALOGUE["self_heating"].activate(heat_transfer_w_k=1.0)
    cell = CELLS / "lg_18650hg2_cold.bpx.json"
    simulate_file(cell, profile, out, replace(HEATED, self_heating=False), [effect], say_notes=said.extend)
    assert "temperature_degc" not in pd.read_csv(out).columns
    assert any("gives off 1 W/K" in one and "temperature_degc is left out" in one for one in said)
