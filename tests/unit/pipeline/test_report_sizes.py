"""A finding is told with its size."""

from dataclasses import replace

import pytest

from aesi.physics.effects import CATALOGUE
from aesi.pipeline.report.words import sizes
from aesi.pipeline.report.words.sizes import finding_line, quantity, with_size


def value(middle, low, high, unit):
    return {"value": middle, "low": low, "high": high, "unit": unit}


def discovery(effect, kind, parameters, verdict="found", recalibrated=5.0):
    errors = {
        state: {"test": {"rmse_mv": mv}} for state, mv in (("recalibrated", recalibrated), ("after", 1.0))
    }
    row = {"effect": effect, "kind": kind, "score": 9.0, "parameters": parameters}
    return {"verdict": verdict, "effects": [effect], "candidates": [row], **errors}


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (value(8.0e-3, 7.93e-3, 8.12e-3, "ohm"), "8.00 mohm [7.93, 8.12]"),
        (value(-14.1, -15.2, -12.9, "K"), "-14.1 K [-15.2, -12.9]"),
        (value(0.6, 0.5, 0.7, "dimensionless"), "0.60 [0.50, 0.70]"),
        (value(1250.0, 900.0, 1600.0, "J/K"), "1250 J/K [900, 1600]"),
        (value(3.2e-9, 1e-9, 1e-8, "m/s"), "3.20e-09 m/s [1.00e-09, 1.00e-08]"),
    ],
)
def test_a_quantity_has_its_interval_and_the_digits_that_it_deserves(given, text):
    assert quantity(given) == text


def test_physics_is_had_and_what_is_off_has_a_size():
    ohms = {"resistance_ohm": value(8e-3, 7.9e-3, 8.1e-3, "ohm")}
    assert with_size("series_resistance", discovery("series_resistance", "physics", ohms)) == (
        "8.00 mohm [7.90, 8.10] more series resistance"
    )
    kelvin = {"shift_k": value(-14.1, -15.2, -12.9, "K")}
    assert with_size("ambient_temperature", discovery("ambient_temperature", "parameter", kelvin)) == (
        "ambient temperature (-14.1 K [-15.2, -12.9])"
    )
    told = discovery("ambient_temperature", "parameter", kelvin) | {"declared_degc": 25.0}
    assert with_size("ambient_temperature", told) == (
        "ambient temperature (10.9 degC [9.8, 12.1] instead of 25 degC)"
    )


@pytest.mark.parametrize(
    ("effect", "kind", "values"),
    [
        ("series_resistance", "physics", {"resistance_ohm": value(8e-3, 7.9e-3, 8.1e-3, "ohm")}),
        ("ambient_temperature", "parameter", {"shift_k": value(-14.1, -15.2, -12.9, "K")}),
    ],
)
def test_a_description_may_be_worded_anew(effect, kind, values, monkeypatch):
    found = discovery(effect, kind, values) | {"declared_degc": 25.0}
    before = with_size(effect, found)
    known = CATALOGUE[effect]
    reworded = {key: replace(p, description="in other words") for key, p in known.parameters.items()}
    monkeypatch.setattr(sizes, "CATALOGUE", {effect: replace(known, parameters=reworded)})
    assert with_size(effect, found) == before


def test_only_what_differs_from_nothing_is_told():
    factors = {
        "negative_factor": value(0.6, 0.58, 0.62, "dimensionless"),
        "positive_factor": value(1.01, 0.9, 1.1, "dimensionless"),
    }
    text = with_size("solid_diffusivity", discovery("solid_diffusivity", "parameter", factors))
    assert text == "solid diffusivity (negative 0.600 [0.580, 0.620] times)"


def test_a_loss_is_told_in_per_cent_of_what_was_declared():
    loss = {"loss": value(0.09998, 0.09964, 0.10031, "dimensionless")}
    assert with_size("lithium_inventory_loss", discovery("lithium_inventory_loss", "parameter", loss)) == (
        "lithium inventory loss (9.998 % [9.964, 10.031] of the declared capacity)"
    )


def test_the_line_of_a_verdict():
    ohms = {"resistance_ohm": value(8e-3, 7.9e-3, 8.1e-3, "ohm")}
    found = discovery("series_resistance", "physics", ohms)
    assert finding_line(found) == "found: 8.00 mohm [7.90, 8.10] more series resistance"
    same = discovery("series_resistance", "physics", ohms, recalibrated=1.0)
    assert finding_line(same).startswith("one of two explanations: 8.00 mohm")
    assert finding_line({**found, "verdict": "none", "effects": []}).startswith(
        "none: these data show nothing"
    )
    nothing = {**found, "verdict": "none", "effects": []}
    beside = finding_line({**nothing, "good": ["one", "two"]})
    assert beside == "none: these data show no error that one and two, known to be good, do not show too"
    partly = finding_line({**found, "verdict": "unknown"})
    assert partly.startswith(
        "unknown: 8.00 mohm [7.90, 8.10] more series resistance explains a part of the error; a systematic error"
    )
    unknown = finding_line({**found, "verdict": "unknown", "effects": []})
    assert unknown.startswith("unknown: a systematic error remains")
    assert "%" not in unknown


def test_a_heat_capacity_was_told_as_a_bare_number():
    values = {
        "heat_transfer_w_k": value(0.05, 0.03, 0.07, "W/K"),
        "heat_capacity_factor": value(1.13, 0.85, 1.51, "dimensionless"),
    }
    assert with_size("self_heating", discovery("self_heating", "physics", values)) == (
        "self heating (heat transfer 0.050 W/K [0.030, 0.070], heat capacity 1.13 [0.85, 1.51] times)"
    )
