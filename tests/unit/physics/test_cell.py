"""Cells from BPX files: both versions, round trip, and one clear sentence for what cannot be used."""

import copy
import json
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path

import bpx
import numpy as np
import pytest

from aesi.errors import CellError, DataError, InputError
from aesi.physics import Cell, initial_soc
from aesi.physics.cell import read_soh

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.fixture
def content() -> dict:
    return json.loads((CELLS / "lg_m50_chen2020.bpx.json").read_text())


def as_version_0(content: dict) -> dict:
    """The same cell as files of version 0.x put it."""
    old = copy.deepcopy(content)
    old["Header"]["BPX"] = 0.4
    initial = old.pop("State")["Initial conditions"]
    parts = old["Parameterisation"]
    parts["Electrolyte"]["Initial concentration [mol.m-3]"] = initial[
        "Initial electrolyte concentration [mol.m-3]"
    ]
    parts["Cell"] |= {"Initial temperature [K]": 298.15, "Ambient temperature [K]": 298.15}
    parts["Cell"]["Thermal conductivity [W.m-1.K-1]"] = 1.0
    return old


@pytest.mark.parametrize("name", ["lg_m50_chen2020", "nmc_30ah"])
def test_a_cell_survives_the_way_to_a_file_and_back(name):
    cell = Cell.from_bpx(CELLS / f"{name}.bpx.json")
    assert Cell.from_bpx(json.loads(json.dumps(cell.to_bpx()))) == cell


def test_the_schema_accepts_what_is_written(nmc):
    import bpx

    bpx.parse_bpx_obj(nmc.to_bpx())


def test_both_versions_give_the_same_cell(content):
    content["State"]["Thermal environment"].pop(
        "Heat transfer coefficient [W.m-2.K-1]", None
    )  # not in version 0
    assert Cell.from_bpx(as_version_0(content)) == Cell.from_bpx(content)


def test_reading_leaves_the_callers_dict_alone(content):
    before = copy.deepcopy(content)
    Cell.from_bpx(content)
    assert content == before


def test_the_30_ah_cell_is_the_published_one_with_more_electrode_pairs(nmc):
    assert nmc.electrode_pairs == 82
    assert nmc.nominal_capacity_ah == 30.0
    assert "34" in nmc.description


def test_the_lg_m50_has_the_capacity_of_its_windows_and_rests_at_its_cut_offs(lg_m50):
    p = lg_m50.positive
    window = (p.theta_max - p.theta_min) * lg_m50.electrode_capacity_ah(p)
    assert lg_m50.capacity_ah == pytest.approx(window, rel=1e-5)  # limits are written with six digits
    assert lg_m50.rest_voltage_v(np.array([0.0, 1.0])) == pytest.approx([2.5, 4.2], abs=1e-4)


def test_contact_resistance_travels_in_the_user_section(content):
    content["Parameterisation"]["User-defined"] = {"Contact resistance [Ohm]": 0.002}
    cell = Cell.from_bpx(content)
    assert cell.contact_resistance_ohm == 0.002
    assert Cell.from_bpx(cell.to_bpx()) == cell


def test_what_bpx_has_no_field_for_travels_in_the_user_section(content):
    content["Parameterisation"]["User-defined"] = {
        "Negative electrode reaction rate factor": {"x": [0.1, 0.9], "y": [0.5, 2.0]},
        "Positive electrode double-layer capacity [F.m-2]": 0.3,
        "Fitted with dfn": 1.0,
        "Capacity share by record": {"march": 1.0, "july": 0.9},
        "Day of test by record [YYYYMMDD]": {"july": 20170731},
        "Mean temperature by record [K]": {"march": 298.4, "july": 283.15},
    }
    cell = Cell.from_bpx(content)
    assert float(cell.negative.rate_factor(np.array([0.5]))[0]) == pytest.approx(1.25)
    assert cell.positive.double_layer_f_m2 == 0.3
    assert cell.fitted_with == "dfn"
    assert dict(cell.capacity_shares) == {"march": 1.0, "july": 0.9}
    assert cell.tested_on == (("july", date(2017, 7, 31)),)
    assert cell.fitted_at_k == (("march", 298.4), ("july", 283.15))
    assert not cell.unread
    assert Cell.from_bpx(cell.to_bpx()) == cell


@pytest.mark.parametrize("film", [{}, {"Negative electrode film resistance [Ohm.m2]": 0.0}])
def test_an_activation_energy_of_a_film_is_kept_where_the_file_declares_no_film(content, film):
    energy = "Negative electrode film resistance activation energy [J.mol-1]"
    content["Parameterisation"]["User-defined"] = {energy: 4e4, **film}
    cell = Cell.from_bpx(content)
    assert cell.to_bpx()["Parameterisation"]["User-defined"] == {energy: 4e4}
    assert Cell.from_bpx(cell.to_bpx()) == cell


def test_a_record_at_celsius_is_told_that_it_is_in_kelvin(content):
    content["Parameterisation"]["User-defined"] = {"Mean temperature by record [K]": {"july": 10.0}}
    with pytest.raises(
        CellError, match=r"Mean temperature by record \[K\]: july = 10 is no temperature of a cell"
    ):
        Cell.from_bpx(content)


def test_tables_are_accepted_for_every_function(content):
    parts = content["Parameterisation"]
    parts["Negative electrode"]["OCP [V]"] = {"x": [0.0, 0.5, 1.0], "y": [1.0, 0.2, 0.05]}
    parts["Negative electrode"]["Diffusivity [m2.s-1]"] = {"x": [0.0, 1.0], "y": [1e-14, 3e-14]}
    parts["Electrolyte"]["Conductivity [S.m-1]"] = {"x": [0.0, 4000.0], "y": [0.1, 1.5]}
    cell = Cell.from_bpx(content)
    assert float(cell.negative.ocp(np.array([0.25]))[0]) == pytest.approx(0.6)


