"""The laboratory: the cell does what it was told, and says when it cannot."""

import json
from dataclasses import replace

import numpy as np
import pytest

from aesi.data.laboratory.changes import CHANGES, find_change
from aesi.data.laboratory.instrument import Instrument
from aesi.data.laboratory.mixing import porous_electrode
from aesi.data.laboratory.simulator import Applied, Setup, TrueRun, edges, parameter_values, simulate_truth
from aesi.data.profiles.profile import Profile, ProfileBuilder
from aesi.errors import DataError, SimulationError
from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE

pytestmark = pytest.mark.usefixtures("laboratory_cache")

BUILDER = ProfileBuilder(30.0, 1.0)


def short(soc0=0.6) -> Profile:
    """Rest, a 1C pulse, rest, a 2C charge pulse, rest: 160 s."""
    pieces = [
        BUILDER.rest(20),
        BUILDER.pulse(1.0, 40),
        BUILDER.rest(30),
        BUILDER.pulse(-2.0, 20),
        BUILDER.rest(50),
    ]
    return BUILDER.profile("short", pieces, soc0)


def voltage(nmc, *applied, model="SPMe", soc0=0.6):
    return simulate_truth(Setup(nmc, model, applied), short(soc0)).voltage_v


def test_the_solver_stops_on_both_sides_of_every_step():
    stops = edges(short())
    for time in (0, 19, 20, 59, 60, 89, 90, 109, 110, 159):
        assert time in stops


def test_a_short_pulse_after_a_long_rest_is_not_stepped_over(nmc):
    # PyBaMM's issue 5145: without break points the solver steps over such a pulse.
    pieces = [BUILDER.rest(3000), BUILDER.pulse(2.0, 5), BUILDER.rest(1000)]
    trace = simulate_truth(Setup(nmc, "SPMe"), BUILDER.profile("late", pieces, 0.6))
    assert trace.voltage_v[2000] - trace.voltage_v[3002] > 0.05


def test_rows_between_those_of_a_profile_are_simulated_and_no_straight_lines(nmc):
    coarse, fine = (simulate_truth(Setup(nmc, "SPMe"), short(), between) for between in (1, 4))
    np.testing.assert_allclose(fine.time_s[::4], coarse.time_s)
    np.testing.assert_allclose(fine.voltage_v[::4], coarse.voltage_v, atol=2e-5)
    lines = np.interp(fine.time_s, coarse.time_s, coarse.voltage_v)
    assert np.max(np.abs(fine.voltage_v - lines)) > 1e-3


def test_a_contact_resistance_is_a_drop_of_r_times_i(nmc):
    added = voltage(nmc, Applied("series_resistance", {"resistance_ohm": 1e-3})) - voltage(nmc)
    # 1e-6 relative tolerance of the solver on 3.7 V.
    np.testing.assert_allclose(added, -1e-3 * short().current_a, atol=2e-5)


def test_the_contact_resistance_of_a_cell_file_is_in_every_run(nmc, tmp_path):
    contacted = tmp_path / "contacted.bpx.json"
    cell = replace(Cell.from_bpx(nmc), contact_resistance_ohm=5e-4)
    contacted.write_text(json.dumps(cell.to_bpx()), encoding="utf-8")
    np.testing.assert_allclose(voltage(contacted) - voltage(nmc), -5e-4 * short().current_a, atol=2e-5)
    more = Applied("series_resistance", {"resistance_ohm": 1e-3})
    np.testing.assert_allclose(
        voltage(contacted, more) - voltage(nmc), -1.5e-3 * short().current_a, atol=2e-5
    )


def test_slow_particles_are_resolved_at_their_surface(m50):
    """The symptom: 60 even radial points left 0.4 mV between two solvers of the same equations on the LG M50."""
    builder = ProfileBuilder(5.0, 1.0)
    pieces = [piece for rate in (2.0, -1.0, 1.5) for piece in (builder.pulse(rate, 30), builder.rest(60))]
    profile = builder.profile("pulses", [builder.rest(20), *pieces], 0.7)
    other = simulate_truth(Setup(m50, "SPMe"), profile).voltage_v
    ours = simulate(Cell.from_bpx(m50), profile.time_s, profile.current_a, 0.7).voltage_v
    assert np.sqrt(np.mean((other - ours) ** 2)) < 1e-4


