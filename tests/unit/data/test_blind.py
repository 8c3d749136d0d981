"""Blind cases: labels, sizes, and nothing of the finder's own code."""

import sys
from collections import Counter

import numpy as np
import pytest

from aesi.data.blind import CELLS, FULL, CaseSpec, case, cells_in, generate, plan, small_plan
from aesi.data.blind.recipes import RECIPES, Written
from aesi.data.blind.spread import DIFFERENCES, SPREADS, parametrisation, published_differences
from aesi.data.blind.strangers import STRANGERS
from aesi.data.laboratory.changes import CHANGES
from aesi.data.laboratory.simulator import TrueRun
from aesi.errors import DataError
from aesi.physics import Cell, Record, Trace
from aesi.physics.effects import CATALOGUE
from aesi.physics.model import EspmModel

LABELS = {
    "self_heating",
    "ambient_temperature",
    "series_resistance",
    "film_growth",
    "ocv_hysteresis",
    "ocp_shape",
    "double_layer",
    "concentration_dependent_diffusivity",
    "solid_diffusivity",
    "particle_size_distribution",
    "electrolyte_transport",
    "charge_transfer_kinetics",
    "asymmetric_kinetics",
    "lithium_inventory_loss",
    "active_material_loss_negative",
    "active_material_loss_positive",
    "leakage_current",
    "lithium_plating",
    "current_sensor_gain",
    "current_sensor_offset",
    "voltage_sensor_offset",
    "clock_skew",
}


@pytest.fixture
def short_duty(monkeypatch, laboratory_cache):
    """Drives of a few minutes."""
    from aesi.data.blind import duty

    monkeypatch.setattr(duty, "SHORTEST_S", 600.0)
    monkeypatch.setattr(duty, "SCHEDULES", ("us06",))


def share(cases, of):
    return sum(map(of, cases)) / len(cases)


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_the_plan_is_hard_and_covers_all(seed):
    cases = plan(seed)
    assert len(cases) == FULL >= 300
    assert len({one.name for one in cases}) == len(cases)
    kinds = Counter(one.kind for one in cases)
    assert kinds["none"] >= 100
    assert kinds["pair"] >= 40
    assert kinds["triple"] >= 6
    assert kinds["stranger"] >= 30
    singles = [one.recipes[0] for one in cases if one.kind == "single"]
    assert set(singles) == set(RECIPES)
    assert {RECIPES[name].label for name in RECIPES} == LABELS
    assert {name for one in cases for name in one.recipes if name in STRANGERS} == set(STRANGERS)
    assert min(Counter(one.cell for one in cases).values()) > len(cases) / 5
    # Halves, to within what recipes that rule a value out take away.
    assert share(cases, lambda one: one.model == "DFN") == pytest.approx(0.5, abs=0.02)
    assert share(cases, lambda one: not one.soc0_given) == pytest.approx(0.5, abs=0.05)
    assert share(cases, lambda one: len(one.records) > 1) == pytest.approx(0.5, abs=0.02)
    assert share(cases, lambda one: one.spread) == pytest.approx(0.5, abs=0.02)
    assert share(cases, lambda one: one.warmth != "none") == pytest.approx(0.5, abs=0.06)
    assert {one.dt_s for one in cases} == {1.0, 0.1}
    assert plan(seed) == cases
    assert plan(seed + 1) != cases


@pytest.mark.parametrize("first", [15, 30, 60])
def test_the_first_cases_of_a_seed_are_a_fair_small_set(first):
    cases = plan(3, first)
    assert cases == plan(3)[:first]
    assert case(3, first - 1) == cases[-1]
    assert Counter(one.kind for one in cases)["none"] == first // 3
    assert Counter(one.kind for one in cases)["pair"] == 2 * first // 15
    assert set(CELLS) == {one.cell for one in cases}
    assert share(cases, lambda one: one.model == "DFN") == pytest.approx(0.5, abs=0.2)


def test_a_temperature_that_is_the_answer_is_in_no_column():
    answers = [one for one in plan(0) if any(RECIPES[name].warm for name in one.recipes if name in RECIPES)]
    assert answers
    assert {one.warmth for one in answers} == {"none"}


def test_wrong_parameters_are_beyond_what_parametrisations_differ_by():
    slow = RECIPES["negative_diffusivity"]
    factor = slow.values(slow.least, 30.0, 0.8)["negative_factor"]
    assert factor == pytest.approx(np.exp(-2.5 * SPREADS["diffusivity"]))
    draws = [parametrisation(np.random.default_rng(k))[0].values["negative_factor"] for k in range(200)]
    assert np.std(np.log(draws)) == pytest.approx(SPREADS["diffusivity"], rel=0.15)
    assert min(draws) > factor


