"""The same checks over every effect of the catalogue, and over one from a user's own file."""

import itertools
import json
import pickle
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pint
import pytest

from aesi.errors import CellError, InputError, ParameterError
from aesi.numerics.metrics import rms
from aesi.physics import Cell, impedance, simulate
from aesi.physics.effect import Contribution, Effect, Record, Trace
from aesi.physics.effects import CATALOGUE, active_effect, describe, find_effect, load_effect
from aesi.physics.folded import folded
from aesi.physics.simulation import model_with
from aesi.tracer.case.free_parameter import effect_parameters
from aesi.tracer.case.problem import STEP

CELLS = Path(__file__).resolve().parents[2] / "experiments" / "cells"
CELL = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
TIME = np.arange(0.0, 240.0, 2.0)
CURRENT = 30.0 * (0.3 + np.sin(TIME / 9.0) + 0.7 * np.sign(np.sin(TIME / 37.0)))
NEUTRAL_V = 1e-9
CONTRACTED = {
    "self_heating", "ambient_temperature", "series_resistance", "film_growth", "ocv_hysteresis", "ocp_shape",
    "double_layer", "concentration_dependent_diffusivity", "solid_diffusivity", "particle_size_distribution",
    "electrolyte_transport", "charge_transfer_kinetics", "asymmetric_kinetics", "reaction_nonuniformity",
    "lithium_inventory_loss", "active_material_loss_negative", "active_material_loss_positive", "leakage_current",
    "lithium_plating", "current_sensor_gain", "current_sensor_offset", "voltage_sensor_offset", "clock_skew",
    "numerical_error",
}  # fmt: skip
PER = {"ohm_ah": "ohm/(A*hour)", "per_root_time_ohm": "ohm/hour**0.5"}
"""Endings that are no unit spelt out."""

each = pytest.mark.parametrize("effect", CATALOGUE.values(), ids=CATALOGUE)


both = pytest.mark.parametrize("model", ["espm", "dfn"])
OF_ESPM_ALONE = {"reaction_nonuniformity"}


def run(*effects, **options):
    return simulate(CELL, TIME, CURRENT, soc0=0.8, effects=effects, on_depletion="clip", **options)


def skip_what_the_model_holds(effect, model):
    if model == "dfn" and effect.id in OF_ESPM_ALONE:
        pytest.skip("the porous electrode has it of itself")


BASES = {model: run(model=model) for model in ("espm", "dfn")}
BASE = BASES["espm"]


MATERIAL = [effect for effect in CATALOGUE.values() if effect.of_material]
LOSSES = [
    CATALOGUE["lithium_inventory_loss"],
    *(CATALOGUE[f"active_material_loss_{s}"] for s in ("negative", "positive")),
]


@pytest.mark.parametrize("aged", LOSSES, ids=lambda effect: effect.id)
@pytest.mark.parametrize("material", MATERIAL, ids=lambda effect: effect.id)
def test_a_loss_moved_what_a_material_answers_at_a_stoichiometry(material, aged):
    """By 5.5 mV, as the one or the other was given first."""
    shaped, lost = material.activate(), aged.activate()
    alone, after = model_with(CELL, [shaped]).cell, model_with(CELL, [lost, shaped]).cell
    for side in ("negative", "positive"):
        mine, declared = getattr(after, side), getattr(alone, side)
        assert (mine.ocp, mine.diffusivity) == (declared.ocp, declared.diffusivity)
    windows = [(cell.balance.window_n, cell.balance.window_p) for cell in (alone, after)]
    assert windows[0] != windows[1]
    np.testing.assert_array_equal(run(lost, shaped).voltage_v, run(shaped, lost).voltage_v)
    assert folded(CELL, [lost, shaped]).cell == folded(CELL, [shaped, lost]).cell


@each
def test_what_is_laid_over_a_window_is_known_to_belong_to_a_material(effect):
    if effect.on_model is None:
        return
    n, p = CELL.negative, CELL.positive
    other = CELL.with_negative(theta_max=n.theta_max - 0.05).with_positive(theta_max=p.theta_max - 0.05)
    active = effect.activate()
    try:
        there, here = (model_with(cell, [active]).cell for cell in (other, CELL))
    except CellError:  # it needs what this file does not declare
        return
    relations = ("ocp", "diffusivity", "entropic", "rate_factor", "film_ohm_m2")
    moved = [
        getattr(getattr(there, side), name) != getattr(getattr(here, side), name)
        for side in ("negative", "positive")
        for name in relations
    ]
    assert any(moved) == effect.of_material


