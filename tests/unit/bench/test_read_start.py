"""Records whose state of charge is read from them, and what they hold."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from aesi.bench.read_start import COMPETING, NOISE_V, OTHERS, SHIFTING, record_at_rest, rows
from aesi.physics import Cell, simulate

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


def test_a_record_begins_at_rest_and_holds_the_effect_alone():
    cell = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
    made = record_at_rest(cell, 0.55, "voltage_sensor_offset", {"offset_v": 16e-3})
    plain = simulate(cell, made.time_s, made.current_a, 0.55, hold="backward").voltage_v
    assert made.current_a[0] == 0.0
    assert np.mean(made.voltage_v - plain) == pytest.approx(16e-3, abs=5 * NOISE_V / 60)
    assert np.std(made.voltage_v - plain) == pytest.approx(NOISE_V, rel=0.05)


def test_what_is_in_a_record_may_be_named():
    assert {effect for effect, _ in (*SHIFTING, *OTHERS)} <= set(COMPETING)


def test_a_row_says_what_is_in_the_record_and_whether_it_was_named():
    (one,) = islice(rows(CELLS), 1)
    assert (one["cell"], one["soc0"], one["offset_v"], one["shifting"]) == (
        "lg_m50_chen2020",
        0.55,
        8e-3,
        True,
    )
    assert one["right"] == (one["effects"] == ["voltage_sensor_offset"])
