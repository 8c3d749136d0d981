"""Both models of a cell answer in the same names, and a saved model keeps which one it is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.errors import InputError, SimulationError
from aesi.physics import Cell, EspmModel, impedance, simulate
from aesi.physics.effect import Effect
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.simulation import ProfileRequest, simulate_file

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
CELL = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
TIME = np.arange(0.0, 120.0)
CURRENT = 60.0 * np.sign(np.sin(TIME / 10.0))

HELD_V = 5e-5  # what steps of 1 s leave: 0.02 mV against steps of 10 ms, 0.7 mV where a short step was extrapolated

STEEP = [("lg_18650hg2_cold", 25.0), ("lg_18650hg2_cold", 0.0), ("panasonic_ncr18650pf", 0.0)]
STEEP_V = {
    10.0: 1e-3,
    5.0: 1e-3,
    1.0: 3e-4,
}  # by row; 0.68, 0.95 and 0.29 mV are reached, in steps of 5 s 1.08 and 2.64 of the first two


def on_the_usual_basis(model):
    """A model whose steps alone differ from the usual numerics."""
    usual = EspmModel(model.cell)
    return replace(
        model,
        solid_order=usual.solid_order,
        electrolyte_order=usual.electrolyte_order,
        electrode_points=usual.electrode_points,
    )


SAME_BASIS = Effect("same_basis", "instrument", "", on_model=on_the_usual_basis)


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


def pulsed(row_s, degc, name, effects=()):
    """(n,) V at the ends of 10 s pulses of a cell whose diffusivities span decades, held rows of row_s."""
    cell = Cell.from_bpx(CELLS / f"{name}.bpx.json")
    pulse_a = np.random.default_rng(3).normal(0.4, 0.5, 20) * cell.capacity_ah
    pulse_a[:2] = 0.0
    time = np.linspace(0.0, 190.0, round(190.0 / row_s) + 1)
    current = pulse_a[np.searchsorted(np.arange(0.0, 200.0, 10.0), time - 1e-6)]
    run = simulate(cell, time, current, 0.8, effects, degc, hold="backward", model="dfn")
    return run.voltage_v[:: round(10.0 / row_s)]


@pytest.mark.parametrize(("name", "degc"), STEEP)
@pytest.mark.parametrize("row_s", list(STEEP_V))
def test_rows_of_a_second_erred_by_millivolts_where_diffusivity_is_steep(name, degc, row_s):
    assert np.abs(pulsed(row_s, degc, name) - pulsed(0.0625, degc, name)).max() < STEEP_V[row_s]


@pytest.mark.parametrize(("c_rate", "within_v"), [(-2.3, 0.02), (-4.0, 0.1), (2.3, 0.02)])
def test_a_cold_step_to_where_diffusion_is_much_quicker_was_off_by_a_hundred_volts(c_rate, within_v):
    """A charge of 4C from rest at -15 degC in rows of a second, where the voltage does not leave 5 V."""
    cell = Cell.from_bpx(CELLS / "lg_18650hg2_cold.bpx.json")
    voltages_v = []
    for rows in (1, 20):  # in a second
        time_s = np.arange(5 * rows + 1) / rows
        current_a = np.where(time_s < 1.01, 0.0, c_rate * cell.nominal_capacity_ah)
        run = simulate(cell, time_s, current_a, 0.6, (), -15.0, "backward", on_depletion="clip")
        voltages_v.append(run.voltage_v[::rows])
    assert np.abs(voltages_v[0] - voltages_v[1]).max() < within_v


@pytest.mark.parametrize("model", ["espm", "dfn"])
def test_a_voltage_jumped_as_a_profile_entered_the_next_cell_of_the_table_of_its_diffusivity(model):
    """By 0.04 mV here, by 28 mV where film and diffusivity both span decades: a fit took that for a slope."""
    steep = CATALOGUE["concentration_dependent_diffusivity"].activate(
        positive_slope=10.0, positive_curvature=0.0, negative_slope=0.0, negative_curvature=0.0
    )
    slow = CATALOGUE["solid_diffusivity"].activate(positive_factor=0.2, negative_factor=1.0)
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    current = np.where(TIME % 40.0 < 20.0, -5.0, 10.0)
    moved = []
    for share in 1.0 + np.linspace(0.0, 1e-3, 21):
        larger = cell.with_positive(c_max_mol_m3=cell.positive.c_max_mol_m3 * share)
        moved.append(
            simulate(larger, TIME, current, 0.6, [steep, slow], 5.0, "backward", model=model).voltage_v
        )
    assert np.abs(moved[-1] - moved[0]).max() > 1e-4
    assert np.abs(np.diff(moved, 2, axis=0)).max() < 3e-6


def test_finer_numerics_left_rows_shorter_than_their_longest_step_whole():
    refined = CATALOGUE["numerical_error"].activate(refinement=2.0)
    whole, half, finer = (
        pulsed(1.0, 0.0, "lg_18650hg2_cold", (SAME_BASIS.activate(),)),
        pulsed(0.5, 0.0, "lg_18650hg2_cold", (SAME_BASIS.activate(),)),
        pulsed(1.0, 0.0, "lg_18650hg2_cold", (refined, SAME_BASIS.activate())),
    )
    assert np.abs(half - whole).max() > 1e-4
    assert np.abs(finer - half).max() < 1e-5  # a double layer is met in other steps


def test_the_heat_of_a_held_current_hung_on_the_last_digit_of_it_over_the_area():
    cell = Cell.from_bpx(CELLS / "panasonic_ncr18650pf.bpx.json")
    size = 3.7  # (I/A) A is I to the last digit for most of these currents at an area, and for few at another
    larger = replace(
        cell,
        electrode_area_m2=size * cell.electrode_area_m2,
        nominal_capacity_ah=size * cell.nominal_capacity_ah,
        contact_resistance_ohm=cell.contact_resistance_ohm / size,
        volume_m3=size * cell.volume_m3,
        surface_area_m2=size * cell.surface_area_m2,
    )
    time = np.arange(0.0, 600.0, 10.0)
    current = np.where((time // 60) % 2, 5.8, 0.0)
    runs = [
        simulate(one, time, times * current, 0.9, (), 17.0, "backward", model="dfn")
        for one, times in ((cell, 1.0), (larger, size))
    ]
    kelvin, scaled = (run.series["temperature_k"] for run in runs)
    assert np.ptp(kelvin) > 0.5
    np.testing.assert_allclose(scaled, kelvin, rtol=0, atol=1e-9)


def test_a_double_layer_hung_on_the_rounding_of_rows_on_a_straight_line():
    layers = CATALOGUE["double_layer"].activate(negative_f_m2=1.0, positive_f_m2=3.0)
    time = np.arange(0.0, 40.0)
    current = np.interp(time, [0.0, 8.0, 16.0, 24.0, 32.0, 39.0], [0.0, 45.0, -30.0, 60.0, -60.0, 10.0])
    lags_s = 0.3 + 1e-4 * np.arange(6)
    voltages = [
        simulate(
            CELL, time, current, 0.6, [layers, CATALOGUE["clock_skew"].activate(lag_s=lag)], 10.0, model="dfn"
        )
        for lag in lags_s.tolist()
    ]
    bends = np.diff([run.voltage_v for run in voltages], n=2, axis=0)
    assert np.abs(bends).max() < 1e-4


def in_short_steps(model):
    return replace(model, step_refinement=16.0)


SHORT_STEPS = Effect("short_steps", "instrument", "", on_model=in_short_steps)


@pytest.mark.parametrize("row_s", [2.0, 10.0])
def test_what_a_double_layer_gave_on_at_a_steady_slope_stayed_at_the_surfaces_of_particles(row_s):
    """At the end of a discharge at C/2 the surfaces took every step what the mean did not, and the voltage was 5.9 mV
    low, of some 50 mV that the layers make there; 0.5 mV are left, of what is predicted wrongly within one step."""
    cell = Cell.from_bpx(CELLS / "lfp_prada2013.bpx.json")
    time = np.arange(0.0, 1300.0, row_s)
    current = np.full(len(time), 0.5 * cell.nominal_capacity_ah)
    layers = CATALOGUE["double_layer"].activate(negative_f_m2=2.0, positive_f_m2=2.0)
    whole, short = (
        simulate(cell, time, current, 0.25, effects, 0.0, "backward", model="dfn").voltage_v
        for effects in ([layers], [layers, SHORT_STEPS.activate()])
    )
    assert short[-1] < cell.lower_voltage_v
    assert np.abs(whole - short)[time > 60.0].max() < 1e-3


@pytest.mark.parametrize("c_rate", [-1.0, 0.5, 1.5, 5.0])
def test_the_current_of_a_cold_double_layer_jumped_to_and_fro_until_the_steps_of_newton_ended(c_rate):
    """A step of 1.5C was up to half a volt off, in either direction, where rows are short and kinetics slow. At once
    the layers take all of it, so that the voltage drops by the impedance at high frequency."""
    cell = Cell.from_bpx(CELLS / "panasonic_ncr18650pf.bpx.json")
    current_a = c_rate * cell.nominal_capacity_ah
    time_s = 1e-6 * np.arange(3.0)
    load = np.where(time_s > 0.0, current_a, 0.0)
    run = simulate(cell, time_s, load, 0.9, (), -20.0, "backward")
    (at_once_ohm,) = impedance(cell, np.array([1e9]), 0.9, -20.0).real
    dropped_v = run.voltage_v[0] - run.voltage_v[1:]
    assert dropped_v == pytest.approx(current_a * at_once_ohm, abs=1e-4)


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