def test_the_mesh_follows_slow_diffusion(m50):
    """The symptom: at a tenth of the diffusivity 60 points of one mesh for all left 0.66 mV."""
    builder = ProfileBuilder(5.0, 1.0)
    pieces = [piece for rate in (0.5, -0.5, 0.5) for piece in (builder.pulse(rate, 20), builder.rest(40))]
    profile = builder.profile("pulses", [builder.rest(20), *pieces], 0.7)
    factors = {"negative_factor": 0.1, "positive_factor": 0.1}
    other = simulate_truth(Setup(m50, "SPMe", (Applied("solid_diffusivity", factors),)), profile).voltage_v
    slow = (CATALOGUE["solid_diffusivity"].activate(**factors),)
    ours = simulate(Cell.from_bpx(m50), profile.time_s, profile.current_a, 0.7, slow).voltage_v
    assert np.sqrt(np.mean((other - ours) ** 2)) < 1e-4  # 0.061 mV was measured


def test_the_mesh_across_adds_no_resistance(m50):
    """The symptom: 80 even points across left 0.17 mV between two solvers of a DFN, 36 microohm of which."""
    builder = ProfileBuilder(5.0, 1.0)
    pieces = [piece for rate in (2.0, -1.0, 1.5) for piece in (builder.pulse(rate, 30), builder.rest(60))]
    profile = builder.profile("pulses", [builder.rest(20), *pieces], 0.7)
    current = profile.current_a
    other = simulate_truth(Setup(m50, "DFN"), profile).voltage_v
    ours = simulate(Cell.from_bpx(m50), profile.time_s, current, 0.7, model="dfn").voltage_v
    assert np.sqrt(np.mean((other - ours) ** 2)) < 5e-5  # 0.018 mV and 0.4 microohm were measured
    assert abs((other - ours) @ current / (current @ current)) < 5e-6


def test_a_film_grows_with_throughput(nmc):
    added = voltage(nmc, Applied("film_growth", {"growth_ohm_ah": 1e-3})) - voltage(nmc)
    # At the end of the 1C pulse 30 A went through for 39.5 s (the first half second is the ramp): 0.329 Ah.
    assert added[59] == pytest.approx(-1e-3 * (39.5 * 30 / 3600) * 30, rel=1e-3)


def test_full_and_reduced_model_agree_at_a_low_rate(nmc):
    slow = BUILDER.profile("slow", [BUILDER.rest(20), BUILDER.pulse(0.2, 100)], 0.6)
    full = simulate_truth(Setup(nmc, "DFN"), slow).voltage_v
    reduced = simulate_truth(Setup(nmc, "SPMe"), slow).voltage_v
    assert np.sqrt(np.mean((full - reduced) ** 2)) < 0.5e-3


@pytest.mark.parametrize(
    ("change", "values", "least_mv"),
    [
        ("self_heating", {"cooling_w_m2_k": 0.1}, 0.05),
        ("ambient_temperature", {"shift_k": -5.0}, 1.0),
        ("ocv_hysteresis", {"negative_v": 0.01}, 0.5),
        ("ocp_shape", {"positive_v": 0.01, "centre_soc": 0.6}, 1.0),
        ("concentration_dependent_diffusivity", {"negative_slope": 5.0, "centre_soc": 0.2}, 0.1),
        ("solid_diffusivity", {"negative_factor": 0.5}, 0.2),
        ("electrolyte_transport", {"conductivity_factor": 0.5}, 1.0),
        ("charge_transfer_kinetics", {"negative_factor": 0.5}, 1.0),
        ("lithium_inventory_loss", {}, 0.5),
        ("active_material_loss_negative", {}, 0.2),
        ("active_material_loss_positive", {}, 0.2),
        ("leakage_current", {"leak_a": 1.0}, 0.2),
    ],
)
def test_every_change_changes_the_voltage(nmc, change, values, least_mv):
    moved = voltage(nmc, Applied(change, values)) - voltage(nmc)
    assert 1e3 * np.sqrt(np.mean(moved**2)) > least_mv


@pytest.mark.parametrize("change", ["double_layer", "asymmetric_kinetics", "particle_size_distribution"])
def test_changes_by_option_differ_from_their_reference(nmc, change):
    defaults = {"asymmetric_kinetics": {"negative_alpha": 0.7}}.get(change, {})
    reference = Applied("algebraic_surface")
    moved = voltage(nmc, Applied(change, defaults)) - voltage(nmc, reference)
    assert 1e3 * np.sqrt(np.mean(moved**2)) > 0.1


def test_signs_are_physical(nmc):
    base = voltage(nmc)
    loaded = slice(25, 59)
    for slower in (
        Applied("charge_transfer_kinetics", {"positive_factor": 0.5}),
        Applied("electrolyte_transport", {"conductivity_factor": 0.7}),
        Applied("ambient_temperature", {"shift_k": -8.0}),
        Applied("ocv_hysteresis", {"negative_v": 0.01}),
    ):
        assert np.all(voltage(nmc, slower)[loaded] < base[loaded])


