"""What a refit moved, beside the verdict."""

import pytest

from aesi.physics.effects import CATALOGUE
from aesi.pipeline.report.words.moved import moved_findings, moved_summary, parameter_words
from aesi.pipeline.report.words.sizes import refit_does_as_well


def row(parameter, value, deviations, at_limit=False, effect="solid_diffusivity"):
    return {
        "effect": effect,
        "parameter": parameter,
        "declared": 1.0,
        "value": value,
        "unit": "dimensionless",
        "deviations": deviations,
        "one_sd": 0.35,
        "at_limit": at_limit,
    }


REFIT = {"before": {"fit": 8.0}, "recalibrated": {"fit": 5.0}, "after": {"fit": 5.0}}
OTHER = REFIT | {"after": {"fit": 1.0}}
FAR = row("negative_factor", 0.18, -4.0, at_limit=True)
STAYED = row("positive_factor", 1.02, 0.1)


def test_what_moved_is_named_with_how_far_and_what_ended_on_its_limit_is_said_so():
    (text,) = moved_findings(
        REFIT | {"effects": [], "own_parameters": {"recalibrated": [FAR, STAYED], "after": [FAR]}}
    )
    assert text == (
        "Recalibration moves solid diffusivity (negative) to 0.18 times declared (4.0 standard deviations of 35 % "
        "each). Solid diffusivity (negative) ended on its bound, and its value is not determined by the data."
    )


def test_a_factor_that_moved_by_a_little_is_not_called_once_what_was_declared():
    moved = row("conductivity_factor", 1.04, 1.4, effect="electrolyte_transport")
    assert moved_summary([moved]) == "electrolyte transport (conductivity) 1.04 times declared"


def test_what_was_put_on_top_of_the_file_was_told_as_all_of_it():
    """`series resistance to 4.1 mohm` was of a file that declares contacts of its own."""
    added = row("resistance_ohm", 4.1e-3, 1.2, True, "series_resistance") | {
        "declared": 0.0,
        "unit": "ohm",
        "one_sd": 3.4e-3,
    }
    lower = row("a2_v", -5.6e-3, -1.3, True, "ocp_shape") | {"declared": 0.0, "unit": "V", "one_sd": 4.3e-3}
    (text,) = moved_findings(REFIT | {"effects": [], "own_parameters": {"recalibrated": [lower, added]}})
    assert text == (
        "Recalibration moves ocp shape (a2) by -5.6 mV (1.3 standard deviations of 4.3 mV each); series resistance by "
        "+4.1 mohm (1.2 standard deviations of 3.4 mohm each). Ocp shape (a2) and series resistance ended on their "
        "bounds, and their values are not determined by the data."
    )


def test_with_a_finding_the_fit_beside_it_is_told_too():
    texts = moved_findings(
        OTHER | {"effects": ["self_heating"], "own_parameters": {"recalibrated": [FAR], "after": [STAYED]}}
    )
    assert texts[1] == (
        "The fit with the finding moves no declared parameter by more than one standard deviation of its prior in this "
        "fit."
    )


def test_where_nothing_was_fitted_nothing_is_told():
    assert moved_findings(REFIT | {"effects": [], "own_parameters": {"recalibrated": [], "after": []}}) == []


def test_a_state_of_charge_that_was_read_was_told_as_declared():
    moved = row("drive", 0.973, -2.7, effect="soc0") | {"unit": "1"}
    text = moved_summary([moved, STAYED])
    assert text == "the initial state of charge of drive 0.973 (from 1)"


def test_a_state_that_moved_a_little_was_told_to_have_moved_to_where_it_was():
    moved = row("drive", 0.99951, -2.9, effect="soc0") | {"unit": "1"}
    assert moved_summary([moved]) == "the initial state of charge of drive 0.9995 (from 1)"


def test_a_refit_that_moved_only_what_was_found_is_the_same_explanation():
    errors = {state: {"test": {"rmse_mv": 1.0}} for state in ("recalibrated", "after")}
    found = errors | {"effects": ["solid_diffusivity"]}
    assert not refit_does_as_well(found | {"own_parameters": {"recalibrated": [FAR, STAYED]}})
    other = row("positive_factor", 3.0, 3.1, effect="charge_transfer_kinetics")
    assert refit_does_as_well(found | {"own_parameters": {"recalibrated": [FAR, other]}})
    assert refit_does_as_well(found)


def test_a_parameter_that_is_named_by_its_effect_is_not_named_twice():
    assert (
        parameter_words(row("resistance_ohm", 8e-3, 2.0, effect="series_resistance")) == "series resistance"
    )
    assert parameter_words(FAR) == "solid diffusivity (negative)"


@pytest.mark.parametrize(
    ("effect", "name", "words"),
    [
        ("ocp_shape", "a1_v", "ocp shape (a1)"),
        ("clock_skew", "lag_s", "clock skew (lag)"),
        ("double_layer", "negative_f_m2", "double layer (negative)"),
        ("film_growth", "per_throughput_ohm_ah", "film growth (per throughput)"),
        ("film_growth", "per_root_time_ohm", "film growth (per root time)"),
        ("lithium_plating", "rate_m_s", "lithium plating (rate)"),
    ],
)
def test_a_parameter_was_told_with_the_letters_of_its_unit(effect, name, words):
    unit = CATALOGUE[effect].parameters[name].unit
    assert parameter_words(row(name, 1.0, 2.0, effect=effect) | {"unit": unit}) == words


def estimate(value, low, high, unit):
    return {"value": value, "low": low, "high": high, "unit": unit}


def colder(written_k):
    shift = {"shift_k": estimate(-13.2, -16.2, -10.1, "K")}
    return OTHER | {
        "effects": ["ambient_temperature"],
        "declared_degc": 25.0,
        "written": ["ambient_temperature"],
        "written_parameters": {"ambient_temperature": {"shift_k": written_k}},
        "candidates": [{"effect": "ambient_temperature", "kind": "parameter", "parameters": shift}],
    }


def test_a_written_model_with_what_was_found_at_another_size_is_told_as_such():
    """The cold drive of a Panasonic: the finding was 11.8 degC, the model beside it ran at 13.3 degC."""
    assert moved_findings(colder(-11.7)) == [
        "The finding and model/ differ in size: ambient temperature 11.8 degC in the finding, where the file's "
        "parameters are as declared; ambient temperature 13.3 degC in model/, where they are refitted as well."
    ]
    assert moved_findings(colder(-13.21)) == []  # the same as it is shown
    assert moved_findings(colder(-11.7) | {"written_parameters": {}}) == []  # something else is written


def test_another_size_is_told_in_the_units_of_the_finding():
    parameters = {
        "loss": estimate(0.05, 0.04, 0.06, "dimensionless"),
        "resistance_ohm": estimate(8e-3, 7.9e-3, 8.1e-3, "ohm"),
    }
    discovery = OTHER | {
        "effects": ["lithium_inventory_loss", "series_resistance"],
        "written_parameters": {
            "lithium_inventory_loss": {"loss": 0.09},
            "series_resistance": {"resistance_ohm": 6e-3},
        },
        "candidates": [
            {"effect": effect, "kind": "physics", "parameters": {name: parameters[name]}}
            for effect, name in (
                ("lithium_inventory_loss", "loss"),
                ("series_resistance", "resistance_ohm"),
            )
        ],
    }
    (text,) = moved_findings(discovery)
    assert text.endswith(
        ": lithium inventory loss 5.0 % and series resistance 8.00 mohm in the finding, where the file's parameters "
        "are as declared; lithium inventory loss 9.0 % and series resistance 6.00 mohm in model/, where they are "
        "refitted as well."
    )
