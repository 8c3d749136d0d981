"""A record is told from another cell's, and from one in other units, by its voltages and its charge."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import aesi
from aesi.errors import DataError
from aesi.physics.record_checks import (
    capacity_bounds,
    check_belongs,
    check_measured,
    other_materials_sentence,
)
from aesi.records import Measurement

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.fixture(scope="module")
def m50():
    return aesi.Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")


@pytest.fixture(scope="module")
def record(m50):
    """A rest, a 1C discharge of two thirds of the cell with pulses, a rest."""
    time_s = np.arange(0.0, 3600.0, 2.0)
    current_a = np.where((time_s > 120) & (time_s < 3000), 4.0 + 3.0 * np.sign(np.sin(time_s / 40.0)), 0.0)
    current_a[(time_s > 120) & (time_s < 3000) & (np.sin(time_s / 300.0) > 0.9)] = -2.0
    run = aesi.simulate(m50, time_s, current_a, soc0=0.95)
    return Measurement(time_s, current_a, run.voltage_v, name="drive")


def test_the_capacity_lies_within_its_bounds(m50, record):
    bounds = capacity_bounds(m50, record)
    assert bounds.low_ah <= m50.capacity_ah <= bounds.high_ah
    assert bounds.high_ah / bounds.low_ah < 2.5
    check_belongs(m50, [record])


def test_a_drop_that_only_a_cold_cell_has_is_no_other_cells_in_the_cold(m50, record):
    dropping = replace(record, voltage_v=record.voltage_v - 0.09 * record.current_a)
    check_belongs(m50, [replace(dropping, temperature_degc=np.full(len(record), -10.0))])
    for degc in (None, np.full(len(record), 25.0)):
        with pytest.raises(DataError, match="Ah leave the cell"):
            check_belongs(m50, [replace(dropping, temperature_degc=degc)])


def test_the_record_of_a_cell_with_its_leads_was_refused_by_its_own_file(m50, record):
    leads = replace(m50, contact_resistance_ohm=0.07)
    run = aesi.simulate(leads, record.time_s, record.current_a, soc0=0.95)
    through = replace(record, voltage_v=run.voltage_v)
    check_belongs(leads, [through])
    with pytest.raises(DataError, match=r"Ah leave the cell.*Or its voltage holds the drop of leads"):
        check_belongs(m50, [through])
    with pytest.raises(DataError) as caught:
        check_belongs(m50, [replace(record, current_a=1000 * record.current_a)])
    assert "leads" not in str(caught.value)


def test_a_voltage_a_row_behind_its_current_was_that_of_another_cell(m50):
    time_s = np.arange(0.0, 3000.0, 10.0)
    current_a = np.where(time_s % 600.0 < 300.0, 9.0, 0.0)
    voltage_v = aesi.simulate(m50, time_s, current_a, soc0=0.95).voltage_v - 0.015 * current_a
    check_belongs(m50, [Measurement(time_s, current_a, voltage_v, name="pulses")])
    behind = np.append(voltage_v[0], voltage_v[:-1])
    check_belongs(m50, [Measurement(time_s, current_a, behind, name="pulses")])


def test_a_cold_record_without_its_temperature_was_called_another_cells_and_nothing_else(m50, record):
    dropping = replace(record, voltage_v=record.voltage_v - 0.09 * record.current_a)
    with pytest.raises(DataError, match=r"another's\. Or it was far colder than the 25 degC") as caught:
        check_belongs(m50, [dropping])
    assert "\n" not in str(caught.value)
    check_belongs(replace(m50, initial_temperature_k=263.15), [dropping])  # as declared
    milliamperes = replace(record, current_a=1000 * record.current_a)
    for told in (milliamperes, replace(dropping, temperature_degc=np.full(len(record), 25.0))):
        with pytest.raises(DataError) as caught:
            check_belongs(m50, [told])
        assert "colder" not in str(caught.value)


def test_a_little_charge_between_pulses_in_the_cold_was_taken_for_a_rest_voltage(m50):
    """Pulses of 2C, between which a drive puts C/8 back, at a voltage 0.35 V below rest that the pulses left."""
    time_s = np.arange(0.0, 3600.0, 2.0)
    drives = (time_s > 120) & (time_s < 2400)
    current_a = np.where(drives, np.where(np.sin(time_s / 20.0) > 0.0, 2.0, -1 / 8) * m50.capacity_ah, 0.0)
    soc = 1.0 - np.cumsum(2.0 * current_a) / 3600.0 / m50.capacity_ah
    left = np.where(time_s > 120, 0.35, 0.0)
    voltage_v = m50.rest_voltage_v(soc) - 0.02 * current_a - left
    cold = Measurement(time_s, current_a, voltage_v, np.full(len(time_s), -10.0), name="drive")
    bounds = capacity_bounds(m50, cold)
    assert bounds.low_ah <= m50.capacity_ah <= bounds.high_ah
    check_belongs(m50, [cold])


def test_a_voltage_that_is_still_low_after_a_discharge_says_of_no_smaller_cell(m50):
    """Two thirds discharged at 1C, and then at rest 0.12 V below its open-circuit voltage for twenty minutes."""
    time_s = np.arange(0.0, 3720.0, 2.0)
    current_a = np.where((time_s > 120) & (time_s <= 2520), m50.capacity_ah, 0.0)
    soc = 1.0 - np.cumsum(2.0 * current_a) / 3600.0 / m50.capacity_ah
    late = np.where(time_s > 2520, 0.12, 0.0)
    voltage_v = m50.rest_voltage_v(soc) - 0.03 * current_a - late
    bounds = capacity_bounds(m50, Measurement(time_s, current_a, voltage_v, name="drive"))
    assert bounds.low_ah <= m50.capacity_ah <= bounds.high_ah


@pytest.mark.parametrize("share", [0.7, 1.25])
def test_an_aged_cell_and_another_batch_belong(m50, record, share):
    check_belongs(m50, [replace(record, current_a=share * record.current_a)])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"time_s": 1 / 3600}, "--unit time_s=h"),
        ({"time_s": 1 / 60}, "--unit time_s=min"),
        ({"time_s": 1000}, "--unit time_s=ms"),
        ({"current_a": 1000}, "--unit current_a=mA"),
        ({"current_a": 3}, "another cell's"),
        ({"current_a": 1 / 4}, "another cell's"),
        ({"current_a": 1 / 2}, "another cell's"),
        ({"voltage_v": 1.1}, "is full at"),
    ],
)
def test_what_cannot_be_of_this_cell_is_told_with_the_likely_cause(m50, record, change, words):
    ((name, factor),) = change.items()
    with pytest.raises(DataError) as caught:
        check_belongs(m50, [replace(record, **{name: factor * getattr(record, name)})])
    message = str(caught.value)
    assert words in message
    assert message.startswith("drive")
    assert "\n" not in message


def test_a_first_voltage_that_no_such_cell_has_was_taken_for_another_capacity(m50, record):
    voltage = record.voltage_v.copy()
    voltage[0] = 1.2
    with pytest.raises(DataError, match=r"^drive starts at 1.200 V at 0 A, but .* is empty at 2.5 V"):
        check_belongs(m50, [replace(record, voltage_v=voltage)])


def test_a_discharge_of_another_chemistry_was_taken_for_a_current_in_ma():
    """Of an NMC cell from its first row on, so that no row is at rest: 4 V on a cell that is full at 3.6 V."""
    nmc, lfp = (aesi.Cell.from_bpx(CELLS / f"{n}.bpx.json") for n in ("lg_m50_chen2020", "lfp_prada2013"))
    time_s = np.arange(0.0, 1200.0, 2.0)
    current_a = np.full(len(time_s), 4.0)
    voltage_v = aesi.simulate(nmc, time_s, current_a, soc0=1.0).voltage_v
    told = Measurement(time_s, current_a, voltage_v, name="drive")
    for check in (check_belongs, check_measured):
        with pytest.raises(DataError, match=r"^drive, 0 s: 4\.\d+ V at 4 A, but .* is full at 3.600 V"):
            check(lfp, [told])


def test_a_voltage_below_another_cells_was_taken_for_another_unit(m50, record):
    """Rows at 1.9 V, of an LFP cell, that the cell file does not admit: no charge between them says anything."""
    low = replace(record, current_a=60.0 * record.current_a, voltage_v=record.voltage_v - 1.3)
    for check in (check_belongs, check_measured):
        with pytest.raises(DataError, match=r"outside the range of .* \(2.5 to 4.2 V\): .*different cells"):
            check(m50, [low])


def test_two_rows_say_where_the_charge_contradicts_the_voltage(m50, record):
    voltage = record.voltage_v.copy()
    voltage[0] = 2.45
    with pytest.raises(
        DataError, match=r"^drive: \d.\d+ Ah leave the cell between 0 s \(2.450 V\) and \d+ s \(\d"
    ):
        check_belongs(m50, [replace(record, voltage_v=voltage)])


def test_a_record_of_a_cell_thirty_times_smaller_is_not_taken_for_one_in_minutes_alone(m50, record):
    with pytest.raises(DataError, match=r"--unit time_s=min or h.*or the cell file is another's"):
        check_belongs(m50, [replace(record, current_a=record.current_a / 30.0)])


def test_a_quarter_of_a_discharge_between_two_rests_was_taken_with_its_time_in_minutes(m50):
    time_s = np.arange(0.0, 3601.0, 10.0)
    current_a = np.where((time_s >= 600.0) & (time_s < 2400.0), 0.5 * m50.nominal_capacity_ah, 0.0)
    volts = aesi.simulate(m50, time_s, current_a, 0.55).voltage_v
    check_belongs(m50, [Measurement(time_s, current_a, volts, name="part")])
    with pytest.raises(DataError, match="time is in minutes or hours"):
        check_belongs(m50, [Measurement(time_s / 60.0, current_a, volts, name="part")])


def test_a_short_record_in_ma_was_said_to_be_of_many_cells_in_parallel(m50, record):
    with pytest.raises(DataError, match=r"--unit current_a=mA.*or the cell file is another's"):
        check_belongs(m50, [replace(record, current_a=record.current_a * 60.0)])


def test_a_profile_without_a_voltage_says_nothing(m50, record):
    check_belongs(m50, [replace(record, voltage_v=np.full_like(record.voltage_v, np.nan))])


def test_a_discharge_of_the_other_sign_is_asked_about_its_sign(m50):
    time = np.arange(600.0)
    current = np.where(time < 60.0, 0.0, 5.0)
    turned = Measurement(time, -current, aesi.simulate(m50, time, current, soc0=0.8).voltage_v)
    with pytest.raises(DataError, match="the sign of the current is the other one"):
        check_belongs(m50, [turned])


def test_a_row_that_is_no_measurement_was_fitted_by_a_run_and_converted(m50, record):
    voltage = record.voltage_v.copy()
    voltage[[700, 900]] = 0.5
    spiked = replace(record, voltage_v=voltage)
    check_belongs(m50, [spiked])  # a simulation needs its current alone
    with pytest.raises(
        DataError, match=r"^drive: 0.500 V at 1400 s \(row 701, counted from 1; rows like it: 2\) is outside"
    ):
        check_measured(m50, [record, spiked])


def test_a_current_alone_in_milliampere_or_over_milliseconds_was_simulated_as_it_is(m50, record):
    lone = replace(record, voltage_v=np.full_like(record.voltage_v, np.nan))
    check_belongs(m50, [lone])
    with pytest.raises(DataError, match=r"drive, .* A are .*C of .*: the current is in mA"):
        check_belongs(m50, [replace(lone, current_a=1e3 * lone.current_a)])
    with pytest.raises(DataError, match=r"would flow one way .* the time is in ms"):
        check_belongs(m50, [replace(lone, time_s=1e3 * lone.time_s)])
    check_belongs(
        m50, [replace(lone, current_a=10.0 * lone.current_a)]
    )  # more than it holds, in no other unit


def test_a_current_in_milliampere_was_simulated_where_its_first_row_alone_has_a_voltage(m50, record):
    voltage = np.full_like(record.voltage_v, np.nan)
    voltage[0] = record.voltage_v[0]
    started = replace(record, voltage_v=voltage)
    check_belongs(m50, [started])
    with pytest.raises(DataError, match="the current is in mA"):
        check_belongs(m50, [replace(started, current_a=1e3 * started.current_a)])
    with pytest.raises(DataError, match="the time is in ms"):
        check_belongs(m50, [replace(started, time_s=1e3 * started.time_s)])


@pytest.fixture(scope="module")
def of_manganese():
    """Full discharges at C/3 with rests of a cell whose potential has a plateau near 4 V, as of a lithium manganese
    spinel, and that has the capacity of the shipped 30 Ah cell of NMC."""
    cell = aesi.Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
    time_s = np.arange(0.0, 16_000.0, 10.0)
    current_a = np.where((time_s > 600) & (time_s % 2000 > 300), cell.nominal_capacity_ah / 3.0, 0.0)
    taken = np.cumsum(current_a) * 10.0 / 3600.0 / cell.capacity_ah
    rows = taken < 1.0
    soc = [0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0]
    rest_v = [2.75, 3.25, 3.45, 3.57, 3.7, 3.8, 3.92, 4.02, 4.1, 4.19]
    voltage_v = np.interp(1.0 - taken, soc, rest_v) - 1e-3 * current_a
    return cell, Measurement(time_s[rows], current_a[rows], voltage_v[rows], name="spinel", hold="backward")


def test_a_calibration_could_not_start_from_a_file_of_other_materials(of_manganese):
    cell, record = of_manganese
    warm = replace(record, temperature_degc=np.full(len(record), 25.0))
    with pytest.raises(DataError, match="the cell file is another cell's"):
        check_measured(cell, [warm])
    check_measured(cell, [warm], known=[0])
    assert "of other electrode materials" in other_materials_sentence(cell, warm)
    again = replace(warm.between(3000.0, 9000.0), name="again")  # of the same cell, and no full discharge
    with pytest.raises(DataError, match="the cell file is another cell's"):
        check_measured(cell, [again])
    check_measured(cell, [warm, again], known=[0])


def test_what_the_potentials_are_off_allows_no_other_unit(of_manganese):
    cell, record = of_manganese
    warm = replace(record, temperature_degc=np.full(len(record), 25.0))
    in_ma = replace(warm, current_a=1000.0 * warm.current_a, name="in mA")
    with pytest.raises(DataError, match="in mA"):
        check_measured(cell, [warm, in_ma], known=[0])


def test_a_temperature_that_nobody_gave_is_asked_for_before_the_potentials_are_blamed(of_manganese):
    cell, record = of_manganese
    with pytest.raises(DataError, match="Or it was far colder"):
        check_measured(cell, [record], known=[0])


def test_the_potentials_of_its_own_file_are_like_those_of_a_cell(m50, record):
    assert other_materials_sentence(m50, record) == ""