def test_the_catalogue_holds_what_was_promised():
    assert set(CATALOGUE) >= CONTRACTED
    assert all(name == effect.id for name, effect in CATALOGUE.items())


@each
def test_it_says_what_it_is(effect):
    assert effect.kind in ("physics", "parameter", "instrument")
    assert effect.summary
    assert effect.equation.strip()
    assert "Holds" in effect.validity
    assert "Leaves out" in effect.validity
    assert len(effect.source) > 10
    page = describe(effect)
    assert effect.equation in page
    assert all(name in page for name in effect.parameters)


@both
@each
def test_it_keeps_the_shape_and_is_finite(effect, model):
    skip_what_the_model_holds(effect, model)
    result = run(effect.activate(), model=model)
    assert result.voltage_v.shape == TIME.shape
    assert np.isfinite(result.voltage_v).all()
    for name, values in result.series.items():
        assert values.shape == TIME.shape, name
        assert np.isfinite(values).all(), name
    assert (result.time_s == TIME).all()
    assert (result.current_a == CURRENT).all()  # what was recorded, whatever the cell saw


@both
@each
def test_an_effect_moves_the_voltage(effect, model):
    skip_what_the_model_holds(effect, model)
    moved = np.abs(run(effect.activate(), model=model).voltage_v - BASES[model].voltage_v).max()
    assert moved > (0.0 if effect.id == "numerical_error" else 1e-5)


@both
@each
def test_an_effect_gives_the_same_twice_and_changes_no_input(effect, model):
    skip_what_the_model_holds(effect, model)
    time, current = TIME.copy(), CURRENT.copy()
    active = effect.activate()
    first = simulate(CELL, time, current, soc0=0.8, effects=[active], on_depletion="clip", model=model)
    second = simulate(CELL, time, current, soc0=0.8, effects=[active], on_depletion="clip", model=model)
    assert (first.voltage_v == second.voltage_v).all()
    assert (time == TIME).all()
    assert (current == CURRENT).all()
    assert (run(model=model).voltage_v == BASES[model].voltage_v).all()


@both
@each
def test_it_vanishes_at_its_neutral_values(effect, model):
    skip_what_the_model_holds(effect, model)
    if all(p.neutral is None for p in effect.parameters.values()):
        pytest.skip("has no point at which it vanishes")
    moved = run(effect.activate_only(), model=model).voltage_v - BASES[model].voltage_v
    assert np.abs(moved).max() < NEUTRAL_V
    assert effect.activate_only().vanishes


@each
def test_what_has_a_size_does_not_vanish(effect):
    assert not effect.activate().vanishes
    for name, parameter in effect.parameters.items():
        if parameter.neutral not in (None, parameter.default):
            assert not effect.activate_only(**{name: parameter.default}).vanishes


@each
def test_a_fit_can_move_it_from_where_it_vanishes(effect):
    # A first small step has to move the voltage in proportion; a standard deviation of sizes does so by its square.
    free = effect_parameters(effect.id, effect.parameters, CELL.nominal_capacity_ah)
    moving = [f for f in free if f.amplitude and effect.refines != "discretisation"]
    nowhere = {f.name: f.centre if f.amplitude else f.typical for f in free}
    at_rest = run(effect.activate(**nowhere)).voltage_v
    for f in moving:
        side = 1.0 if f.bounds[1] > 0.0 else -1.0
        small, large = (
            np.linalg.norm(run(effect.activate(**{**nowhere, f.name: f.value(side * x)})).voltage_v - at_rest)
            / x
            for x in (STEP, 0.5)
        )
        assert small > 0.1 * large, f.name


@each
def test_one_parameter_alone_leaves_the_others_where_they_do_nothing(effect):
    for name, parameter in effect.parameters.items():
        values = effect.activate_only(**{name: parameter.default}).parameters
        assert values.pop(name) == parameter.default
        assert all(effect.parameters[n].neutral in (None, v) for n, v in values.items())


@each
def test_it_travels_between_processes_and_files(effect):
    active = effect.activate()
    assert pickle.loads(pickle.dumps(active)) == active
    assert active_effect(json.loads(json.dumps(active.to_dict()))) == active


