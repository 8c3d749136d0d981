"""What `aesi export` writes runs in PyBaMM and gives the voltage that this package gives.

2 mV: the single-particle models of both agree to that on this cell at 1C; 3 mV with asymmetric kinetics, which PyBaMM
solves for the surface where this package averages over the electrode (20 mV is what the effect moves).
"""

import runpy
from dataclasses import replace
from pathlib import Path

import bpx
import numpy as np
import pytest

import aesi
from aesi.errors import InputError
from aesi.physics.effects import CATALOGUE
from aesi.physics.folded import folded
from aesi.pipeline.export import export
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.product.hybrid import HybridModel

CELL = Path(__file__).resolve().parents[2] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
TIME = np.arange(0.0, 1201.0, 10.0)
CURRENT = np.where((TIME // 300) % 2 == 0, 5.0, -2.0)
INSIDE = (
    CATALOGUE["series_resistance"].activate(resistance_ohm=8e-3),
    CATALOGUE["solid_diffusivity"].activate(negative_factor=0.6, positive_factor=1.5),
    CATALOGUE["electrolyte_transport"].activate(),
)
OPTIONAL = (CATALOGUE["asymmetric_kinetics"].activate(),)


@pytest.fixture(scope="module")
def cell():
    return aesi.Cell.from_bpx(CELL)


def saved(cell, effects, folder):
    return HybridModel(cell, effects, soc0=0.8).save(folder / "model")


def test_a_folded_cell_is_the_cell_with_its_effects(cell):
    found = folded(cell, (*INSIDE, *OPTIONAL, CATALOGUE["voltage_sensor_offset"].activate(offset_v=2e-3)))
    assert found.held == INSIDE
    assert [effect.id for effect in found.left] == [
        "asymmetric_kinetics",
        "voltage_sensor_offset",
    ]
    assert found.same_window(cell)
    with_effects = aesi.simulate(cell, TIME, CURRENT, soc0=0.8, effects=INSIDE).voltage_v
    np.testing.assert_allclose(
        aesi.simulate(found.cell, TIME, CURRENT, soc0=0.8).voltage_v, with_effects, atol=1e-9
    )


def test_lost_lithium_moves_the_window(cell):
    found = folded(cell, [CATALOGUE["lithium_inventory_loss"].activate(loss=0.1)])
    assert found.held
    assert not found.same_window(cell)


def test_a_written_bpx_file_gives_the_same_voltage(cell, tmp_path):
    done = export(saved(cell, INSIDE, tmp_path), tmp_path / "found.json", "bpx")
    assert any("User-defined" in sentence for sentence in done.left)
    again = aesi.Cell.from_bpx(done.files[0])
    # whose values they were, and that some are others now
    assert again.description.startswith(cell.description)
    assert "Values changed by series_resistance(resistance_ohm=0.008), solid_diff" in again.description
    ours = aesi.simulate(cell, TIME, CURRENT, soc0=0.8, effects=INSIDE).voltage_v
    np.testing.assert_allclose(aesi.simulate(again, TIME, CURRENT, soc0=0.8).voltage_v, ours, atol=1e-5)


@pytest.mark.parametrize("effects", [(), INSIDE, OPTIONAL], ids=["declared", "in the file", "as options"])
def test_pybamm_runs_the_script_and_agrees(cell, tmp_path, effects):
    done = export(saved(cell, effects, tmp_path), tmp_path / "found.py", "pybamm")
    assert not done.left
    script = runpy.run_path(str(done.files[0]))
    bends = np.unique(
        np.concatenate([[0.0], TIME[1:][np.diff(CURRENT) != 0], TIME[:-1][np.diff(CURRENT) != 0], TIME[-1:]])
    )
    solution = script["simulation"](TIME, CURRENT, soc0=0.8).solve(t_eval=bends, t_interp=TIME)
    theirs = np.asarray(solution["Voltage [V]"](TIME))
    ours = aesi.simulate(cell, TIME, CURRENT, soc0=0.8, effects=effects).voltage_v
    plain = aesi.simulate(cell, TIME, CURRENT, soc0=0.8).voltage_v
    error_mv = 1e3 * np.sqrt(np.mean((theirs - ours) ** 2))
    assert error_mv < (3.0 if effects == OPTIONAL else 2.0)
    if effects:
        assert error_mv < 0.5 * 1e3 * np.sqrt(np.mean((ours - plain) ** 2))


def test_pybamm_ran_the_script_at_the_temperature_of_the_surroundings(cell, tmp_path):
    cold = replace(cell, initial_temperature_k=273.15)
    done = export(saved(cold, (), tmp_path), tmp_path / "cold.py", "pybamm")
    script = runpy.run_path(str(done.files[0]))
    solution = script["simulation"](TIME[:31], np.full(31, 2.0), soc0=0.8).solve(
        t_eval=[0.0, 300.0], t_interp=TIME[:31]
    )
    ours = aesi.simulate(cold, TIME[:31], np.full(31, 2.0), soc0=0.8).voltage_v
    np.testing.assert_allclose(np.asarray(solution["Voltage [V]"](TIME[:31])), ours, atol=2e-3)


def test_what_was_found_with_the_porous_electrode_was_written_for_the_single_particle(cell, tmp_path):
    """2 mV, as above; the two models are 5 mV apart here."""
    found = HybridModel(cell, INSIDE, soc0=0.8, model="dfn").save(tmp_path / "model")
    written = export(found, tmp_path / "found.json", "bpx").files[0]
    assert declared_model(written).model == "dfn"
    single = export(saved(cell, INSIDE, tmp_path / "single"), tmp_path / "single.json", "bpx").files[0]
    assert declared_model(single).model == "espm"
    script = runpy.run_path(str(export(found, tmp_path / "found.py", "pybamm").files[0]))
    theirs = script["simulation"](TIME, CURRENT, soc0=0.8).solve()["Voltage [V]"](TIME)
    porous, particle = (
        aesi.simulate(cell, TIME, CURRENT, soc0=0.8, effects=INSIDE, model=model).voltage_v
        for model in ("dfn", "espm")
    )
    error_v = [np.sqrt(np.mean((theirs - ours) ** 2)) for ours in (porous, particle)]
    assert error_v[0] < 2e-3 < error_v[1]


def test_what_a_target_cannot_hold_is_said(cell, tmp_path):
    growing = CATALOGUE["film_growth"].activate()
    model = saved(cell, (growing,), tmp_path)
    for target, name in (("bpx", "a.json"), ("pybamm", "a.py")):
        done = export(model, tmp_path / name, target)
        assert len(done.left) == 1
        assert done.left[0].startswith("film_growth (")
    with pytest.raises(InputError, match=r"\.py"):
        export(model, tmp_path / "a.json", "pybamm")


@pytest.mark.parametrize("name", ["lg_18650hg2", "panasonic_ncr18650pf"])
def test_a_calibrated_file_is_read_by_the_standard(tmp_path, name):
    out = tmp_path / "cell.bpx.json"
    shipped = Path(__file__).resolve().parents[2] / "experiments" / "cells" / f"{name}.bpx.json"
    export(shipped, out, "bpx")
    bpx.parse_bpx_file(str(out))


def test_the_script_missed_steps_of_a_drive_by_millivolts(cell, tmp_path):
    script = runpy.run_path(str(export(saved(cell, (), tmp_path), tmp_path / "found.py", "pybamm").files[0]))
    time_s = np.arange(0.0, 121.0)
    current_a = np.select([time_s < 20.0, time_s < 60.0, time_s < 80.0], [0.0, -4.5, 14.0], 2.0)
    solution = script["simulation"](time_s, current_a, soc0=0.7).solve(t_eval=time_s, t_interp=time_s)
    ours = aesi.simulate(cell, time_s, current_a, soc0=0.7).voltage_v
    assert 1e3 * np.abs(np.asarray(solution["Voltage [V]"](time_s)) - ours).max() < 2.5


def test_the_script_did_not_say_how_pulses_are_stepped_over(cell, tmp_path):
    """104 mV and the whole charge of two pulses were lost by solve([0, end]), as PyBaMM's examples solve."""
    script = runpy.run_path(str(export(saved(cell, (), tmp_path), tmp_path / "found.py", "pybamm").files[0]))
    assert "Solve a current by solve()" in script["simulation"].__doc__
    time_s = np.arange(0.0, 1801.0)
    current_a = np.where(np.isin(time_s // 10, (60, 120)), 15.0, 0.0)
    solution = script["simulation"](time_s, current_a, soc0=0.7).solve()
    passed_ah = float(solution["Discharge capacity [A.h]"](time_s[-1]))
    assert passed_ah == pytest.approx(np.trapezoid(current_a, time_s) / 3600.0, rel=2e-3)
