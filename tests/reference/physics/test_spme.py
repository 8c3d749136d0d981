"""The model against PyBaMM's SPMe on a fine mesh (60 radial points), and its own convergence."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest

from aesi.physics import Cell, EspmModel, simulate
from aesi.physics.cell.relations import Constant
from aesi.physics.espm.plain import run_plain

from .conftest import Peer, read

FULL_SOC = 1.0
WANTED_MV, WANTED_CONSTANT_MV = 1.5, 0.5  # what the project promises
REACHED_MV = 0.1  # 0.04 mV was measured: anything above this is a step back
DOUBLING_MV = 0.1
SLOW_MV = 0.03  # 0.013 mV was measured; polynomials in the radius itself leave 0.29


def rmse_mv(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2))) * 1e3


@pytest.fixture(scope="module")
def measured(shared_data) -> Peer:
    """The measured drive cycle's current (1 Hz, to 3C) and the published parameters, until the cell is empty."""
    folder = shared_data / "measured" / "about_energy_nmc"
    content = json.loads((folder / "cell.bpx.json").read_text())
    table = np.genfromtxt(folder / "drive_cycle.csv", delimiter=",", names=True)[:8000]
    time, current = (np.ascontiguousarray(table[name]) for name in ("time_s", "current_a"))
    return Peer(content, Cell.from_bpx(content), time, current, FULL_SOC)


def constant_transport(content: dict) -> dict:
    """The same file with the electrolyte's properties held at their rest values."""
    held = copy.deepcopy(content)
    electrolyte = Cell.from_bpx(content).electrolyte
    at_rest = np.array([electrolyte.c0_mol_m3])
    fields = held["Parameterisation"]["Electrolyte"]
    fields["Conductivity [S.m-1]"] = float(electrolyte.conductivity(at_rest)[0])
    fields["Diffusivity [m2.s-1]"] = float(electrolyte.diffusivity(at_rest)[0])
    return held


def test_the_measured_drive_cycle(measured):
    ours = simulate(measured.cell, measured.time, measured.current, soc0=FULL_SOC)
    error = rmse_mv(ours.voltage_v, measured.voltage())
    assert error < WANTED_MV
    assert error < REACHED_MV


def test_the_measured_drive_cycle_with_constant_transport(measured):
    held = constant_transport(measured.content)
    cell = Cell.from_bpx(held)
    assert isinstance(cell.electrolyte.diffusivity, Constant)
    first = slice(0, 3000)
    part = Peer(held, cell, measured.time[first], measured.current[first], FULL_SOC)
    ours = simulate(cell, part.time, part.current, soc0=FULL_SOC)
    error = rmse_mv(ours.voltage_v, part.voltage())
    assert error < WANTED_CONSTANT_MV
    assert error < REACHED_MV


def test_twice_the_order_changes_nothing_that_matters_on_the_measured_drive_cycle(measured):
    model = EspmModel(measured.cell)
    finer = replace(model, solid_order=2 * model.solid_order, electrolyte_order=2 * model.electrolyte_order)
    rows, twice = (
        run_plain(m, measured.time, measured.current, FULL_SOC, "linear")[0] for m in (model, finer)
    )
    assert np.abs(rows[0] - twice[0]).max() * 1e3 < DOUBLING_MV


def test_lithium_is_kept_over_the_measured_drive_cycle(measured):
    run = simulate(measured.cell, measured.time, measured.current, soc0=FULL_SOC)
    passed = np.trapezoid(measured.current, measured.time) / 3600.0
    lost = (run.series["soc"][0] - run.series["soc"][-1]) * measured.cell.capacity_ah
    assert lost == pytest.approx(passed, rel=1e-9)