@each
def test_bounds_hold_defaults_and_neutral_values_and_are_enforced(effect):
    for name, p in effect.parameters.items():
        low, high = p.bounds
        assert low <= p.default <= high
        assert p.neutral is None or low <= p.neutral <= high
        assert p.source
        assert p.description
        with pytest.raises(ParameterError, match=name):
            effect.activate(**{name: high + abs(high)})
        with pytest.raises(ParameterError, match=name):
            effect.activate(**{name: float("nan")})
    with pytest.raises(ParameterError, match=f"^{effect.id}: unknown parameter"):
        effect.activate(no_such_parameter=1.0)


@both
@each
def test_both_ends_of_every_range_can_be_simulated(effect, model):
    skip_what_the_model_holds(effect, model)
    for name, p in effect.parameters.items():
        for value in p.bounds:
            assert np.isfinite(run(effect.activate(**{name: value}), model=model).voltage_v).all(), (
                name,
                value,
            )


def ending_of(unit):
    """How the name of a parameter says its unit: 'W/K' as '_w_k', 'F/m**2' as '_f_m2'."""
    return "_" + re.sub(r"[^a-z0-9]+", "_", unit.lower().replace("**", ""))


@each
def test_units_are_units_and_stand_in_the_names(effect):
    registry = pint.UnitRegistry()
    units = {p.unit for one in CATALOGUE.values() for p in one.parameters.values()} - {"dimensionless"}
    for name, p in effect.parameters.items():
        registry.parse_units(p.unit)
        said = [unit for unit in units if f"_{name}".endswith(ending_of(unit))]
        said += [unit for ending, unit in PER.items() if name.endswith(ending)]
        longest = max(said, key=lambda unit: len(ending_of(unit)), default="dimensionless")
        assert p.unit == longest, f"{name}: its unit is {p.unit}, its name says {longest}"


def test_what_a_model_holds_of_itself_is_refused_in_one_sentence():
    with pytest.raises(InputError, match="of itself"):
        run(CATALOGUE["reaction_nonuniformity"].activate(), model="dfn")


def test_the_units_of_voltage_laws_add_up():
    registry = pint.UnitRegistry()
    ampere, hour, volt = registry.ampere, registry.hour, registry.volt
    film = CATALOGUE["film_growth"].parameters
    throughput = registry.parse_units(film["per_throughput_ohm_ah"].unit) * ampere * hour
    root = registry.parse_units(film["per_root_time_ohm"].unit) * hour**0.5
    resistance = registry.parse_units(CATALOGUE["series_resistance"].parameters["resistance_ohm"].unit)
    for unit in (throughput, root, resistance):
        assert (1.0 * unit * ampere).check(volt.dimensionality)
    heat = registry.parse_units(CATALOGUE["self_heating"].parameters["heat_transfer_w_k"].unit)
    assert (1.0 * heat * registry.kelvin).check(registry.watt.dimensionality)


@each
@both
@pytest.mark.parametrize("hold", ["backward", "linear"])
def test_rows_between_rows_under_the_same_current_change_nothing(effect, model, hold):
    """Long steps behind ones a thousand times shorter; a double layer is not exact in steps of seconds."""
    skip_what_the_model_holds(effect, model)
    rng = np.random.default_rng(0)
    early_s = rng.choice([1e-3, 0.3, 1.0, 1.998], len(TIME) - 1)
    rows = np.sort(np.concatenate([TIME, TIME[1:] - early_s]))
    held = CURRENT[np.searchsorted(TIME, rows)] if hold == "backward" else np.interp(rows, TIME, CURRENT)
    few, many = (
        simulate(
            CELL, time, current, 0.8, [effect.activate()], hold=hold, model=model, on_depletion="clip"
        ).voltage_v
        for time, current in ((TIME, CURRENT), (rows, held))
    )
    apart = rms(many[np.searchsorted(rows, TIME)] - few)
    assert apart < (1e-3 if effect.id == "double_layer" else 5e-5), f"{1e3 * apart:.3f} mV"


@pytest.mark.parametrize("pair", list(itertools.combinations(CATALOGUE, 2)), ids="+".join)
def test_any_two_work_together(pair):
    first, second = (CATALOGUE[name].activate() for name in pair)
    voltage = run(first, second).voltage_v
    assert np.isfinite(voltage).all()
    assert np.abs(voltage - BASE.voltage_v).max() < 2.0


