"""Records that are the same test, told from tests of the same protocol."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.physics import Cell, simulate
from aesi.pipeline.distinct import check_distinct
from aesi.records import Measurement

TIME = np.arange(0.0, 3000.0, 1.0)
CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


def drive(name, seed=1, noise=1e-3):
    """A drive whose current is that of every seed, and whose voltage has noise of its own."""
    profile = np.repeat(np.random.default_rng(7).normal(2.0, 4.0, len(TIME) // 5), 5)
    rng = np.random.default_rng(seed)
    current = profile + rng.normal(0.0, noise, len(TIME))
    voltage = 4.1 - 0.05 * np.cumsum(current) / 3600.0 - 0.02 * current + rng.normal(0.0, noise, len(TIME))
    return Measurement(TIME, np.round(current, 4), np.round(voltage, 5), name=name)


RECORD = drive("day 1")
EXPORTS = {
    "shifted": replace(RECORD, time_s=TIME + 1234.5),
    "rounded": replace(
        RECORD, current_a=np.round(RECORD.current_a, 2), voltage_v=np.round(RECORD.voltage_v, 3)
    ),
    "thinned": RECORD.take(slice(3, None, 7)),
    "part": RECORD.between(500.0, 900.0),
    "all": replace(RECORD, time_s=np.round(TIME - 77.0, 1), voltage_v=np.round(RECORD.voltage_v, 3)).take(
        slice(1000, 2500, 3)
    ),
}


@pytest.mark.parametrize("name", list(EXPORTS))
def test_an_export_of_a_fitted_record_was_taken_for_another_test(name):
    other = replace(EXPORTS[name], name="export")
    words = "day 1 and export hold the same rows of one test .* and are both among the data and the tests"
    with pytest.raises(DataError, match=words):
        check_distinct([RECORD], [other])
    with pytest.raises(DataError, match=r"export and day 1 hold .* both among the data; give it once"):
        check_distinct([other, RECORD])


def test_what_is_shared_is_told_with_its_times():
    with pytest.raises(
        DataError, match=r"\(400 rows, in export from 600 to 999 s, 100 s later than in day 1\)"
    ):
        check_distinct([RECORD], [replace(EXPORTS["part"], name="export", time_s=np.arange(600.0, 1000.0))])


def test_a_second_test_of_the_same_protocol_is_another():
    check_distinct([RECORD, drive("day 2", 2)], [drive("day 3", 3)])
    check_distinct([drive("quiet", 2, 1e-4)], [drive("quiet 2", 3, 1e-4)])


@pytest.mark.parametrize("noise_v", [0.0, 3e-4])
@pytest.mark.parametrize("step_s", [10.0, 60.0])
def test_two_cycles_of_one_cell_in_coarse_numbers_were_one_test(noise_v, step_s):
    cell = Cell.from_bpx(CELLS / "lfp_prada2013.bpx.json")
    time = np.arange(0.0, 3000.0, step_s)
    cycles = []
    for k, soc0 in enumerate((1.0, 0.9997)):
        voltage = simulate(cell, time, np.full(len(time), 2.3), soc0, hold="backward").voltage_v
        voltage = voltage + noise_v * np.random.default_rng(k).normal(size=len(time))
        cycles.append(Measurement(time, np.full(len(time), 2.3), np.round(voltage, 2), name=f"cycle {k}"))
    check_distinct(cycles)


def test_parts_of_one_test_that_meet_are_apart():
    check_distinct([RECORD.between(0.0, 1500.0)], [RECORD.between(1490.0, 3000.0)])


def test_a_test_that_begins_with_what_is_fitted_is_judged_where_that_ends():
    """As `discover` does; an experiment, which does not, may not have it."""
    fitted = replace(RECORD.between(0.0, 1500.0), name="half")
    check_distinct([fitted], [RECORD], led=True)
    with pytest.raises(DataError, match="half and day 1 hold the same rows of one test"):
        check_distinct([fitted], [RECORD])


def test_a_second_test_in_coarse_numbers_is_another():
    """To 10 mV and 0.1 A two tests of one protocol differ in half of the rows."""
    coarse = [
        replace(one, current_a=np.round(one.current_a, 1), voltage_v=np.round(one.voltage_v, 2))
        for one in (drive("day 1", 1, 4e-3), drive("day 2", 2, 4e-3))
    ]
    check_distinct(coarse)


def test_halves_that_were_rounded_up_are_the_same_test():
    up = np.floor(RECORD.current_a * 1e3 + 0.5) / 1e3
    with pytest.raises(DataError, match="hold the same rows of one test"):
        check_distinct([RECORD], [replace(RECORD, name="export", current_a=up)])
