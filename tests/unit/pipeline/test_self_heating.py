"""A cell that heats itself, simulated into a file: the temperature of its case, and the cooling that is assumed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.physics.effects.self_heating import of_file
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
    assert np.ptp(heated.series["temperature_k"]) > 5.0
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


def test_a_heat_capacity_that_counts_at_a_measured_case_was_told_to_add_nothing(profile, tmp_path):
    cell, measured, said = CELLS / "lg_18650hg2.bpx.json", tmp_path / "measured.csv", {}
    pd.read_csv(profile).assign(temperature_degc=30.0).to_csv(measured, index=False)
    for factor in (1.0, 0.5):
        effect = CATALOGUE["self_heating"].activate(heat_capacity_factor=factor)
        told: list[str] = []
        run = simulate_file(cell, measured, tmp_path / "out.csv", HEATED, [effect], say_notes=told.extend)
        said[factor] = run.series["temperature_k"][300], " ".join(told)
    assert said[0.5][0] > said[1.0][0] + 0.1
    assert "self_heating has nothing to add but the cell's heat capacity." in said[0.5][1]
    stated = "at 30 degC in every row, as stated, for its case: the winding is warmer under load"
    assert f"{stated}; self_heating has nothing to add." in said[1.0][1]


def scaled(cell: Cell, factor: float) -> Cell:
    """A cell of the same make, that many times as large."""
    return replace(
        cell,
        electrode_area_m2=factor * cell.electrode_area_m2,
        nominal_capacity_ah=factor * cell.nominal_capacity_ah,
        volume_m3=factor * cell.volume_m3,
        surface_area_m2=None if cell.surface_area_m2 is None else factor ** (2 / 3) * cell.surface_area_m2,
    )


@pytest.mark.parametrize("of_surface", [True, False])
def test_a_cell_of_any_size_gave_off_its_heat_through_one_conductance(of_surface):
    """0.2 W/K where the file declares none: of a 0.2 Ah and a 440 Ah cell alike, within 20 s and 11 h."""
    kim = Cell.from_bpx(CELLS / "nca_kim2011.bpx.json")
    bare = replace(kim, heat_transfer_w_m2_k=None)
    bare = bare if of_surface else replace(bare, surface_area_m2=None)
    small, own, large = (of_file(scaled(bare, f)).parameters["heat_transfer_w_k"] for f in (0.01, 1.0, 20.0))
    assert small / own == pytest.approx(0.01 ** (2 / 3))
    assert large / own == pytest.approx(20.0 ** (2 / 3))
    declared = of_file(kim).parameters["heat_transfer_w_k"]
    assert declared == kim.conductance_w_k
    assert own == declared if of_surface else declared / 3.0 < own < declared


def test_a_cooling_that_the_file_does_not_declare_was_told_as_if_it_did(profile, tmp_path):
    nmc, kim = CELLS / "nmc_30ah.bpx.json", CELLS / "nca_kim2011.bpx.json"
    said: dict[Path, list[str]] = {nmc: [], kim: []}
    for cell, told in said.items():
        simulate_file(cell, profile, tmp_path / "out.csv", HEATED, say_notes=told.extend)
    words = "the cell's file has no 'Heat transfer coefficient [W.m-2.K-1]'"
    assert [one for one in said[nmc] if one.startswith(words) and "typical of still air" in one]
    assert not [one for one in said[kim] if one.startswith("the cell's file has no")]
    measured = tmp_path / "measured.csv"
    pd.read_csv(profile).assign(temperature_degc=30.0).to_csv(measured, index=False)
    followed: list[str] = []
    simulate_file(nmc, measured, tmp_path / "out.csv", HEATED, say_notes=followed.extend)
    assert not [one for one in followed if one.startswith("the cell's file has no")]
