"""Both models of a cell answer in the same names, and a saved model keeps which one it is."""

from pathlib import Path

import numpy as np
import pytest

from aesi.errors import InputError, SimulationError
from aesi.physics import Cell, simulate
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.simulation import ProfileRequest, simulate_file

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
CELL = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
TIME = np.arange(0.0, 120.0)
CURRENT = 60.0 * np.sign(np.sin(TIME / 10.0))

HELD_V = 5e-5  # what steps of 1 s leave: 0.02 mV against steps of 10 ms, 0.7 mV where a short step was extrapolated


def voltage(**options):
    return simulate(CELL, TIME, CURRENT, 0.7, **options).voltage_v


def test_the_states_have_the_same_names():
    espm, dfn = (simulate(CELL, TIME, CURRENT, 0.7, model=m) for m in ("espm", "dfn"))
    assert list(espm.series) == list(dfn.series)
    assert espm.series["soc"][-1] == pytest.approx(dfn.series["soc"][-1], abs=1e-9)


def test_held_rows_are_steps_of_the_current():
    edges = np.unique(np.concatenate([TIME, TIME[:-1] + 1e-6]))
    held = CURRENT[np.searchsorted(TIME, edges)]
    steps = simulate(CELL, edges, held, 0.7, model="dfn").voltage_v[np.isin(edges, TIME)]
    assert np.abs(voltage(model="dfn", hold="backward") - steps).max() < HELD_V


def test_a_saved_model_keeps_which_one_it_is(tmp_path):
    HybridModel(CELL, soc0=0.7, model="dfn").save(tmp_path / "model")
    current = tmp_path / "current.csv"
    np.savetxt(
        current, np.column_stack([TIME, CURRENT]), delimiter=",", header="time_s,current_a", comments=""
    )
    run = simulate_file(tmp_path / "model", current, tmp_path / "out.csv", ProfileRequest(hold="linear"))
    assert (run.voltage_v == voltage(model="dfn")).all()
    asked = simulate_file(
        tmp_path / "model", current, tmp_path / "out.csv", ProfileRequest(hold="linear"), model="espm"
    )
    assert (asked.voltage_v == voltage()).all()
    predicted = HybridModel.load(tmp_path / "model").predict(TIME, CURRENT, 0.7)
    assert (predicted.voltage_v == voltage(model="dfn")).all()


def test_a_cell_that_runs_empty_says_which_electrode_ran_out():
    time = np.arange(0.0, 4000.0, 5.0)
    with pytest.raises(SimulationError, match="surface of the"):
        simulate(CELL, time, np.full(len(time), 60.0), 0.5, model="dfn")
    clipped = simulate(CELL, time, np.full(len(time), 60.0), 0.5, model="dfn", on_depletion="clip")
    assert np.isfinite(clipped.voltage_v).all()
    assert clipped.series["depleted"][-1] == 1.0
    whole = clipped.series["depleted"] == 0.0
    assert clipped.voltage_v[whole].min() < CELL.lower_voltage_v  # followed to the cut-off and beyond


def test_profiles_across_the_electrodes_add_up_to_the_current():
    run = simulate(CELL, TIME, CURRENT, 0.7, model="dfn", profiles=True)
    x, reaction = run.profiles["x_m"], run.profiles["reaction_a_m2"]
    half = len(x) // 2
    assert (np.diff(x) > 0).all()
    assert reaction.shape == (len(TIME), len(x))
    weight = 0.5 * np.polynomial.legendre.leggauss(half)[1]
    n, p = CELL.negative, CELL.positive
    for side, electrode, sign in ((slice(0, half), n, 1.0), (slice(half, None), p, -1.0)):
        area = electrode.area_per_volume_1_m * electrode.thickness_m * CELL.total_area_m2
        assert reaction[:, side] @ weight * area == pytest.approx(sign * CURRENT, abs=1e-9)
    discharging = CURRENT > 0
    near, far = run.profiles["electrolyte_mol_m3"][discharging][-1, [half - 1, half]]
    assert near > far  # salt is released in the negative electrode and taken up in the positive
    with pytest.raises(InputError, match="dfn"):
        simulate(CELL, TIME, CURRENT, 0.7, profiles=True)