def fault(content: dict) -> str:
    with pytest.raises(CellError) as caught:
        Cell.from_bpx(content)
    message = str(caught.value)
    assert "\n" not in message
    return message


BEYOND_FLOATS = 10**400


@pytest.mark.parametrize(
    ("section", "field", "value", "below"),
    [
        ("Cell", "Electrode area [m2]", BEYOND_FLOATS, ""),
        ("Cell", "Number of electrode pairs connected in parallel to make a cell", BEYOND_FLOATS, ""),
        ("Electrolyte", "Conductivity [S.m-1]", -BEYOND_FLOATS, ""),
        ("Positive electrode", "OCP [V]", {"x": [0.0, 1.0], "y": [BEYOND_FLOATS, 3.0]}, ": y"),
        ("Positive electrode", "OCP [V]", {"x": (0.0, 1.0), "y": (BEYOND_FLOATS, 3.0)}, ": y"),
        (
            "Positive electrode",
            "OCP [V]",
            {"x": [0.0, 1.0], "y": np.array([BEYOND_FLOATS, 3.0], object)},
            ": y",
        ),
        ("User-defined", "Contact resistance [Ohm]", BEYOND_FLOATS, ""),
    ],
    ids=["number", "count", "negative", "table", "tuple", "array", "own"],
)
def test_a_whole_number_that_no_float_holds_is_told_with_its_field(content, section, field, value, below):
    content["Parameterisation"].setdefault(section, {})[field] = value
    assert fault(content) == (
        f"BPX data: Parameterisation: {section}: {field}{below} holds a whole number of more than 308 digits, which no "
        "value of a cell has; correct it."
    )


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("Parameterisation", "Cell", "Nominal cell capacity [A.h]"), True),
        (("Parameterisation", "Negative electrode", "Conductivity [S.m-1]"), True),
        (("Parameterisation", "Electrolyte", "Conductivity activation energy [J.mol-1]"), False),
        (("State", "Initial conditions", "Initial state-of-charge"), True),
    ],
    ids=["capacity", "electrode", "energy", "state"],
)
def test_a_truth_value_was_taken_for_a_number(content, path, value):
    *sections, field = path
    section = content
    for name in sections:
        section = section.setdefault(name, {})
    section[field] = value
    assert fault(content) == f"BPX data: {': '.join(path)} is {value}; give a number."


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('{"Header": ' + 5000 * "1" + "}", "holds a whole number of thousands of digits"),
        (100_000 * "[", "nests its sections more deeply than any BPX file does"),
    ],
    ids=["digits", "depth"],
)
def test_what_json_cannot_hold_in_python_is_one_sentence(tmp_path, text, told):
    path = tmp_path / "cell.json"
    path.write_text(text)
    with pytest.raises(CellError, match=rf"cell\.json {told}"):
        Cell.from_bpx(path)


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan])
def test_no_number_of_a_file_is_taken_that_is_not_finite(content, value):
    """JSON readers take 1e999, Infinity and NaN."""
    parts = content["Parameterisation"]
    parts["Electrolyte"]["Cation transference number"] = value
    assert f"Electrolyte: transference = {value:g} has to be a share below 1" in fault(content)


def test_a_missing_field_is_named(content):
    del content["Parameterisation"]["Positive electrode"]["Thickness [m]"]
    assert "Thickness [m]" in fault(content)


@pytest.mark.parametrize(
    ("section", "taken", "given", "sentence"),
    [
        (
            "Positive electrode",
            "Thickness [m]",
            {"Thickness m": 1e-5},
            r"'Positive electrode > Thickness \[m\]' is missing, and 'Thickness m' there is no field of BPX; rename",
        ),
        (
            "Cell",
            "",
            {"Foo [m]": 1.0},
            r"'Cell > Foo \[m\]' is no field of BPX there; take it out, or put it into",
        ),
        ("Cell", "", {"Density [kg/m3]": 1.0}, r"no field of BPX there; did you mean 'Density \[kg.m-3\]'\?"),
        ("Separator", "", {"Conductivity [S.m-1]": 1.0}, "no field of BPX there; take it out"),
        ("Cell", "", {"Volume [m3]": [1]}, r"Cell > Volume \[m3\] = \[1\] has to be a valid number\."),
        (
            "Electrolyte",
            "",
            {"Diffusivity [m2.s-1]": {"x": [0, 1], "z": [1, 2]}},
            r"Electrolyte, Diffusivity \[m2.s-1\] is dict; give a number, an expression in x or a table",
        ),
    ],
)
def test_what_fails_the_schema_was_told_in_words_of_the_schema(content, section, taken, given, sentence):
    fields = content["Parameterisation"][section]
    fields.pop(taken, None)
    fields.update(given)
    with pytest.raises(CellError, match=sentence):
        Cell.from_bpx(content)


@pytest.mark.parametrize("soc", [2, -0.1, 95])
def test_a_state_of_charge_that_is_no_share_is_refused(content, soc):
    content["State"]["Initial conditions"]["Initial state-of-charge"] = soc
    assert f"Initial state-of-charge = {soc} has to be from 0 (empty) to 1 (full)" in fault(content)


def test_of_a_field_that_is_there_twice_the_last_was_taken_without_a_word(content, tmp_path):
    text = json.dumps(content)
    path = tmp_path / "cell.json"
    path.write_text(text.replace('"Porosity": ', '"Porosity": 0.3, "Porosity": ', 1))
    with pytest.raises(CellError, match=r"cell\.json: the field 'Porosity' is there twice in one section"):
        Cell.from_bpx(path)