def test_all_together_give_a_voltage():
    assert np.isfinite(run(*(effect.activate() for effect in CATALOGUE.values())).voltage_v).all()


def test_an_unknown_name_gets_the_nearest_one():
    with pytest.raises(InputError, match="self_heating"):
        find_effect("selfheating")


@pytest.mark.parametrize("name", ["self_heating", "ambient_temperature"])
def test_a_cell_without_the_field_an_effect_needs_says_so(name):
    content = json.loads((CELLS / "lg_m50_chen2020.bpx.json").read_text())
    parts = content["Parameterisation"]
    del parts["Cell"]["Density [kg.m-3]"]
    for side in ("Negative electrode", "Positive electrode"):
        parts[side] = {k: v for k, v in parts[side].items() if "activation" not in k}
    cell = Cell.from_bpx(content)
    with pytest.raises(CellError, match=re.escape(cell.name)):
        simulate(cell, TIME, 0.1 * CURRENT, soc0=0.8, effects=[CATALOGUE[name].activate()])


OWN = '''"""A lead with an inductance.

    V = V_cell - L dI/dt

Leaves out its resistance. Holds at sampling above L/R.

Source: Faraday's law.
"""

import numpy as np

from aesi.parameters import Parameter
from aesi.physics import Contribution, Effect, Trace

PARAMETERS = {"inductance_h": Parameter(1e-3, "H", (0.0, 1.0), "a coil", neutral=0.0, description="L")}


def drop(trace: Trace, *, inductance_h: float) -> Contribution:
    return Contribution(-inductance_h * np.gradient(trace.current_a, trace.time_s))


EFFECT = Effect("lead_inductance", "physics", __doc__, PARAMETERS, on_voltage=drop)
'''


def test_a_users_own_effect_works_like_the_others(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(OWN)
    effect = load_effect(path)
    active = effect.activate(inductance_h=0.01)
    shift = run(active).voltage_v - BASE.voltage_v
    assert shift == pytest.approx(-0.01 * np.gradient(CURRENT, TIME))
    assert effect.equation.strip() == "V = V_cell - L dI/dt"
    assert pickle.loads(pickle.dumps(active)) == active
    assert active_effect(json.loads(json.dumps(active.to_dict()))) == active
    assert np.isfinite(run(active, CATALOGUE["self_heating"].activate()).voltage_v).all()


def test_a_contact_that_answers_to_temperature_had_the_one_told_in_an_impedance_of_a_colder_cell():
    """Beside an effect by which the cell is 20 K colder than the record says: the rest of the cell was at that."""

    def colder(record: Record) -> Record:
        return replace(record, temperature_k=record.temperature_k - 20.0)

    def contact(trace: Trace) -> Contribution:
        return Contribution(-1e-4 * trace.series["temperature_k"] * trace.current_a)

    cold = Effect("cold", "instrument", "Cold.", on_record=colder).activate()
    lead = Effect("contact", "physics", "Contact.", on_voltage=contact).activate()
    ohm = impedance(CELL, [1.0], 0.5, 25.0, [cold, lead]) - impedance(CELL, [1.0], 0.5, 25.0, [cold])
    assert ohm[0] == pytest.approx(1e-4 * 278.15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("EFFECT = 3", "defines no EFFECT"),
        ("1 / 0", "ZeroDivisionError"),
        (OWN.replace('"lead_inductance"', '"self_heating"'), "taken"),
    ],
)
def test_a_file_that_is_no_effect_says_why(tmp_path, text, words):
    path = tmp_path / "bad.py"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        load_effect(path)
    with pytest.raises(InputError, match="no effect file"):
        load_effect(tmp_path / "nowhere.py")


@each
@both
def test_it_has_an_impedance_or_says_why_not(effect, model):
    skip_what_the_model_holds(effect, model)
    if effect.id == "lithium_plating":
        with pytest.raises(InputError, match="no linear answer at rest"):
            impedance(CELL, [0.01, 10.0], 0.5, effects=[effect.activate()], model=model)
        return
    assert np.isfinite(impedance(CELL, [0.01, 10.0], 0.5, effects=[effect.activate()], model=model)).all()
