"""The porous electrode against PyBaMM's DFN on fine meshes, and its own convergence.

Tolerances: PyBaMM itself, from 40 to 80 points across and from 40 to 60 in a particle, moves by 0.03 to 0.15 mV RMS on
these loads; ours moves by less than 0.01 mV from 5 to 10 points.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from aesi.bench.physics.published import published
from aesi.errors import InputError
from aesi.numerics.modes.collocation import gauss_layer
from aesi.numerics.modes.galerkin import gauss_lobatto
from aesi.physics import Cell, EspmModel, simulate
from aesi.physics.dfn.run import run_porous_electrode
from aesi.physics.effects import CATALOGUE
from aesi.physics.simulation import model_with

from .conftest import Peer, read

WANTED_MV, WANTED_LARGEST_MV = 0.5, 5.0  # what the project promises
REACHED_MV = (
    0.25  # anything above this is a step back: 0.03 to 0.2 mV were measured, most of it PyBaMM's mesh
)
DOUBLING_MV = 0.2
PUBLISHED_APART_MV = 0.3  # their mesh has 16 volumes a layer
LITHIUM = 1e-9
THROUGH, RADIAL = 40, 60


def rmse_mv(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2))) * 1e3


def pulses(capacity_ah, rate, seconds=500):
    """Rest, discharge and charge pulses with 0.1 s edges, 60 s each."""
    time = np.unique(np.concatenate([np.arange(0.0, seconds), np.arange(60.0, seconds, 60.0) + 0.1]))
    level = np.array([0.0, 1.0, 0.0, -0.6, 0.3, 1.0, 0.0, 0.5, 0.0])[((time - 0.05) // 60.0).astype(int)]
    return time, rate * capacity_ah * level


def loads(content, temperature_degc, rate):
    """A drive of the peer's cell to `rate` and pulses, at a temperature that both models are given."""
    cell = Cell.from_bpx(content)
    kelvin = temperature_degc + 273.15
    cell = replace(cell, initial_temperature_k=kelvin, ambient_temperature_k=kelvin)
    return cell, *pulses(cell.nominal_capacity_ah, rate)


@pytest.fixture(scope="module")
def nmc_pouch(shared_data):
    return json.loads((shared_data / "measured" / "about_energy_nmc" / "cell.bpx.json").read_text())


def agree(peer):
    ours = simulate(peer.cell, peer.time, peer.current, soc0=peer.soc0, model="dfn").voltage_v
    theirs = peer.voltage(model="DFN", through=THROUGH, radial=RADIAL, graded=True)
    error = rmse_mv(ours, theirs)
    assert error < WANTED_MV
    assert np.abs(ours - theirs).max() * 1e3 < WANTED_LARGEST_MV
    return error


def test_a_drive_to_3c(peer):
    assert agree(peer) < REACHED_MV


@pytest.mark.parametrize("temperature_degc", [25.0, 0.0])
def test_pulses_of_the_published_pouch_cell(nmc_pouch, temperature_degc):
    cell, time, current = loads(nmc_pouch, temperature_degc, 3.0)
    assert agree(Peer(cell.to_bpx(), cell, time, current)) < REACHED_MV


def test_pulses_of_the_lg_m50_to_2c():
    cell, time, current = loads(read("lg_m50_chen2020"), 25.0, 2.0)
    assert agree(Peer(cell.to_bpx(), cell, time, current)) < WANTED_MV


def test_it_says_something_else_than_the_single_particle(peer):
    voltages = [
        simulate(peer.cell, peer.time, peer.current, peer.soc0, model=m).voltage_v for m in ("espm", "dfn")
    ]
    assert rmse_mv(*voltages) > WANTED_MV / 2


def discharge(cell, rate):
    """Time and current of a full cell at a constant rate, for as long as its charge lasts."""
    time = np.arange(0.0, 3600.0 / rate)
    return time, np.where(time < 10.0, 0.0, rate * cell.nominal_capacity_ah)


def doubling_mv(cell, time, current, soc0):
    """(n,) mV by which twice the points and modes and half the steps move the voltage, to the cut-off."""
    model = EspmModel(cell)
    finer = replace(
        model,
        solid_order=2 * model.solid_order,
        electrode_points=2 * model.electrode_points,
        substep_s=0.5 * model.substep_s,
    )
    voltage, twice = (
        run_porous_electrode(m, time, current, None, soc0, "linear")[0][0] for m in (model, finer)
    )
    below = twice < cell.lower_voltage_v
    return 1e3 * (voltage - twice)[: int(np.argmax(below)) if below.any() else len(time)]