def test_a_cell_without_cooling_warms_up(nmc):
    trace = simulate_truth(Setup(nmc, "SPMe", (Applied("self_heating", {"cooling_w_m2_k": 0.0}),)), short())
    assert trace.temperature_degc[0] == pytest.approx(25.0, abs=1e-3)
    assert 0.05 < trace.temperature_degc[-1] - 25.0 < 2.0


def test_an_emptied_cell_is_an_error_not_a_short_record(nmc):
    profile = BUILDER.profile("empty", [BUILDER.rest(10), BUILDER.pulse(1.0, 1200)], 0.1)
    with pytest.raises(SimulationError, match="empty"):
        simulate_truth(Setup(nmc, "SPMe"), profile)


def test_a_run_is_taken_from_the_cache(nmc, monkeypatch):
    first = voltage(nmc)
    monkeypatch.setattr("aesi.data.laboratory.simulator._simulate", lambda *a: pytest.fail("computed again"))
    np.testing.assert_array_equal(voltage(nmc), first)


def test_unknown_changes_and_values_are_refused(nmc, tmp_path):
    with pytest.raises(DataError, match="self_heating"):
        find_change("selfheating")
    with pytest.raises(DataError, match="cooling"):
        CHANGES["self_heating"].complete({"h": 1.0})
    with pytest.raises(DataError, match="different values"):
        voltage(nmc, Applied("double_layer"), Applied("asymmetric_kinetics"))
    with pytest.raises(DataError, match="cannot be opened"):
        simulate_truth(Setup(tmp_path / "none.json", "SPMe"), short())
    bad = tmp_path / "bad.json"
    bad.write_text("{}")
    with pytest.raises(DataError, match="no usable BPX"):
        simulate_truth(Setup(bad, "SPMe"), short())


def test_a_cell_file_that_is_refused_without_a_word_ended_in_an_index_error(nmc, monkeypatch):
    import pybamm

    def refuse(*given, **options):
        raise AssertionError

    monkeypatch.setattr(pybamm.ParameterValues, "create_from_bpx", refuse)
    with pytest.raises(DataError, match="no usable BPX file: AssertionError"):
        parameter_values(nmc, 0.5)


def test_the_instrument_writes_noise_and_steps(rng):
    n = 20_000
    trace = TrueRun(np.arange(n) * 1.0, np.zeros(n), np.full(n, 3.7), np.full(n, 25.0))
    record = Instrument(voltage_step_v=1e-3).write(trace, "x", rng, temperature=True)
    # The standard error of a deviation from 20,000 samples is 0.5 %; the steps add (1 mV)^2 / 12.
    assert np.std(record.voltage_v) == pytest.approx(1e-3 * np.sqrt(1 + 1 / 12), rel=0.03)
    assert np.std(record.current_a) == pytest.approx(4e-3, rel=0.03)
    np.testing.assert_allclose(record.voltage_v, np.round(record.voltage_v, 3), atol=1e-12)
    assert record.temperature_degc is not None
    assert Instrument().write(trace, "x", rng, temperature=False).temperature_degc is None


def test_the_heat_of_mixing_as_an_unknown_is_that_of_pybamm(nmc):
    import pybamm

    options = {"thermal": "lumped", "heat of mixing": "true"}
    time = np.arange(0.0, 61.0)
    current = np.where(time < 20.0, 0.0, 60.0)
    few = {"x_n": 5, "x_s": 5, "x_p": 5, "r_n": 10, "r_p": 10}

    def run(model):
        values = parameter_values(nmc, 0.7)
        values["Current function [A]"] = pybamm.Interpolant(time, current, pybamm.t)
        solver = pybamm.IDAKLUSolver(rtol=1e-8, atol=1e-8)
        simulation = pybamm.Simulation(model, parameter_values=values, solver=solver, var_pts=few)
        solution = simulation.solve(time, t_interp=time)
        names = ("Voltage [V]", "Volume-averaged cell temperature [C]")
        return [np.asarray(solution[name](time)) for name in names]

    ours, theirs = run(porous_electrode(options)), run(pybamm.lithium_ion.DFN(options))
    without = run(pybamm.lithium_ion.DFN({"thermal": "lumped"}))
    assert np.abs(ours[0] - theirs[0]).max() < 1e-6
    assert np.abs(ours[1] - theirs[1]).max() < 1e-5
    assert np.abs(without[1] - theirs[1]).max() > 1e-2