def test_a_missing_concentration_is_named(content):
    del content["State"]["Initial conditions"]["Initial electrolyte concentration [mol.m-3]"]
    assert "Initial electrolyte concentration" in fault(content)


def test_a_single_particle_file_is_refused(content):
    content["Header"]["Model"] = "SPM"
    del content["Parameterisation"]["Electrolyte"]
    assert "Electrolyte" in fault(content)


def test_a_full_cell_under_the_header_of_a_single_particle_was_told_in_words_of_the_schema(content):
    content["Header"]["Model"] = "SPM"
    assert 'those of a full cell; write "Model": "SPMe" there, or "DFN".' in fault(content)


@pytest.mark.parametrize("direction", ["lithiation", "delithiation"])
@pytest.mark.parametrize("value", [np.nan, np.inf, "log(x - 0.5)"])
def test_a_potential_of_one_direction_was_taken_without_being_a_number(content, direction, value):
    field = f"OCP ({direction}) [V]"
    content["Parameterisation"]["Negative electrode"][field] = value
    assert f"Negative electrode: {field} is not finite at a stoichiometry of" in fault(content)


@pytest.mark.parametrize("value", [np.nan, np.inf, -5.0])
def test_a_decay_of_hysteresis_was_taken_without_being_a_number_from_0_on(content, value):
    content["Parameterisation"]["Negative electrode"]["OCP hysteresis decay constant"] = value
    assert "OCP hysteresis decay constant = " in fault(content)


def test_a_blend_is_refused(content):
    content["Parameterisation"]["Negative electrode"]["Particle"] = {"Primary": {}}
    assert "blend" in fault(content)


def test_what_a_file_declares_beyond_the_model_was_passed_over_in_silence(content):
    assert Cell.from_bpx(content).unread == ()
    negative = content["Parameterisation"]["Negative electrode"]
    negative["OCP (lithiation) [V]"] = negative["OCP (delithiation) [V]"] = negative["OCP [V]"]
    content["State"]["Degradation"] = {
        "LLI": 0.05,
        "LAM: Positive electrode": 0.0,
        "LAM: Negative electrode": 0,
    }
    content["Parameterisation"]["User-defined"] = {"Contact resistance [Ohm]": 1e-3, "Swelling": 0.1}
    hysteresis, aged, own = Cell.from_bpx(content).unread
    assert "declares a hysteresis (Negative electrode" in hysteresis
    assert "(LLI 0.05)" in aged
    assert own.endswith("(User-defined): Swelling.")


def test_the_state_that_a_file_begins_in_was_passed_over_and_written_as_full(content):
    initial = content["State"]["Initial conditions"]
    initial["Initial state-of-charge"] = 0.3
    initial["Initial hysteresis state: Negative electrode"] = 0.9
    cell = Cell.from_bpx(content)
    (said,) = cell.unread
    assert (
        "(Initial state-of-charge 0.3, Initial hysteresis state: Negative electrode 0.9), which is not"
        in said
    )
    written = cell.to_bpx()
    assert written["State"]["Initial conditions"]["Initial state-of-charge"] == 0.3
    assert Cell.from_bpx(written) == cell
    del initial["Initial state-of-charge"], initial["Initial hysteresis state: Negative electrode"]
    assert Cell.from_bpx(content).unread == ()
    assert Cell.from_bpx(content).initial_soc == 1.0


def test_a_field_of_the_first_versions_of_bpx_was_lost_without_a_word(content):
    """How the cell conducts: of the same name as what a winding conducts by, in a section of its own."""
    state = content.pop("State")["Initial conditions"]
    parts = content["Parameterisation"]
    content["Header"]["BPX"] = "0.4.0"
    parts["Cell"] |= {"Ambient temperature [K]": 288.15, "Initial temperature [K]": 278.15}
    name = "Initial electrolyte concentration [mol.m-3]"
    parts["Electrolyte"]["Initial concentration [mol.m-3]"] = state[name]
    plain = Cell.from_bpx(content)
    assert plain.unread == ()
    assert (plain.ambient_temperature_k, plain.initial_temperature_k) == (288.15, 278.15)
    parts["Cell"]["Thermal conductivity [W.m-1.K-1]"] = 0.4
    conducting = Cell.from_bpx(content)
    (said,) = conducting.unread
    assert "of BPX 0.x, that are not read (Cell): Thermal conductivity [W.m-1.K-1]; how a winding" in said
    assert conducting == plain


def test_a_relation_that_does_not_hold_where_surfaces_and_salt_come_was_replaced_in_silence(content):
    parts = content["Parameterisation"]
    parts["Negative electrode"]["Diffusivity [m2.s-1]"] = "4e-14 * (0.95 - x)"
    parts["Electrolyte"]["Conductivity [S.m-1]"] = "2e-3 * x * (1 - 6e-4 * x)"
    parts["Positive electrode"]["OCP [V]"] = {"x": [0.1, 0.95], "y": [4.4, 3.0]}
    solid, table, salt = Cell.from_bpx(content).unread
    assert "of the negative electrode is no positive number at stoichiometries of 0.95 to 1:" in solid
    assert "of the positive electrode is a table from 0.1 to 0.95" in table
    assert "under load" in table
    assert "conductivity of the electrolyte is no positive number at 1668 to 2000 mol/m3" in salt
    parts["Positive electrode"]["OCP [V]"] = {"x": [0.4, 0.8], "y": [4.3, 3.0]}
    short = Cell.from_bpx(content).unread[1]
    assert "its stoichiometry limits are" in short
    assert "so that at rest, too, it stays at the last value" in short