def test_twice_the_points_and_modes_change_nothing_that_matters(peer):
    assert np.abs(doubling_mv(peer.cell, peer.time, peer.current, peer.soc0)).max() < DOUBLING_MV


@pytest.mark.parametrize("degc", [25.0, 0.0])
@pytest.mark.parametrize(
    ("name", "rate"), [("lg_m50_chen2020", 2.0), ("nmc_30ah", 3.0), ("lfp_prada2013", 1.0)]
)
def test_twice_the_points_and_modes_change_nothing_that_matters_in_a_discharge_from_full_to_empty(
    name, rate, degc
):
    cell = replace(
        Cell.from_bpx(read(name)), initial_temperature_k=degc + 273.15, ambient_temperature_k=degc + 273.15
    )
    error = doubling_mv(cell, *discharge(cell, rate), 1.0)
    assert len(error) > 0.75 * 3600.0 / rate  # it does run empty
    assert np.sqrt(np.mean(error**2)) < DOUBLING_MV


def salt_content(cell, nodes, degree):
    """(n,) mol/m2, by quadrature over the three layers."""
    weight = 0.5 * gauss_lobatto(degree + 1)[1]
    layers = (cell.negative, cell.separator, cell.positive)
    parts = [nodes[:, k * degree : (k + 1) * degree + 1] @ weight for k in range(3)]
    return sum(x.porosity * x.thickness_m * part for x, part in zip(layers, parts, strict=True))


def layer_charge_ah(model, potential_v):
    """(2,) Ah that the double layers of each electrode have taken, which particles gave up."""
    layer = gauss_layer(model.electrode_points)
    moved = np.split(potential_v[-1] - potential_v[0], 2)
    sides = (
        (model.cell.negative, model.negative, layer.weight),
        (model.cell.positive, model.positive, layer.weight),
    )
    return [
        x.area_per_volume_1_m
        * x.thickness_m
        * face.double_layer_f_m2
        * model.cell.total_area_m2
        / 3600.0
        * float((weight if side == 0 else weight[::-1]) @ moved[side])
        for side, (x, face, weight) in enumerate(sides)
    ]


VARYING = {"negative_slope": -1.5, "positive_slope": 1.0}


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"particle_size_distribution": {}},
        {"concentration_dependent_diffusivity": VARYING},
        {"double_layer": {}, "self_heating": {}},
    ],
    ids=lambda effects: "+".join(effects) or "none",
)
def test_lithium_is_kept_in_each_electrode_and_salt_in_the_electrolyte(peer, effects):
    active = [CATALOGUE[name].activate(**values) for name, values in effects.items()]
    model, profiles = model_with(peer.cell, active), {}
    rows = run_porous_electrode(model, peer.time, peer.current, None, peer.soc0, "linear", profiles=profiles)[
        0
    ]
    passed = float(np.trapezoid(peer.current, peer.time)) / 3600.0
    assert abs(passed) > 0.01 * peer.cell.capacity_ah
    stored = layer_charge_ah(model, profiles["potential_v"])
    for row, electrode, sign in ((5, peer.cell.negative, -1.0), (6, peer.cell.positive, 1.0)):
        gained = (rows[row, -1] - rows[row, 0]) * peer.cell.electrode_capacity_ah(electrode)
        assert gained - stored[row - 5] == pytest.approx(sign * passed, rel=LITHIUM)
    content = salt_content(peer.cell, profiles["electrolyte_nodes_mol_m3"], model.electrode_points)
    assert np.ptp(profiles["electrolyte_nodes_mol_m3"][-1]) > 100.0
    assert np.abs(content / content[0] - 1.0).max() < LITHIUM


def test_the_published_records_have_the_published_errors(shared_data, monkeypatch):
    monkeypatch.setenv("AESI_DATA", str(shared_data))
    rows = [row for row in published() if "error" not in row]
    assert len(rows) >= 4  # the discharge at 2C is not in every copy of the set
    assert max(row["apart_mv"] for row in rows) < PUBLISHED_APART_MV


def test_no_other_model_is_there(peer):
    with pytest.raises(InputError, match="'espm'"):
        simulate(peer.cell, peer.time, peer.current, peer.soc0, model="p2d")