def test_the_spreads_are_what_two_published_sets_of_one_cell_differ_by():
    differences = published_differences()
    # The closer electrode of each, as the module says.
    assert abs(differences["Positive diffusivity"]) == pytest.approx(DIFFERENCES["diffusivity"], abs=0.01)
    assert abs(differences["Positive kinetics"]) == pytest.approx(DIFFERENCES["kinetics"], abs=0.01)
    assert abs(differences["electrolyte diffusivity"]) == pytest.approx(
        DIFFERENCES["electrolyte_diffusivity"], abs=0.01
    )
    assert abs(differences["electrolyte conductivity"]) == pytest.approx(
        DIFFERENCES["conductivity"], abs=0.001
    )


def test_the_small_plan_is_small_and_mixed():
    cases = small_plan()
    assert len(cases) == 6
    assert () in [one.recipes for one in cases]


@pytest.mark.parametrize(
    "recipe", ["series_resistance", "ocv_hysteresis", "current_sensor_gain", "voltage_lag"]
)
def test_an_effect_has_the_size_asked_for(short_duty, cells, recipe):
    spec = CaseSpec("c", "nmc", (recipe,), target_mv=4.0, soc0=0.6, spread=True, seed=1)
    made = generate(spec, cells_in(cells))
    assert made.label == RECIPES[recipe].label
    assert made.effects == (made.label,)
    # The size is found on a coarse mesh to 20 %.
    assert made.truth["rms_mv"] == pytest.approx(4.0, rel=0.3)
    assert made.soc0 == 0.6
    record = made.measurements[0]
    assert np.all(np.diff(record.time_s) == 1.0)
    assert record.temperature_degc is None


def test_nothing_is_nothing_and_the_noise_is_what_was_said(short_duty, cells):
    made = generate(CaseSpec("c", "nmc", soc0=0.6, seed=2, warmth="course"), cells_in(cells))
    assert (made.label, made.effects) == ("none", ())
    assert made.truth["rms_mv"] == 0.0
    record = made.measurements[0]
    # The column is the temperature of the cell: that of the chamber at first, and warmer later.
    own = {key.split(".")[-1]: value for key, value in made.truth.items() if "temperature_course" in key}
    course = 25.0 + own["shift_k"] + own["rise_k"] * (1 - np.exp(-record.time_s / own["constant_s"]))
    assert record.temperature_degc == pytest.approx(course, abs=0.3)
    assert np.mean(record.temperature_degc - course) == pytest.approx(0.0, abs=0.01)
    # The first rest: 121 samples, the deviation of whose deviation is 6 %.
    assert np.std(record.voltage_v[:120]) == pytest.approx(1e-3, rel=0.25)
    assert np.std(record.current_a[:120]) == pytest.approx(4e-3, rel=0.25)


def test_the_size_of_an_effect_is_told_relative_to_the_file_as_a_finding_tells_it(short_duty, cells):
    spec = CaseSpec("c", "nmc", ("positive_diffusivity",), 4.0, soc0=0.6, seed=1, spread=True)
    truth = generate(spec, cells_in(cells)).truth
    name = "solid_diffusivity.positive_factor"
    of_effect = truth[name] / truth[f"own.{name}"]
    assert truth[f"own.{name}"] != pytest.approx(1.0, abs=0.01)
    assert of_effect == pytest.approx(1.5 ** round(np.log(of_effect) / np.log(1.5), 9))
    assert of_effect < 1.0  # the recipe slows diffusion down
    assert "solid_diffusivity.negative_factor" not in truth


def test_pairs_carry_both_labels_and_strangers_are_unknown(short_duty, cells):
    pair = generate(
        CaseSpec("c", "nmc", ("series_resistance", "film_growth"), 4.0, soc0=0.6, seed=1), cells_in(cells)
    )
    assert pair.label == "series_resistance+film_growth"
    assert pair.effects == ("series_resistance", "film_growth")
    assert {"series_resistance.resistance_ohm", "film_growth.per_throughput_ohm_ah"} <= set(pair.truth)
    strange = generate(CaseSpec("c", "nmc", ("wandering",), 4.0, soc0=0.6, seed=1), cells_in(cells))
    assert (strange.label, strange.effects) == ("unknown", ())
    assert strange.truth["rms_mv"] == pytest.approx(4.0, rel=1e-6)