def test_two_rows_of_a_table_that_were_swapped_made_a_potential_rise_in_silence(content):
    side = content["Parameterisation"]["Positive electrode"]
    ocp = Cell.from_bpx(content).positive.ocp
    x = np.linspace(0.0, 1.0, 101)
    y = ocp(x)
    side["OCP [V]"] = {"x": x.tolist(), "y": y.tolist()}
    assert Cell.from_bpx(content).unread == ()
    risen_v = y[49] - y[50]
    y[[49, 50]] = y[[50, 49]]
    side["OCP [V]"] = {"x": x.tolist(), "y": y.tolist()}
    (said,) = Cell.from_bpx(content).unread
    assert (
        f"positive electrode rises by {1e3 * risen_v:.0f} mV between the stoichiometries 0.49 and 0.5,"
        in said
    )


def test_potentials_that_are_constant_in_both_electrodes_are_told(content):
    content["Parameterisation"]["Negative electrode"]["OCP [V]"] = 0.1
    assert Cell.from_bpx(content).unread == ()  # of one electrode, as lithium metal's, it may be
    content["Parameterisation"]["Positive electrode"]["OCP [V]"] = 3.8
    (said,) = Cell.from_bpx(content).unread
    assert "3.7 V at every state of charge" in said


def test_a_potential_over_the_lithium_that_was_taken_out_is_refused(content):
    side = content["Parameterisation"]["Positive electrode"]
    side["OCP [V]"] = {"x": [0.0, 1.0], "y": [3.0, 4.4]}
    with pytest.raises(CellError, match="Positive electrode: the open-circuit potential rises from 3"):
        Cell.from_bpx(content)


@pytest.mark.parametrize("times", [3.0, 1.0 / 3.0])
def test_a_nominal_capacity_that_the_electrodes_do_not_hold_was_passed_over_in_silence(content, times):
    cell = content["Parameterisation"]["Cell"]
    held = Cell.from_bpx(content).capacity_ah
    cell["Nominal cell capacity [A.h]"] *= times
    (said,) = Cell.from_bpx(content).unread
    assert (
        f"declares {cell['Nominal cell capacity [A.h]']:.4g} Ah, and its negative electrode holds {held:.4g}"
        in said
    )


def test_a_placeholder_for_an_open_circuit_potential_is_refused(content):
    content["Parameterisation"]["Negative electrode"]["OCP [V]"] = 0
    with pytest.raises(CellError, match="OCP \\[V\\] is 0 at all stoichiometries"):
        Cell.from_bpx(content)


def test_stoichiometry_limits_in_the_wrong_order_are_refused(content):
    content["Parameterisation"]["Negative electrode"]["Minimum stoichiometry"] = 0.99
    assert "stoichiometry limits" in fault(content)


def test_a_negative_thickness_is_refused(content):
    content["Parameterisation"]["Separator"]["Thickness [m]"] = -1e-5
    assert "Separator: Thickness [m] = -1e-05 has to be a positive number" in fault(content)


@pytest.mark.parametrize(
    ("section", "changes", "sentence"),
    [
        (
            "Negative electrode",
            {"Diffusivity [m2.s-1]": -1e-14},
            "diffusivity is -1e-14 at a stoichiometry of",
        ),
        (
            "Negative electrode",
            {"Diffusivity [m2.s-1]": "1e-14 * (0.5 - x)"},
            "diffusivity is -.* positive number",
        ),
        (
            "Positive electrode",
            {"OCP [V]": "4.0 + log(x - 0.5)"},
            "potential is not finite at a stoichiometry",
        ),
        ("Positive electrode", {"Porosity": 33.5}, "porosity = 33.5 has to be a share below 1; 30 % is 0.3"),
        (
            "Separator",
            {"Transport efficiency": 12.8},
            "Separator: transport efficiency = 12.8 has to be a share below 1",
        ),
        (
            "Negative electrode",
            {"Diffusivity activation energy [J.mol-1]": 3.5e7},
            r"Diffusivity activation energy \[J.mol-1\] = 3.5e.07 is 35000 kJ/mol",
        ),
        ("Electrolyte", {"Conductivity [S.m-1]": "1.0 - x"}, "conductivity is -999 at 1000 mol/m3"),
        (
            "Cell",
            {"Lower voltage cut-off [V]": 4.2, "Upper voltage cut-off [V]": 2.5},
            r"the lower cut-off \(4.2 V\) has to be at least 0.1 V and below the upper one \(2.5 V\)",
        ),
        (
            "Cell",
            {"Reference temperature [K]": 25.0},
            r"Reference temperature \[K\] = 25 is no temperature of a cell; 25 degC is 298.15 K",
        ),
        (
            "Cell",
            {"Nominal cell capacity [A.h]": 5000.0},
            "the nominal capacity is 5000 A.h, but the negative electrode holds 5.153 A.h",
        ),
        ("Electrolyte", {"Cation transference number": 38.0}, "transference = 38 has to be a share below 1"),
        ("Electrolyte", {"Cation transference number": float("nan")}, "transference = nan has to be a share"),
        ("Cell", {"Upper voltage cut-off [V]": 4200.0}, "rests at 4.182 V .* the upper cut-off is 4200 V"),
        (
            "Negative electrode",
            {"Reaction rate constant activation energy [J.mol-1]": -35000.0},
            r"Reaction rate constant activation energy \[J.mol-1\] = -35000 has to be 0 or more",
        ),
        (
            "Positive electrode",
            {"Entropic change coefficient [V.K-1]": -0.1},
            r"coefficient is 0.1 V/K, more than any electrode's; .* 0.1 mV/K is 0.0001",
        ),
        ("Cell", {"Density [kg.m-3]": -5.0}, r"Density \[kg.m-3\] = -5 has to be a positive number"),
        (
            "Negative electrode",
            {"OCP [V]": {"x": [2.6, 30.0, 95.0], "y": [0.9, 0.15, 0.05]}},
            r"OCP \[V\]: x of a table runs from 2.6 to 95; .* 30 % is 0.3",
        ),
        (
            "Positive electrode",
            {"Diffusivity [m2.s-1]": {"x": [0.0, 50.0, 100.0], "y": [1e-14, 2e-14, 3e-14]}},
            r"Positive electrode, Diffusivity \[m2.s-1\]: x of a table runs from 0 to 100",
        ),
        (
            "Electrolyte",
            {"Conductivity [S.m-1]": {"x": [0.1, 1.0, 2.0], "y": [0.3, 0.95, 0.8]}},
            r"conductivity: x of a table runs from 0.1 to 2, without .* \(1000 mol/m3\); .* 1 mol/L is 1000",
        ),
        ("Cell", {"Volume [m3]": 24.2}, "density, specific heat capacity and volume make 8.56e"),
    ],
)
def test_values_that_no_cell_has_are_refused(content, section, changes, sentence):
    content["Parameterisation"][section] |= changes
    with pytest.raises(CellError, match=sentence):
        Cell.from_bpx(content)


