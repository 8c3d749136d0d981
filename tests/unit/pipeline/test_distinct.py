"""Records that are the same test, told from tests of the same protocol."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.data import decimate, to_even
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
    "other sign": replace(RECORD, current_a=-RECORD.current_a),
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


def interpolated(step_s, at_s=0.3, decimals=4):
    time = np.arange(at_s, TIME[-1], step_s)
    columns = (np.interp(time, TIME, column) for column in (RECORD.current_a, RECORD.voltage_v))
    return Measurement(time, *(np.round(column, decimals) for column in columns), name="export")


def of_rows(step_s, to):
    """The row before (-1), nearest (0) or after (1) every `step_s`."""
    time = np.arange(0.2, TIME[-1] - 1.0, step_s)
    rows = {-1: np.floor(time), 0: np.round(time), 1: np.ceil(time)}[to].astype(int)
    return replace(RECORD.take(rows), time_s=time, name="export")


def in_means(rows, begin=0.0):
    count = len(TIME) // rows
    current, voltage = (
        column[: count * rows].reshape(count, rows).mean(axis=1)
        for column in (RECORD.current_a, RECORD.voltage_v)
    )
    time = begin + TIME[: count * rows : rows]
    return Measurement(time, np.round(current, 3), np.round(voltage, 4), name="export")


@pytest.mark.parametrize(
    "export",
    [
        interpolated(0.7),
        interpolated(0.13),
        interpolated(2.5, decimals=3),
        replace(interpolated(2.5, 0.0), time_s=interpolated(2.5, 0.0).time_s + 500.0),
        replace(interpolated(2.5), current_a=-interpolated(2.5).current_a),
        *(of_rows(2.3, to) for to in (-1, 0, 1)),
        in_means(10),
        in_means(10, begin=9.0),
        interpolated(0.7).between(1000.0, 2000.0),
    ],
)
def test_an_export_on_other_times_was_taken_for_another_test(export):
    told = (
        "hold (one test on other times|the same rows of one test)"  # of rows that were moved to another time
    )
    with pytest.raises(DataError, match=told + " .* and are both among the data and the tests"):
        check_distinct([RECORD], [export])
    with pytest.raises(DataError, match=told):
        check_distinct([export, RECORD])


@pytest.mark.parametrize("hold", ["backward", "linear"])
@pytest.mark.parametrize("step_s", [0.4, 1.2, 2.5, 5.0, 10.0])
def test_a_record_that_was_resampled_here_was_taken_for_another_test(step_s, hold):
    even = replace(to_even(RECORD, step_s, hold), name="even")
    with pytest.raises(DataError, match=r"hold (one test on other times|the same rows of one test)"):
        check_distinct([RECORD, even])
    check_distinct([drive("day 2", 2), even])


@pytest.mark.parametrize("hold", ["backward", "linear"])
def test_a_record_that_was_decimated_was_taken_for_another_test(hold):
    few = replace(decimate(RECORD.held(hold), 400), name="few")
    with pytest.raises(DataError, match="hold one test on other times"):
        check_distinct([RECORD, few])


@pytest.mark.parametrize("rounded", [(4, 5), (2, 3), (1, 2)])
def test_a_second_test_of_the_same_protocol_on_other_times_is_another(rounded):
    second = drive("day 2", 2, 4e-3)
    time = np.arange(0.3, TIME[-1], 2.5)
    columns = [np.interp(time, TIME, column) for column in (second.current_a, second.voltage_v)]
    other = Measurement(time, *(np.round(c, d) for c, d in zip(columns, rounded, strict=True)), name="other")
    check_distinct([RECORD], [other])


def test_two_cycles_of_a_virtual_cell_on_other_times_are_two_tests():
    """Without noise, and by a millivolt or two apart."""
    cell = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
    current = np.repeat(np.random.default_rng(7).normal(10.0, 30.0, 300), 5)
    cycles = []
    for k, step_s in enumerate((1.0, 2.5)):
        time = np.arange(0.0, 1500.0, step_s)
        run = simulate(cell, time, np.interp(time, np.arange(1500.0), current), 0.8 - 0.005 * k)
        cycles.append(Measurement(time, np.round(run.current_a, 2), np.round(run.voltage_v, 3), name=f"{k}"))
    check_distinct(cycles)


@pytest.mark.parametrize("noise_v", [1e-4, 3e-4, 5e-4])
def test_two_runs_of_one_drive_whose_voltages_are_written_to_a_millivolt_were_taken_for_one(noise_v):
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    current = np.repeat(np.random.default_rng(1).normal(0.4, 0.8, 200), 10) * cell.capacity_ah
    time = np.arange(float(len(current)))
    voltage = simulate(cell, time, current, soc0=0.8).voltage_v
    rng = np.random.default_rng(2)
    first, second = (
        Measurement(
            time, np.round(current, 3), np.round(voltage + noise_v * rng.normal(size=len(time)), 3), name=name
        )
        for name in ("first", "second")
    )
    check_distinct([first], [second])


@pytest.mark.parametrize("c_rate", [0.05, 1.0])
def test_discharges_of_two_cells_of_one_make_were_taken_for_one(c_rate):
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    time = np.linspace(0.0, 3000.0 / c_rate, 3000)
    current = np.full(len(time), c_rate * cell.nominal_capacity_ah)
    rng = np.random.default_rng(3)
    first, second = (
        Measurement(
            time,
            current,
            np.round(simulate(one, time, current, soc0=1.0).voltage_v + 3e-4 * rng.normal(size=len(time)), 3),
            name=name,
        )
        for one, name in ((cell, "first"), (replace(cell, contact_resistance_ohm=1e-4), "second"))
    )
    check_distinct([first], [second])