def test_states_follow_the_peer(peer):
    solution = peer.solve()
    ours = simulate(peer.cell, peer.time, peer.current, soc0=peer.soc0)
    names = {"c_sn": "X-averaged negative particle", "c_sp": "X-averaged positive particle"}
    for state, name in names.items():
        theirs = solution[f"{name} surface concentration [mol.m-3]"](peer.time)
        assert ours.series[state] == pytest.approx(theirs, rel=2e-3)  # 60 finite volumes at a steep surface
    salt = solution["Electrolyte concentration [mol.m-3]"](peer.time)
    assert ours.series["c_e0"] == pytest.approx(
        salt[0], rel=5e-3
    )  # the peer's first point is half a volume in
    assert ours.series["c_eL"] == pytest.approx(salt[-1], rel=5e-3)


def test_another_cell_with_slow_particles(peer):
    content = read("lg_m50_chen2020")
    cell = Cell.from_bpx(content)
    other = Peer(content, cell, peer.time, peer.current * 0.7 * cell.nominal_capacity_ah / 30.0)
    ours = simulate(cell, other.time, other.current, soc0=other.soc0)
    assert (
        rmse_mv(ours.voltage_v, other.voltage(radial=100)) < 0.5
    )  # 0.23 mV over an hour; D / R^2 is 1.5e-4 1/s


def test_particles_in_which_diffusion_is_ten_times_as_slow(peer):
    """A second of diffusion reaches 0.3 % of the radius, and the potential of graphite bends there."""
    content = read("lfp_prada2013")
    content["Parameterisation"]["Negative electrode"]["Diffusivity [m2.s-1]"] /= 10.0
    cell = Cell.from_bpx(content)
    current = peer.current * cell.nominal_capacity_ah / peer.cell.nominal_capacity_ah / 3.0  # to 1C
    other = Peer(content, cell, peer.time, current, soc0=0.8)
    ours = simulate(cell, other.time, other.current, soc0=other.soc0)
    theirs = other.voltage(radial=120, graded=True, stretch=5.0)
    assert rmse_mv(ours.voltage_v, theirs) < SLOW_MV


def test_a_diffusivity_that_falls_by_four_decades_within_the_window_was_held_at_a_thousandth(peer):
    """As a staging plateau does: what the file declares was raised to a thousandth of its value at x = 1/2."""
    content = read("nmc_30ah")
    x = np.linspace(0.0, 1.0, 41)
    falls = 1e-12 * 10.0 ** (-4.2 * np.clip((x - 0.5) / 0.27, 0.0, 1.0))
    content["Parameterisation"]["Negative electrode"]["Diffusivity [m2.s-1]"] = {
        "x": x.tolist(),
        "y": falls.tolist(),
    }
    steep = Peer(content, Cell.from_bpx(content), peer.time, peer.current / 6.0, soc0=0.97)
    ours = simulate(steep.cell, steep.time, steep.current, soc0=steep.soc0)
    assert rmse_mv(ours.voltage_v, steep.voltage(radial=120, graded=True)) < SLOW_MV


def test_the_bundled_lg_m50_is_pybamms_chen2020(peer):
    import pybamm

    content = read("lg_m50_chen2020")
    cell = Cell.from_bpx(content)
    native = pybamm.ParameterValues("Chen2020")
    theta = {"negative": cell.stoichiometries(0.5)[0], "positive": cell.stoichiometries(0.5)[1]}
    for side, electrode in (("negative", cell.negative), ("positive", cell.positive)):
        x = np.array([0.3, theta[side], 0.8])
        ocp = native[f"{side.capitalize()} electrode OCP [V]"]
        assert electrode.ocp(x) == pytest.approx(
            [float(ocp(v).evaluate()) if hasattr(ocp(v), "evaluate") else ocp(v) for v in x]
        )
        c_max = native[f"Maximum concentration in {side} electrode [mol.m-3]"]
        rate = native[f"{side.capitalize()} electrode exchange-current density [A.m-2]"]
        j0 = float(
            rate(pybamm.Scalar(1000.0), pybamm.Scalar(0.5 * c_max), c_max, pybamm.Scalar(298.15)).evaluate()
        )
        assert 96485.33212 * electrode.rate_constant * 0.5 == pytest.approx(j0, rel=1e-6)
        fraction = native[f"{side.capitalize()} electrode active material volume fraction"]
        assert electrode.active_fraction == pytest.approx(fraction, rel=1e-6)