@pytest.mark.parametrize(
    ("section", "field", "factor", "sentence"),
    [
        ("Separator", "Thickness [m]", 1e6, "Separator: thickness = 12 m is outside .* 12 um is 1.2e-05"),
        ("Separator", "Thickness [m]", 1e3, "Separator: thickness = 0.012 m is outside"),
        ("Electrolyte", "Conductivity [S.m-1]", 1e-2, "conductivity = 0.00948.* S/m .* 0.01 S/cm is 1"),
        ("Electrolyte", "Conductivity [S.m-1]", 10.0, "conductivity = 9.48.* S/m .* 10 mS/cm"),
        (
            "Electrolyte",
            "Diffusivity [m2.s-1]",
            1e4,
            "diffusivity = 1.769.*e-06 m2/s .* 2e-06 cm2/s is 2e-10",
        ),
        ("Negative electrode", "Diffusivity [m2.s-1]", 1e4, "Negative .* = 3.3e-10 m2/s .* in 0.1 s"),
        ("Positive electrode", "Diffusivity [m2.s-1]", 1e4, "Positive .* 1e-10 cm2/s is 1e-14"),
        (
            "Positive electrode",
            "Conductivity [S.m-1]",
            1e-2,
            "Positive .* = 0.0018 S/m takes 0.68 V .* 0.01 S/cm is 1",
        ),
        ("Negative electrode", "Reaction rate constant [mol.m-2.s-1]", 1e-4, "Negative .* exchange current"),
        ("Cell", "Lower voltage cut-off [V]", 1e3, "lower cut-off .2500 V. .* 2500 mV is 2.5"),
        ("Cell", "Lower voltage cut-off [V]", 1e-3, "lower cut-off .0.0025 V. has to be at least 0.1 V"),
    ],
)
def test_a_value_in_another_unit_is_refused(content, section, field, factor, sentence):
    fields = content["Parameterisation"][section]
    value = fields[field]
    fields[field] = f"({value}) * {factor!r}" if isinstance(value, str) else factor * value
    with pytest.raises(CellError, match=sentence):
        Cell.from_bpx(content)


@pytest.mark.parametrize("conductivity", [0.95, "0.1297 * (x / 1000) ** 3 - 0.001"])
def test_a_salt_concentration_in_mol_l_was_passed_over_or_blamed_on_the_conductivity(content, conductivity):
    content["Parameterisation"]["Electrolyte"]["Conductivity [S.m-1]"] = conductivity
    content["State"]["Initial conditions"]["Initial electrolyte concentration [mol.m-3]"] = 1.2
    with pytest.raises(CellError, match=r"Initial electrolyte .* = 1.2 is outside .* 1 mol/L is 1000"):
        Cell.from_bpx(content)


@pytest.mark.parametrize("coefficient", [-10.0, float("nan"), float("inf")])
def test_a_heat_transfer_coefficient_that_no_cell_has_was_told_under_another_name(content, coefficient):
    name = "Heat transfer coefficient [W.m-2.K-1]"
    content["State"]["Thermal environment"] = {name: coefficient, "Ambient temperature [K]": 298.15}
    with pytest.raises(CellError, match=r"Heat transfer coefficient .* has to be a number from 0"):
        Cell.from_bpx(content)


@pytest.mark.parametrize("name", ["reference", "initial", "ambient"])
def test_a_temperature_of_0_in_a_file_was_taken_for_25_degc(content, name):
    state = content["State"]
    parts = {
        "reference": content["Parameterisation"]["Cell"],
        "initial": state["Initial conditions"],
        "ambient": state.setdefault("Thermal environment", {}),
    }
    parts[name][f"{name.capitalize()} temperature [K]"] = 0.0
    with pytest.raises(CellError, match=rf"{name.capitalize()} temperature \[K\] = 0 is .* 298.15 K"):
        Cell.from_bpx(content)


