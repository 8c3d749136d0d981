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


TRIED = {"series_resistance": CATALOGUE["series_resistance"]}


@pytest.fixture(scope="module")
def cell():
    return Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")


def hold_note(found, name="drive"):
    (note,) = (note for note in found.notes if note.startswith(f"{name}: the current is taken"))
    return note


@pytest.mark.parametrize(
    ("made", "declared", "taken", "why"),
    [
        ("backward", None, "backward", "which explains its fitted rows better"),
        ("linear", None, None, "--hold backward"),
        ("backward", "backward", "backward", "as declared"),
        ("backward", "linear", "linear", "as declared"),
    ],
)
def test_a_record_is_explained_with_the_hold_that_it_was_written_with(cell, made, declared, taken, why):
    found = discover(cell, [replace(written(cell, made), hold=declared)], soc0=0.8, effects=TRIED)
    note = hold_note(found)
    assert why in note
    assert found.hold == taken
    if made in (taken, "linear"):
        (contact,) = found.candidates[0].parameters.values()
        assert found.verdict.effects == ("series_resistance",)
        assert contact.low <= 8e-3 <= contact.high
    if declared is None and made == "backward":
        assert note.startswith("drive: the current is taken constant since the row before, which")
        assert note.endswith("--hold linear (in an experiment discover.hold: linear) takes it otherwise.")
        errors = re.search(
            r"the model with series_resistance leaves (\S+) mV RMS of them; the model with series_resistance left "
            r"(\S+) with the current linear between rows",
            note,
        )
        left_mv, taken_mv = map(float, errors.groups())
        assert 1e-3 * left_mv == pytest.approx(NOISE_V, rel=0.05)
        assert left_mv < taken_mv


def test_effects_made_up_for_the_hold(cell):
    several = ("series_resistance", "electrolyte_transport", "porosity")
    tried = {name: CATALOGUE[name] for name in several}
    straight = replace(written(cell, "backward"), hold="linear")
    assert discover(cell, [straight], soc0=0.8, effects=tried).verdict.effects != ("series_resistance",)
    found = discover(cell, [written(cell, "backward")], soc0=0.8, effects=tried)
    assert found.verdict.word == "found"
    assert found.verdict.effects == ("series_resistance",)


def test_a_test_record_of_the_same_logger_is_judged_with_the_inferred_hold(cell):
    test = replace(written(cell, "backward", seed=1), name="later")
    found = discover(cell, [written(cell, "backward")], [test], soc0=0.8, effects=TRIED)
    assert "as that of the fitted records" in hold_note(found, "later")
    (later,) = (one for one in found.files if one.name == "later")
    assert later.errors("after").rmse_v == pytest.approx(NOISE_V, rel=0.05)
    assert {one.hold for one in found.files} == {"backward"}
