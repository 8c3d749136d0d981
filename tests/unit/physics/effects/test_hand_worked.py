"""Each effect in a case that can be worked out by hand."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K
from aesi.errors import CellError, ParameterError
from aesi.physics import Cell, EspmModel, Record, Trace, simulate
from aesi.physics.cell.relations import Constant
from aesi.physics.effects import CATALOGUE
from aesi.physics.effects.particle_size_distribution import lognormal_bins
from aesi.physics.simulation import model_with
from aesi.physics.throughput import throughput_ah

CELLS = Path(__file__).resolve().parents[4] / "experiments" / "cells"
CELL = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
TIME = np.arange(0.0, 400.0)
CURRENT = 30.0 * np.sign(np.sin(TIME / 40.0 + 0.01))
SOC0 = 0.7
THERMAL_V = GAS_CONSTANT_J_MOL_K * 298.15 / FARADAY_C_MOL


def run(name=None, current=CURRENT, time=TIME, **values):
    effects = [] if name is None else [CATALOGUE[name].activate(**values)]
    return simulate(CELL, time, current, soc0=SOC0, effects=effects)


def shift(name, current=CURRENT, **values):
    return run(name, current, **values).voltage_v - run(None, current).voltage_v


def test_a_resistance_of_a_milliohm_takes_30_mv_from_30_a():
    assert shift("series_resistance", resistance_ohm=1e-3) == pytest.approx(-1e-3 * CURRENT)


def test_a_film_grows_with_the_ampere_hours_that_passed_either_way():
    hours = TIME / 3600.0
    constant = np.full(len(TIME), 30.0)
    drop = shift("film_growth", constant, per_throughput_ohm_ah=1e-4, per_root_time_ohm=0.0)
    assert drop == pytest.approx(-30.0 * 1e-4 * 30.0 * hours)
    drop = shift("film_growth", constant, per_throughput_ohm_ah=0.0, per_root_time_ohm=1e-3)
    assert drop == pytest.approx(-30.0 * 1e-3 * np.sqrt(hours))


def test_throughput_counts_a_change_of_sign_within_a_step():
    # From +1 A to -1 A in an hour: a quarter of an ampere-hour each way.
    trace = Trace(EspmModel(CELL), np.array([0.0, 3600.0]), np.array([1.0, -1.0]), np.zeros(2), {})
    assert throughput_ah(trace) == pytest.approx([0.0, 0.5])


def test_hysteresis_settles_on_the_discharge_branch_and_stays_there_at_rest():
    current = np.where(TIME < 200.0, 60.0, 0.0)
    added = shift("ocv_hysteresis", current, magnitude_v=0.02, rate=500.0)
    assert added[199:] == pytest.approx(-0.02, abs=1e-5)  # exp(-500 * 0.11) is nothing


@pytest.mark.parametrize("first", [1.0, -1.0], ids=["discharge", "charge"])
def test_hysteresis_ends_on_the_branch_of_what_flows_last_within_a_row(first):
    # A straight line from +30 to -30 A or back in a minute moves 0.125 Ah either way.
    time, current = np.array([0.0, 60.0]), np.array([30.0, -30.0]) * first
    state = run("ocv_hysteresis", current, time, magnitude_v=0.02, rate=500.0).series["hysteresis"]
    decay = np.exp(-500.0 * 0.125 / CELL.nominal_capacity_ah)
    assert state[-1] == pytest.approx(first * (1.0 - (1.0 + (1.0 - decay)) * decay))


def test_hysteresis_forgets_its_start_by_a_factor_e_in_a_capacity_over_the_rate():
    current = np.full(len(TIME), 30.0)
    added = shift("ocv_hysteresis", current, magnitude_v=0.02, rate=20.0, start=1.0)
    passed = 30.0 * TIME / 3600.0 / CELL.nominal_capacity_ah
    assert added == pytest.approx(0.02 * (2.0 * np.exp(-20.0 * passed) - 1.0))


def test_an_open_circuit_potential_off_by_a_wave_shows_at_rest_in_whichever_electrode_it_is():
    rest = np.zeros(len(TIME))
    wave = 0.01 * np.sqrt(2.0) * np.cos(2 * np.pi * SOC0)
    for share in (0.0, 0.3, 1.0):
        added = shift("ocp_shape", rest, a1_v=0.0, a2_v=0.01, positive_share=share)
        assert added == pytest.approx(wave, abs=2e-5)


def test_an_open_circuit_potential_of_the_other_electrode_shows_under_load():
    positive = shift("ocp_shape", CURRENT, a1_v=0.0, a4_v=0.01, positive_share=1.0)
    negative = shift("ocp_shape", CURRENT, a1_v=0.0, a4_v=0.01, positive_share=0.0)
    assert np.abs(positive - negative).max() > 1e-4


def test_a_current_that_reads_high_is_the_voltage_of_a_smaller_one():
    assert run("current_sensor_gain", gain=1.1).voltage_v == pytest.approx(run(None, CURRENT / 1.1).voltage_v)
    assert run("current_sensor_offset", offset_a=0.5).voltage_v == pytest.approx(
        run(None, CURRENT - 0.5).voltage_v
    )


def test_a_leak_discharges_a_resting_cell_and_an_offset_of_the_other_sign_looks_the_same():
    rest = np.zeros(len(TIME))
    leaking = run("leakage_current", rest, leakage_a=0.5)
    lost = (leaking.series["soc"][0] - leaking.series["soc"][-1]) * CELL.capacity_ah
    assert lost == pytest.approx(0.5 * TIME[-1] / 3600.0)
    assert leaking.voltage_v == pytest.approx(run("current_sensor_offset", rest, offset_a=-0.5).voltage_v)


def test_a_voltmeter_adds_its_offset():
    assert shift("voltage_sensor_offset", offset_v=-0.004) == pytest.approx(-0.004)


def test_a_fast_clock_stretches_the_record_and_a_lag_shifts_the_voltage():
    effect = CATALOGUE["clock_skew"]
    true = effect.on_record(Record(TIME + 5.0, CURRENT), skew=0.1, lag_s=0.0)
    assert true.time_s == pytest.approx(5.0 + TIME / 1.1)
    rested = np.where(TIME < 5.0, 0.0, CURRENT)
    late = run("clock_skew", rested, skew=0.0, lag_s=3.0).voltage_v
    assert late[3:] == pytest.approx(run(None, rested).voltage_v[:-3])


PULSE_ROWS = np.concatenate(
    [[0.0, 60.0, 120.0], 120.0 + np.arange(1.0, 31.0), 150.0 + 60.0 * np.arange(1.0, 6.0)]
)
"""A row a second under load, one a minute at rest."""


@pytest.mark.parametrize("hold", ["backward", "linear"])
@pytest.mark.parametrize("lag_s", [-2.0, -0.3, 0.2, 5.0])
def test_a_lag_made_charge_of_a_pulse_and_bent_its_edges(hold, lag_s):
    """The voltage a little sooner or later is that of the same current in rows of 0.05 s."""
    pulse = np.where((PULSE_ROWS > 120.0) & (PULSE_ROWS <= 150.0), 60.0, 0.0)
    lag = CATALOGUE["clock_skew"].activate(skew=0.0, lag_s=lag_s)
    late = simulate(CELL, PULSE_ROWS, pulse, SOC0, [lag], hold=hold)
    fine = np.round(np.arange(-5.0, PULSE_ROWS[-1] + 3.0, 0.05), 2)
    row = np.searchsorted(PULSE_ROWS, fine).clip(max=len(pulse) - 1)
    true_a = pulse[row] if hold == "backward" else np.interp(fine, PULSE_ROWS, pulse)
    truth = simulate(CELL, fine, true_a, SOC0, hold=hold)
    at = np.searchsorted(fine, PULSE_ROWS - lag_s - 1e-6)
    assert late.voltage_v == pytest.approx(truth.voltage_v[at], abs=1e-4)  # of steps of a second
    assert late.series["soc"][-1] == pytest.approx(truth.series["soc"][-1], abs=1e-9)
    assert np.array_equal(late.current_a, pulse)


def test_a_lag_reads_the_profiles_of_the_porous_electrode_with_the_voltage():
    pulse = np.where((PULSE_ROWS > 120.0) & (PULSE_ROWS <= 150.0), 60.0, 0.0)
    lag = CATALOGUE["clock_skew"].activate(skew=0.0, lag_s=1.0)
    late, plain = (
        simulate(CELL, PULSE_ROWS, pulse, SOC0, effects, hold="backward", model="dfn", profiles=True)
        for effects in ([lag], [])
    )
    assert late.profiles["x_m"].shape == plain.profiles["x_m"].shape
    for name in ("reaction_a_m2", "electrolyte_mol_m3"):
        assert late.profiles[name][4:33] == pytest.approx(plain.profiles[name][3:32], rel=1e-3, abs=1e-9)


def test_a_clock_slow_by_a_ten_millionth_took_each_second_in_two_steps():
    current = np.repeat([0.0, 30.0, -60.0, 60.0], 100)
    slow = run("clock_skew", current, skew=-1e-7, lag_s=0.0).voltage_v
    assert slow == pytest.approx(run(None, current).voltage_v, abs=1e-6)


@pytest.mark.parametrize("side", ["negative", "positive"])
def test_kinetics_that_are_hardly_asymmetric_were_of_another_salt(side):
    """The salt differs within an electrode, and so does the overpotential that a mean is taken of."""
    current = np.full(len(TIME), 90.0)
    alpha = {"negative_alpha": 0.5, "positive_alpha": 0.5, f"{side}_alpha": 0.5 + 1e-9}
    assert np.abs(shift("asymmetric_kinetics", current, **alpha)).max() < 1e-7


def test_ten_kelvin_colder_slows_everything_by_arrhenius():
    cold = model_with(CELL, [CATALOGUE["ambient_temperature"].activate(shift_k=-10.0)]).cell
    assert cold.initial_temperature_k == pytest.approx(288.15)
    # Just after a step from rest nothing has diffused: the negative electrode's drop is 2RT/F asinh(j / 2 j0).
    step = np.array([0.0, 1e-6])
    drop = {}
    for name, effects in (("warm", []), ("cold", [CATALOGUE["ambient_temperature"].activate(shift_k=-10.0)])):
        both = [
            simulate(CELL, step, np.array([0.0, i]), soc0=SOC0, effects=effects).voltage_v[1]
            for i in (0.0, 1.0)
        ]
        drop[name] = both[0] - both[1]
    assert (
        1.3 < drop["cold"] / drop["warm"] < 2.3
    )  # between the ohmic share (17 kJ/mol) and the kinetic (55 kJ/mol)


def test_a_measured_temperature_is_taken_as_it_is_by_a_model_that_was_found_to_be_colder():
    cold = CATALOGUE["ambient_temperature"].activate(shift_k=-10.0)
    measured = np.linspace(12.0, 14.0, len(TIME))
    voltage = [
        simulate(CELL, TIME, CURRENT, soc0=SOC0, effects=effects, temperature_degc=measured).voltage_v
        for effects in ([], [cold])
    ]
    np.testing.assert_array_equal(*voltage)


def test_the_step_from_rest_is_the_closed_form_of_the_voltage_law():
    current = 60.0
    theta = dict(zip("np", CELL.stoichiometries(SOC0), strict=True))
    density = current / CELL.total_area_m2
    eta, solid = 0.0, 0.0
    for side, electrode in (("n", CELL.negative), ("p", CELL.positive)):
        j = density / (electrode.area_per_volume_1_m * electrode.thickness_m)
        j0 = FARADAY_C_MOL * electrode.rate_constant * np.sqrt(theta[side] * (1.0 - theta[side]))
        eta += 2.0 * THERMAL_V * np.arcsinh(j / (2.0 * j0))
        solid += density * electrode.thickness_m / (3.0 * electrode.conductivity_s_m)
    kappa = float(CELL.electrolyte.conductivity(np.array([1000.0]))[0])
    n, s, p = CELL.negative, CELL.separator, CELL.positive
    path = n.thickness_m / (3 * n.transport_efficiency) + s.thickness_m / s.transport_efficiency
    path += p.thickness_m / (3 * p.transport_efficiency)
    expected = float(CELL.rest_voltage_v(SOC0)[0]) - eta - solid - density * path / kappa
    assert run(None, np.array([current]), np.array([0.0])).voltage_v[0] == pytest.approx(expected, abs=1e-6)


def test_half_the_rate_constant_doubles_a_small_kinetic_drop():
    small, time = np.array([0.01]), np.array([0.0])
    rest = float(CELL.rest_voltage_v(SOC0)[0])
    plain = run(None, small, time).voltage_v[0]
    half = run("charge_transfer_kinetics", small, time, negative_factor=0.5, positive_factor=0.5).voltage_v[0]
    density = small[0] / CELL.total_area_m2
    theta = dict(zip("np", CELL.stoichiometries(SOC0), strict=True))
    drop = 0.0
    for side, e in (("n", CELL.negative), ("p", CELL.positive)):
        j0 = FARADAY_C_MOL * e.rate_constant * np.sqrt(theta[side] * (1.0 - theta[side]))
        drop += THERMAL_V * density / (e.area_per_volume_1_m * e.thickness_m * j0)
    assert plain - half == pytest.approx(drop, rel=1e-4)
    assert plain < rest


def test_a_cell_whose_films_alone_have_an_energy_was_refused_another_temperature():
    still = {"diffusivity_ea_j_mol": 0.0, "rate_ea_j_mol": 0.0}
    cell = CELL.with_negative(**still, film_ea_j_mol=5e4).with_positive(**still)
    cell = cell.with_electrolyte(conductivity_ea_j_mol=0.0, diffusivity_ea_j_mol=0.0)
    cold = [CATALOGUE["ambient_temperature"].activate(shift_k=-20.0)]
    bare, filmed = (
        simulate(cell.with_negative(film_ohm_m2=Constant(ohm)), [0.0], [30.0], SOC0, cold).voltage_v[0]
        for ohm in (0.0, 1e-3)
    )
    n = cell.negative
    surface = n.area_per_volume_1_m * n.thickness_m * cell.total_area_m2
    colder = np.exp(5e4 / GAS_CONSTANT_J_MOL_K * (1.0 / 278.15 - 1.0 / 298.15))
    assert bare - filmed == pytest.approx(30.0 * 1e-3 / surface * colder)
    with pytest.raises(CellError, match="declares no activation energy"):
        simulate(cell.with_negative(film_ea_j_mol=0.0), [0.0], [30.0], SOC0, cold)


def test_an_asymmetric_reaction_at_a_large_current_follows_tafels_slope():
    currents = np.array([2000.0, 2000.0 * np.e])
    drops = []
    for alpha in (0.5, 0.25):
        v = [run("asymmetric_kinetics", np.array([i]), np.array([0.0]), negative_alpha=alpha, positive_alpha=0.5)
             .voltage_v[0] for i in currents]  # fmt: skip
        drops.append(v[0] - v[1])
    # Another factor e of current costs RT/(alpha F) in the negative electrode; the rest is the same.
    assert drops[1] - drops[0] == pytest.approx(THERMAL_V / 0.25 - THERMAL_V / 0.5, rel=0.01)


def test_the_double_layer_holds_a_small_step_back_for_its_time_constant():
    n = CELL.negative
    theta = CELL.stoichiometries(SOC0)[0]
    j0 = FARADAY_C_MOL * n.rate_constant * np.sqrt(theta * (1.0 - theta))
    tau = 10.0 * THERMAL_V / j0  # C R_ct
    time = np.linspace(0.0, 4.0 * tau, 400)
    current = np.full(400, 0.01)
    current[0] = 0.0
    plain = run(None, current, time).voltage_v
    charged = run("double_layer", current, time, negative_f_m2=10.0, positive_f_m2=0.0).voltage_v
    held_back = (charged - plain)[1:]
    resistance = THERMAL_V / j0 / (n.area_per_volume_1_m * n.thickness_m * CELL.total_area_m2)
    assert held_back == pytest.approx(
        0.01 * resistance * np.exp(-time[1:] / tau), abs=0.05 * 0.01 * resistance
    )


def test_diffusivity_at_the_ends_of_the_range_is_e_to_the_slope_apart():
    effect = CATALOGUE["concentration_dependent_diffusivity"].activate(negative_slope=2.0)
    n = model_with(CELL, [effect]).cell.negative
    low, high = n.diffusivity(np.array([n.theta_min, n.theta_max]))
    assert high / low == pytest.approx(np.exp(2.0), rel=1e-3)  # a table of 129 points


def test_sizes_keep_the_mean_radius_and_have_the_spread_asked_for():
    share, radius = np.array(lognormal_bins(0.3, 9)).T
    assert share.sum() == pytest.approx(1.0)
    assert share @ radius == pytest.approx(1.0)
    assert np.sqrt(share @ (radius - 1.0) ** 2) == pytest.approx(0.3, rel=1e-4)


def test_lost_lithium_is_lost_and_both_end_voltages_stay():
    aged = model_with(CELL, [CATALOGUE["lithium_inventory_loss"].activate(loss=0.1)]).cell

    def lithium(cell):
        return (
            cell.electrode_capacity_ah(cell.negative) * cell.negative.theta_max
            + cell.electrode_capacity_ah(cell.positive) * cell.positive.theta_min
        )

    assert lithium(CELL) - lithium(aged) == pytest.approx(0.1 * CELL.capacity_ah)
    assert aged.rest_voltage_v(np.array([0.0, 1.0])) == pytest.approx(
        CELL.rest_voltage_v(np.array([0.0, 1.0]))
    )
    assert aged.capacity_ah < CELL.capacity_ah


@pytest.mark.parametrize("side", ["negative", "positive"])
def test_lost_material_leaves_less_capacity_and_the_same_start(side):
    name = f"active_material_loss_{side}"
    aged = model_with(CELL, [CATALOGUE[name].activate(loss=0.1)]).cell
    before, after = getattr(CELL, side), getattr(aged, side)
    assert aged.electrode_capacity_ah(after) == pytest.approx(0.9 * CELL.electrode_capacity_ah(before))
    assert run(name, np.zeros(3), np.arange(3.0), loss=0.1).voltage_v == pytest.approx(
        CELL.rest_voltage_v(SOC0)[0], abs=1e-6
    )


def test_an_adiabatic_cell_warms_by_its_losses():
    current, time = np.full(61, 90.0), np.arange(61.0)
    run_ = run("self_heating", current, time, heat_transfer_w_k=1e-3)
    soc = run_.series["soc"]
    losses = 90.0 * (
        CELL.rest_voltage_v(soc) - run_.voltage_v
    )  # close to the heat: surface is not far from mean
    rise = np.trapezoid(losses, time) / CELL.heat_capacity_j_k
    assert run_.series["temperature_k"][-1] - 298.15 == pytest.approx(rise, rel=0.25)


def test_plated_lithium_at_rest_comes_to_nernsts_equilibrium_and_a_fast_charge_goes_beyond():
    time = np.arange(0.0, 3600.0, 2.0)
    calm = run("lithium_plating", np.zeros(len(time)), time, rate_m_s=1e-8)
    potential = float(CELL.negative.ocp(np.array([CELL.stoichiometries(SOC0)[0]]))[0])
    equilibrium = 1000.0 * np.exp(-potential / THERMAL_V)  # of what is in the electrolyte
    assert calm.series["plated_mol_m3"][-1] == pytest.approx(
        equilibrium, rel=0.02
    )  # the lithium moves the potential
    plating = CATALOGUE["lithium_plating"].activate()
    fast = simulate(
        CELL, np.arange(60.0), np.full(60, -120.0), soc0=0.9, effects=[plating], on_depletion="clip"
    )
    assert fast.series["plated_mol_m3"][-1] > equilibrium


@pytest.mark.parametrize("rate_m_s", [1e-9, 1e-7])
@pytest.mark.parametrize("model", ["espm", "dfn"])
def test_lithium_came_from_nowhere_where_metal_stripped_faster_than_a_step(model, rate_m_s):
    # Plates on a charge in the cold and strips on the discharge after it; rows of 10 s, as loggers write.
    time = np.arange(0.0, 1210.0, 10.0)
    current = np.where(time < 400.0, -60.0, np.where(time < 800.0, 60.0, 0.0))
    plating = [CATALOGUE["lithium_plating"].activate(rate_m_s=rate_m_s)]
    cold = simulate(CELL, time, current, 0.9, plating, -5.0, model=model)
    n = CELL.negative
    coulombs_m3 = FARADAY_C_MOL * n.thickness_m * CELL.total_area_m2  # of the electrode, per mol/m3
    theta = n.theta_min + cold.series["soc"] * (n.theta_max - n.theta_min)
    plated = coulombs_m3 * cold.series["plated_mol_m3"]
    held = coulombs_m3 * n.active_fraction * n.c_max_mol_m3 * theta + plated
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (current[1:] + current[:-1]) * np.diff(time))])
    assert plated.max() > 1e4
    assert plated.min() >= 0.0
    assert held - held[0] == pytest.approx(-passed, abs=1e-4)  # of 30 and 220 C that were made or lost


def test_a_share_of_the_differences_between_regions_is_no_physics():
    with pytest.raises(ParameterError, match="strength"):
        CATALOGUE["reaction_nonuniformity"].activate(strength=0.5)


@pytest.mark.parametrize(
    ("name", "reach"), [("concentration_dependent_diffusivity", 10.0), ("particle_size_distribution", 1.0)]
)
def test_the_corners_of_a_wide_range_can_be_simulated(name, reach):
    # Both electrodes at a corner of their ranges, under pulses of 2C that empty the slowest particles' surfaces.
    effect = CATALOGUE[name]
    sides = [n for n in effect.parameters if not n.endswith("curvature")]
    assert all(effect.parameters[n].bounds[1] == reach for n in sides)
    for corner in itertools.product(*(effect.parameters[n].bounds for n in sides)):
        active = effect.activate(**dict(zip(sides, corner, strict=True)))
        result = simulate(CELL, TIME, 2.0 * CURRENT, SOC0, [active], on_depletion="clip")
        assert np.isfinite(result.voltage_v).all()
        assert result.voltage_v.min() > 0.0