@pytest.mark.parametrize(
    ("own", "sentence"),
    [
        ({"Contact resistance [Ohm]": "1e-3 Ohm"}, "Contact resistance .* = '1e-3 Ohm' has to be a number"),
        ({"Negative electrode double-layer capacity [F.m-2]": -0.2}, "-0.2 has to be a number from 0 on"),
        (
            {"Capacity share by record": 0.9},
            "Capacity share by record = 0.9 has to hold a number for each record",
        ),
        ({"Capacity share by record": {"drive": [0.9]}}, r"drive = \[0.9\] has to be a number"),
        (["Contact resistance [Ohm]"], "'User-defined' is list"),
        ({"Contact resistance [Ohm]": -0.03}, "-0.03 has to be a number from 0 on"),
        ({"Contact resistance [Ohm]": 5}, "takes 25 V at 5 A, more than the 1.7 V .* 5 mOhm is 0.005"),
        ({"Capacity share by record": {"a": 95}}, "a = 95 is no share of the file's capacity; 95 % is 0.95"),
        ({"Fitted with espm": 7}, "Fitted with espm = 7 has to be 1 or 0"),
        ({"Fitted with espm": 1, "Fitted with dfn": 1}, "are both 1; leave the one"),
        (
            {"Negative electrode film resistance [Ohm.m2]": "0.01 - x"},
            r"film resistance \[Ohm.m2\] is -0.01 at a stoichiometry of 0.02; it has to be 0 or more",
        ),
        (
            {"Negative electrode film resistance [Ohm.m2]": 3.0},
            r"film resistance .* = 3 takes 4.46 V at 5 A over 3.36 m2 .* 10 Ohm.cm2, is 0.001",
        ),
        (
            {"Negative electrode double-layer capacity [F.m-2]": 2e4},
            "capacity .* = 20000 is no double layer's; .* 20 uF/cm2 is 0.2",
        ),
        ({"Positive electrode double-layer capacity [F.m-2]": 2e-5}, "= 2e-05 is no double layer's"),
        ({"Thermal conductivity [W.m-1.K-1]": 200.0}, "= 200 is no winding's; .* 200 mW/.m K. is 0.2"),
        ({"Thermal conductivity [W.m-1.K-1]": 0.002}, "= 0.002 is no winding's"),
        ({"Thermal conductivity [W.m-1.K-1]": 0.0}, "Thermal conductivity .* = 0 has to be"),
        (
            {"Positive electrode reaction rate factor": 0.0},
            "reaction rate factor is 0 at a stoichiometry of 0; it has to be a positive number",
        ),
    ],
)
def test_what_no_cell_has_in_the_user_s_section_is_refused(content, own, sentence):
    content["Parameterisation"]["User-defined"] = own
    with pytest.raises(CellError, match=sentence):
        Cell.from_bpx(content)


def test_a_fit_may_move_transport_further_than_a_file_declares_it(content):
    fields = content["Parameterisation"]["Negative electrode"]
    fields["Diffusivity [m2.s-1]"] *= 1e4
    assert Cell.from_bpx(content, fitted=True).negative.diffusivity(np.array([0.5]))[0] == pytest.approx(
        3.3e-10
    )


def test_electrodes_that_are_swapped_and_energies_in_kilojoule_are_refused(content):
    parts = content["Parameterisation"]
    negative, positive = parts["Negative electrode"], parts["Positive electrode"]
    swapped = content | {
        "Parameterisation": parts | {"Negative electrode": positive, "Positive electrode": negative}
    }
    assert "or the electrodes are swapped" in fault(swapped)
    for side, field in (("Negative", "Reaction rate constant"), ("Positive", "Diffusivity")):
        one = copy.deepcopy(content)
        one["Parameterisation"][f"{side} electrode"][f"{field} activation energy [J.mol-1]"] = 35.0
        assert f"{side} electrode: {field} activation energy [J.mol-1] = 35 is as good as none" in fault(one)


def test_a_fit_may_leave_an_activation_energy_that_is_as_good_as_none(content):
    content["Parameterisation"]["Negative electrode"]["Diffusivity activation energy [J.mol-1]"] = 35.0
    content["Parameterisation"]["User-defined"] = {"Fitted with espm": 1}
    assert Cell.from_bpx(content).negative.diffusivity_ea_j_mol == 35.0


def test_a_file_with_a_byte_order_mark_is_read(content, tmp_path):
    path = tmp_path / "cell.json"
    path.write_text(json.dumps(content), encoding="utf-8-sig")
    assert Cell.from_bpx(path) == Cell.from_bpx(content)


def test_text_instead_of_a_number_is_refused(content):
    content["Parameterisation"]["Cell"]["Nominal cell capacity [A.h]"] = "five"
    assert "Nominal cell capacity" in fault(content)


@pytest.mark.parametrize("version", ["9.9", 2.0, "1", "x", None])
def test_a_version_that_is_not_read_is_refused(content, version):
    content["Header"]["BPX"] = version
    assert f"version of BPX in its Header is {version!r}, and versions 0.x and 1.x are read" in fault(content)


def test_code_in_an_open_circuit_potential_is_refused_and_not_run(content, tmp_path):
    mark = tmp_path / "ran"
    content["Parameterisation"]["Negative electrode"]["OCP [V]"] = f"open('{mark}', 'w')"
    assert "OCP" in fault(content)
    assert not mark.exists()


def test_files_that_are_not_there_or_not_json_are_named(tmp_path):
    with pytest.raises(CellError, match=r"nowhere\.json"):
        Cell.from_bpx(tmp_path / "nowhere.json")
    broken = tmp_path / "broken.json"
    broken.write_text("{")
    with pytest.raises(CellError, match=r"broken\.json is not JSON"):
        Cell.from_bpx(broken)


def test_a_file_that_is_no_text_is_refused_in_one_sentence(tmp_path):
    (tmp_path / "record.mpr").write_bytes(bytes(range(256)))
    with pytest.raises(CellError, match=r"record\.mpr is not text .* is it a record\?"):
        Cell.from_bpx(tmp_path / "record.mpr")


