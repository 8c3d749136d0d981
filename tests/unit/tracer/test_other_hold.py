"""A record whose current runs otherwise between its rows than it was taken."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer import discover

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
NOISE_V = 1e-3


def written(cell, hold, seed=0):
    """A drive in rows of 1 s whose current changes every half minute and runs like this between two."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 1500.0)
    current_a = np.repeat(rng.normal(3.0, 4.0, 50), 30)
    current_a[:60] = 0.0
    contact = CATALOGUE["series_resistance"].activate(resistance_ohm=8e-3)
    voltage_v = simulate(cell, time_s, current_a, 0.8, [contact], hold=hold).voltage_v
    return Measurement(time_s, current_a, voltage_v + NOISE_V * rng.standard_normal(1500), name="drive")


@pytest.mark.parametrize(
    ("made", "declared", "warned"),
    [
        ("backward", None, True),
        ("linear", None, False),
        ("backward", "backward", False),
        ("backward", "linear", False),
    ],
)
def test_a_record_that_the_other_hold_explains_better_is_warned_of(made, declared, warned):
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    record = replace(written(cell, made), hold=declared)
    found = discover(cell, [record], soc0=0.8, effects={"series_resistance": CATALOGUE["series_resistance"]})
    said = [warning for warning in found.warnings if "the file seems to be written so" in warning]
    assert len(said) == warned
    for warning in said:
        assert warning.startswith("with the current constant since the row before")
        assert "Declare it with --hold backward" in warning
        left_mv, taken_mv = map(
            float,
            re.search(r"\((\S+) mV RMS are left by series_resistance, instead of (\S+)\)", warning).groups(),
        )
        assert 1e-3 * left_mv == pytest.approx(NOISE_V, rel=0.05)
        assert left_mv < taken_mv


def test_effects_that_make_up_for_the_hold_are_warned_of():
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    several = ("series_resistance", "electrolyte_transport", "porosity")
    found = discover(
        cell, [written(cell, "backward")], soc0=0.8, effects={name: CATALOGUE[name] for name in several}
    )
    assert found.verdict.effects != ("series_resistance",)  # what is wrong, beside the hold
    assert any("the file seems to be written so" in warning for warning in found.warnings)
