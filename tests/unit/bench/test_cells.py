"""The leaderboard of measured cells: a run that runs out is flagged, windows start from a given state, the table."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from aesi.bench.physics.cells import free_run, held_from, windows_mv
from aesi.bench.physics.cells_table import table
from aesi.physics import Cell, simulate
from aesi.records import Measurement

CELL = Cell.from_bpx(
    Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
)


def drawn(hours: float) -> Measurement:
    """A discharge at C/2 from full, as the cell itself answers."""
    time = np.arange(0.0, 3600.0 * hours, 5.0)
    current = np.where(time < 60.0, 0.0, 2.5)
    run = simulate(CELL, time, current, 1.0, hold="backward", on_depletion="clip")
    return Measurement(time, current, run.voltage_v, name="drawn")


def test_a_run_within_the_cell_is_not_flagged():
    run = free_run(CELL, drawn(1.0))
    assert run.rmse_mv < 0.5
    assert run.ran_out_s is None


def test_a_run_that_asks_for_more_charge_than_there_is_says_from_when_on():
    run = free_run(CELL, drawn(2.6))
    assert run.ran_out_s is not None
    assert 7000.0 < run.ran_out_s < 2.6 * 3600.0


def test_windows_start_from_rest_at_the_charge_that_has_passed():
    data = drawn(1.0)
    whole = windows_mv(CELL, data, rows=len(data))
    in_parts = windows_mv(CELL, data, rows=40)
    assert whole < 0.5
    assert 1.0 < in_parts < 60.0  # each has to build up its own gradients again


def test_a_record_that_a_tester_holds_at_the_cut_off_says_from_which_row_on():
    data = drawn(1.0)  # of 720 rows
    at_cut_off = CELL.lower_voltage_v + 0.003
    assert held_from(CELL, data) is None
    voltage = data.voltage_v.copy()
    voltage[-60::2] = at_cut_off
    assert held_from(CELL, replace(data, voltage_v=voltage)) == len(data) - 60
    voltage[13] = at_cut_off  # touched in bursts from early on
    assert held_from(CELL, replace(data, voltage_v=voltage)) is None
    voltage[:-1] = data.voltage_v[:-1]
    voltage[-1] = at_cut_off  # where a discharge ends
    assert held_from(CELL, replace(data, voltage_v=voltage)) is None


def test_the_table_says_what_was_left_before_a_record_was_held():
    row = {"cell": "c", "record": "r", "fitted": False, "declared_mv": 186.5, "held_from_s": 6841.1}
    line = table([row | {"until_held_mv": {"declared": 19.34}}])[2]
    assert "186.5 (19.3 until 6841 s)" in line


def test_the_table_flags_what_ran_out_what_was_fitted_and_what_trained():
    row = {
        "cell": "c",
        "record": "r",
        "fitted": True,
        "mean_degc": -10.04,
        "others_mv": 43.5,
        "others": "them",
    }
    row |= {"declared_mv": 12.34, "ran_out": {"declared": 5400.4}, "trained": True}
    head, _, line, _, protocol = table([row])
    assert head.count("|") == line.count("|")
    assert "r (fitted)" in line
    assert "12.3 (ran out at 5400 s)" in line
    assert "trained" in line
    assert "43.5 [1]" in line
    assert protocol.startswith("[1] them")