def test_a_title_that_ends_in_a_full_stop_ended_the_sentences_that_it_stands_in(content):
    content["Header"]["Title"] = "Parameterisation example of an LFP|graphite 2 Ah cell."
    assert Cell.from_bpx(content).name == "Parameterisation example of an LFP|graphite 2 Ah cell"


def test_a_cell_file_in_latin_1_was_taken_for_a_record(content, tmp_path):
    content["Header"]["Title"] = "Zelle für Prüfstand 3"
    path = tmp_path / "cell.json"
    path.write_bytes(json.dumps(content, ensure_ascii=False).encode("latin-1"))
    with pytest.raises(CellError, match=r"cell\.json is not written in UTF-8, .*; save it as UTF-8\."):
        Cell.from_bpx(path)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('{"Header": {', "it is damaged or cut short"),
        ("\n", "it is empty"),
        ("name: smoke\n", "is it a record or an experiment?"),
    ],
)
def test_a_cell_file_that_was_cut_short_was_taken_for_a_record(tmp_path, content, words):
    (tmp_path / "cell.json").write_text(content)
    with pytest.raises(CellError) as refused:
        Cell.from_bpx(tmp_path / "cell.json")
    assert words in str(refused.value)


@pytest.mark.parametrize("soc", [0.02, 0.4, 0.97])
def test_the_rest_voltage_leads_back_to_the_state_of_charge(lg_m50, soc):
    voltage = float(lg_m50.rest_voltage_v(soc)[0])
    assert initial_soc(lg_m50, voltage) == pytest.approx(soc, abs=2e-4)  # table of 4,001 points


def test_a_rest_voltage_out_of_range_says_which_range(lg_m50):
    with pytest.raises(DataError, match=r"5\.0000 V lies outside"):
        initial_soc(lg_m50, 5.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"cell": "cell.bpx.json"}, "cell is the text 'cell.bpx.json', not a Cell"),
        ({"voltage_v": "3.7"}, "voltage_v = '3.7' is not a voltage; give one number, in V"),
        ({"voltage_v": [3.7, 3.8]}, r"voltage_v = \[3.7, 3.8\] is not a voltage"),
        ({"kelvin": 25.0}, "kelvin = 25.0 is not from 213.15 to 423.15 K, where cells work"),
    ],
)
def test_a_state_from_what_is_no_rest_voltage_ended_in_a_type_error_or_at_25_kelvin(lg_m50, given, words):
    with pytest.raises(InputError, match=words):
        initial_soc(**({"cell": lg_m50, "voltage_v": 3.7} | given))


@pytest.mark.parametrize("path", sorted(CELLS.glob("*.bpx.json")), ids=lambda path: path.name)
def test_the_standards_own_reader_takes_each_shipped_file(path):
    assert bpx.parse_bpx_obj(json.loads(path.read_text(encoding="utf-8"))) is not None


def test_a_state_of_health_takes_capacity_and_leaves_the_rest_voltages(lg_m50):
    aged = lg_m50.with_soh(0.9)
    assert aged.capacity_ah == pytest.approx(0.9 * lg_m50.capacity_ah)
    soc = np.linspace(0.0, 1.0, 5)
    assert np.array_equal(aged.rest_voltage_v(soc), lg_m50.rest_voltage_v(soc))
    assert lg_m50.with_soh(1.0) == lg_m50


@pytest.fixture
def dated(lg_m50):
    shares = (("begin", 1.02), ("again", 1.0), ("cold", 0.97), ("undated", 0.5), ("end", 0.952))
    days = (("begin", 11), ("again", 11), ("cold", 20), ("end", 30))
    return replace(lg_m50, capacity_shares=shares, tested_on=tuple((k, date(2017, 3, d)) for k, d in days))


def test_a_day_has_the_mean_share_of_its_records(dated):
    assert dated.soh_on(date(2017, 3, 11)) == pytest.approx(1.01)


def test_between_two_days_the_share_runs_evenly(dated, lg_m50):
    expected = 0.97 - 0.018 * 4 / 10
    assert dated.soh_on(date(2017, 3, 24)) == pytest.approx(expected)
    assert dated.soh_on(datetime(2017, 3, 24, 23, 59)) == pytest.approx(expected)
    assert dated.with_soh(date(2017, 3, 24)).capacity_ah == pytest.approx(expected * lg_m50.capacity_ah)


def test_a_cell_at_a_state_of_health_had_that_of_a_day_taken_off_twice(dated, lg_m50):
    aged = dated.with_soh(date(2017, 3, 30))
    for same in (aged.with_soh(date(2017, 3, 30)), Cell.from_bpx(aged.to_bpx()).with_soh(date(2017, 3, 30))):
        assert same.capacity_ah == pytest.approx(0.952 * lg_m50.capacity_ah)
    assert aged.with_soh(date(2017, 3, 11)).capacity_ah == pytest.approx(1.01 * lg_m50.capacity_ah)


@pytest.mark.parametrize("day", [date(2017, 3, 10), date(2017, 3, 31)])
def test_what_the_file_does_not_know_of_a_day_is_not_made_up(dated, day):
    with pytest.raises(CellError, match=r"knows its cell from 2017-03-11 to 2017-03-30; give the share"):
        dated.with_soh(day)


def test_a_file_that_knows_one_day_was_told_to_know_it_from_that_day_to_that_day(dated):
    first, *others = dated.tested_on
    one = replace(dated, tested_on=(first, *((name, first[1]) for name, _ in others)))
    with pytest.raises(CellError, match=rf"knows its cell on {first[1]} alone; give the share"):
        one.with_soh(date(2017, 6, 1))