def test_the_same_specification_gives_the_same_case(short_duty, cells):
    spec = CaseSpec("c", "nmc", ("series_resistance",), 4.0, soc0=0.6, seed=1)
    first, again = generate(spec, cells_in(cells)), generate(spec, cells_in(cells))
    assert first.measurements[0].digest == again.measurements[0].digest


def test_several_records_and_an_untold_state_of_charge(short_duty, cells):
    spec = CaseSpec("c", "nmc", records=("slow", "pulses"), soc0=0.6, soc0_given=False, dt_s=0.1, seed=5)
    made = generate(spec, cells_in(cells))
    assert made.soc0 is None
    slow, pulses = made.measurements
    assert np.all(np.diff(slow.time_s) == 10.0)
    assert np.diff(pulses.time_s) == pytest.approx(0.1)
    # C/5 of 30 Ah down to a tenth.
    assert np.max(slow.current_a) == pytest.approx(6.0, abs=0.03)
    assert np.trapezoid(slow.current_a, slow.time_s) / 3600 == pytest.approx(15.0, rel=0.01)


def test_an_effect_that_a_cell_cannot_show_is_made_on_one_that_can(short_duty, cells):
    # Particles of 50 nm: their diffusion is over in a second.
    spec = CaseSpec("c", "lfp", ("positive_diffusivity",), 4.0, soc0=0.8, seed=1)
    made = generate(spec, cells_in(cells))
    assert made.spec.cell != "lfp"
    assert made.truth["rms_mv"] > 2.0


def test_faults_of_the_instrument_by_hand():
    time = np.arange(5.0)
    written = Written(time, 2.0 * np.ones(5), 3.0 + 0.1 * time)
    gain = RECIPES["current_sensor_gain"].instrument(written, {"gain": 1.05})
    np.testing.assert_allclose(gain.current_a, 2.1)
    offset = RECIPES["current_sensor_offset"].instrument(written, {"offset_a": 0.5})
    np.testing.assert_allclose(offset.current_a, 2.5)
    volts = RECIPES["voltage_sensor_offset"].instrument(written, {"offset_v": 0.01})
    np.testing.assert_allclose(volts.voltage_v, written.voltage_v + 0.01)
    lag = RECIPES["voltage_lag"].instrument(written, {"lag_s": 0.5})
    np.testing.assert_allclose(lag.voltage_v, [3.0, 3.05, 3.15, 3.25, 3.35])
    fast = RECIPES["clock_rate"].instrument(written, {"skew": 0.25})
    np.testing.assert_allclose(fast.voltage_v, 3.0 + 0.1 * time / 1.25)