def test_a_file_without_days_says_so(lg_m50):
    with pytest.raises(
        CellError, match=r"2017-03-24: the file of .* knows no day of its cell; give the share"
    ):
        lg_m50.with_soh(date(2017, 3, 24))


@pytest.mark.parametrize(("text", "soh"), [("0.97", 0.97), (" 1 ", 1.0), ("2018-11-13", date(2018, 11, 13))])
def test_a_state_of_health_is_read_as_a_share_or_a_day(text, soh):
    assert read_soh(text) == soh


@pytest.mark.parametrize("text", ["", "0,97", "97 %", "2018-13-11", "13.11.2018"])
def test_what_is_neither_a_share_nor_a_day_is_refused(text):
    with pytest.raises(
        CellError, match=r"give the share of the cell file's capacity .* or the day of the test"
    ):
        read_soh(text)


@pytest.mark.parametrize(
    ("days", "sentence"),
    [
        ({"july": 170731}, "july = 170731 is no day; 13 November 2018 is 20181113"),
        ({"july": 20171331}, "july = 20171331 is no day"),
        ({"august": 20170831}, "august has no share of the capacity; give it one in"),
        (20170731, "has to hold a number for each record"),
    ],
)
def test_days_that_are_none_are_named(content, days, sentence):
    content["Parameterisation"]["User-defined"] = {
        "Capacity share by record": {"july": 0.9},
        "Day of test by record [YYYYMMDD]": days,
    }
    assert sentence in fault(content)


@pytest.mark.parametrize("soh", [0.0, -0.1, 0.001, 97.0, float("nan")])
def test_a_state_of_health_that_is_no_share_is_refused(lg_m50, soh):
    with pytest.raises(CellError, match="share of the cell file"):
        lg_m50.with_soh(soh)


def test_a_body_is_that_of_a_cylinder_or_a_box_and_its_mass_that_of_the_cell(content):
    cell = Cell.from_bpx(content)
    # A 21700 of 70 g: pi/4 2.1^2 7.0 = 24.245 cm3, pi 2.1 7.0 + pi/2 2.1^2 = 53.109 cm2.
    round_one = cell.with_body((21.0, 70.0), 70.0)
    assert round_one.volume_m3 == pytest.approx(24.245e-6, rel=1e-4)
    assert round_one.surface_area_m2 == pytest.approx(53.109e-4, rel=1e-4)
    assert round_one.density_kg_m3 * round_one.volume_m3 == pytest.approx(0.070)
    flat = cell.with_body((200.0, 150.0, 10.0))
    assert flat.volume_m3 == pytest.approx(300e-6)
    assert flat.surface_area_m2 == pytest.approx(670e-4)
    assert flat.density_kg_m3 == cell.density_kg_m3
    assert flat.specific_heat_j_kg_k == cell.specific_heat_j_kg_k
    assert cell.with_body() is cell
    heavier = cell.with_body(mass_g=2000.0 * cell.density_kg_m3 * cell.volume_m3)
    assert heavier.heat_capacity_j_k == pytest.approx(2.0 * cell.heat_capacity_j_k)


@pytest.mark.parametrize(
    ("size_mm", "mass_g", "words"),
    [
        ((18.4,), None, r"a body of \(18.4,\) mm: give diameter and height"),
        ((0.0184, 0.065), None, "each from 0.1 to 5000 mm"),
        ((18.4, float("nan")), None, "each from 0.1 to 5000 mm"),
        ((18.4, 65.0), 0.047, "makes 2.72 kg/m3, and cells have some 2,500; the mass is in g"),
        ((1.84, 6.5), 47.0, "and the edges of the body in mm"),
        ((18.4, 65.0), float("nan"), "a mass of nan g"),
    ],
)
def test_a_body_that_no_cell_has_is_refused(content, size_mm, mass_g, words):
    with pytest.raises(CellError, match=words):
        Cell.from_bpx(content).with_body(size_mm, mass_g)


def test_a_mass_without_a_volume_is_refused(content):
    with pytest.raises(CellError, match="a mass of 47 g makes no density without a volume"):
        replace(Cell.from_bpx(content), volume_m3=None).with_body(mass_g=47.0)


def test_cut_offs_of_another_cell_are_taken_or_refused(content):
    cell = Cell.from_bpx(content)
    narrow = cell.with_cut_offs(2.8, 4.1)
    assert narrow == replace(cell, lower_voltage_v=2.8, upper_voltage_v=4.1)
    assert narrow.to_bpx()["Parameterisation"]["Cell"]["Upper voltage cut-off [V]"] == 4.1
    with pytest.raises(CellError, match=r"the lower cut-off \(4.1 V\) has to be"):
        cell.with_cut_offs(4.1, 2.8)
    with pytest.raises(CellError, match="the upper cut-off is 4200 V; one of them is in another unit"):
        cell.with_cut_offs(2800.0, 4200.0)


def test_the_state_of_charge_of_a_mean_stoichiometry_is_that_which_has_it(lg_m50):
    soc = np.array([-0.1, 0.0, 0.37, 1.0, 1.2])
    mean_n, _ = lg_m50.stoichiometries(soc)
    assert lg_m50.soc_of(mean_n) == pytest.approx(soc, abs=1e-15)


def test_a_cell_that_was_given_by_its_name_was_told_that_it_is_no_file_alone(tmp_path):
    (tmp_path / "lg_m50_chen2020.bpx.json").write_text("{}")
    with pytest.raises(
        CellError, match=r"there is no cell file .*lg_m50; did you mean 'lg_m50_chen2020"
    ) as told:
        Cell.from_bpx(tmp_path / "lg_m50")
    assert str(told.value).endswith("Give the path of a BPX file (.json).")