@pytest.mark.parametrize("name", STRANGERS)
def test_strangers_are_structured_and_start_at_nothing_they_could_not_know(name, rng):
    time = np.arange(1200.0)
    current = np.where((time // 60) % 3 == 1, 30.0, np.where((time // 60) % 3 == 2, -10.0, 0.0))
    voltage = 3.7 - 2e-3 * current - 1e-4 * time
    trace = TrueRun(time, current, voltage, np.full(1200, 25.0))
    shift = STRANGERS[name].shift(trace, 30.0, rng)
    assert shift.shape == time.shape
    assert 0.5e-3 < np.sqrt(np.mean(shift**2)) < 0.1
    # Structure: neighbours are alike, unlike noise.
    assert np.corrcoef(shift[1:], shift[:-1])[0, 1] > 0.5


def test_unknown_names_are_refused(cells):
    with pytest.raises(DataError, match="no cell"):
        generate(CaseSpec("c", "lco"), cells_in(cells))
    with pytest.raises(DataError, match="self_heating"):
        generate(CaseSpec("c", "nmc", ("self_heatin",)), cells_in(cells))


def test_the_generator_does_not_load_the_finder():
    import subprocess

    code = (
        "import sys, aesi.data.blind, aesi.data.blind.generate;"
        "print([m for m in sys.modules if m.startswith(('aesi.physics', 'aesi.tracer'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_label_of_a_slope_counts_it_over_the_window_as_the_effect_does(cells):
    declared = cells_in(cells)["nmc"]
    cell = Cell.from_bpx(declared)
    values = {"positive_slope": 5.0, "centre_soc": 0.5}
    slope = RECIPES["positive_sloped_diffusivity"].as_named(values, declared)["positive_slope"]
    varied = CATALOGUE["concentration_dependent_diffusivity"].activate_only(positive_slope=slope)
    positive = varied.effect.on_model(EspmModel(cell), **varied.parameters).cell.positive
    x = np.array([positive.theta_min, positive.theta_max])
    added = np.log(positive.diffusivity(x)) - np.log(cell.positive.diffusivity(x))
    assert np.diff(added) == pytest.approx(5.0 * np.diff(x))


def test_no_recipe_goes_beyond_what_its_effect_takes_for_physical(cells):
    compared = set()
    for name, recipe in RECIPES.items():
        known = CATALOGUE[recipe.label].parameters
        for cell in recipe.cells:
            declared = cells_in(cells)[cell]
            values = recipe.values(recipe.most, Cell.from_bpx(declared).nominal_capacity_ah, 0.9)
            for key, value in recipe.as_named(values, declared).items():
                sides = (key, f"negative_{key}", f"positive_{key}")  # of a value for both electrodes
                for parameter in (known[side] for side in sides if side in known):
                    low, high = parameter.bounds
                    assert low <= value <= high * (1 + 1e-9), (name, cell, key)
                    compared.add(recipe.label)
    assert {"current_sensor_gain", "series_resistance", "electrolyte_transport"} <= compared


OTHER_MEANING = {
    "self_heating": {"cooling_w_m2_k"},
    "ocp_shape": {"positive_v", "negative_v", "centre_soc", "width_soc"},
    "concentration_dependent_diffusivity": {"centre_soc"},
    "lithium_inventory_loss": {"negative_stoichiometry"},
}
"""Label -> values of the laboratory that no parameter of the effect has the meaning of."""


@pytest.mark.parametrize("name", RECIPES)
def test_the_sizes_of_ten_labels_were_compared_with_nothing(name, request):
    recipe = RECIPES[name]
    parameters = CATALOGUE[recipe.label].parameters
    declared = request.config.rootpath / "experiments" / "cells" / "nmc_30ah.bpx.json"
    named = recipe.as_named(recipe.values(1.0, 5.0, 0.8), declared)
    assert set(named) - set(parameters) <= OTHER_MEANING.get(recipe.label, set())
    for key in set(named) & set(parameters):
        parameters[key].check(key, named[key])


def test_a_leakage_and_a_film_are_those_of_the_package():
    time_s, current_a = np.arange(0.0, 7200.0, 10.0), np.full(720, 2.0)
    leak = RECIPES["leakage_current"].values(1.0, 5.0, 0.8)
    named = RECIPES["leakage_current"].as_named(leak, None)
    seen = CATALOGUE["leakage_current"].on_record(Record(time_s, current_a, None), **named)
    flowing = CHANGES["leakage_current"].cell_current(time_s, current_a, leak)
    np.testing.assert_allclose(flowing, seen.current_a)
    film = RECIPES["film_growth"].values(1.0, 5.0, 0.8)
    named = RECIPES["film_growth"].as_named(film, None) | {"per_root_time_ohm": 0.0}
    trace = Trace(None, time_s, current_a, np.zeros(720), {}, True)
    added = CATALOGUE["film_growth"].on_voltage(trace, **named).voltage_v
    there = CHANGES["film_growth"].terminal_voltage(
        time_s, current_a, np.zeros(720), film | {"growth_ohm_h": 0.0}
    )
    np.testing.assert_allclose(there, added, atol=1e-12)
    assert added[-1] < -1e-3


@pytest.mark.parametrize("name", ["ocv_hysteresis", "positive_hysteresis"])
def test_both_hystereses_lower_the_voltage_of_a_long_discharge_by_their_magnitude(name):
    recipe, base = (
        RECIPES[name],
        {f"{e} electrode OCP [V]": lambda sto: 1.0 for e in ("Negative", "Positive")},
    )

    class Parameters(dict):
        def update(self, new, check_already_exists):
            super().update(new)

    values = recipe.values(1.0, 5.0, 0.8)
    change = CHANGES["ocv_hysteresis"]
    changed = Parameters(base)
    change.alter(changed, change.defaults | values)
    discharged_v = changed["Positive electrode lithiation OCP [V]"](0.5)
    discharged_v -= changed["Negative electrode delithiation OCP [V]"](0.5)
    magnitude_v = recipe.as_named(values, None)["magnitude_v"]
    assert discharged_v == pytest.approx(-magnitude_v)  # the middle of both electrodes is 1 V
    assert magnitude_v > 0.0  # of the package's, on a long discharge: h = -1, V = V_cell - magnitude
