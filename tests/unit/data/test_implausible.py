"""Signs and units that were lost on the way are told from the columns together."""

import numpy as np
import pytest

from aesi.data import read_measurement
from aesi.errors import DataError

TIME = np.arange(0.0, 7200.0, 4.0)
rng = np.random.default_rng(3)
DRIVE = np.repeat(rng.normal(1.5, 3.0, len(TIME) // 5), 5)
CYCLE = np.where(TIME < 3600.0, 3.0, -3.0)


def voltage(current):
    """Of a 5 Ah cell with 20 mohm, whose potential falls by 0.9 V from full to empty."""
    charge = np.cumsum(current) * 4.0 / 3600.0
    return 4.1 - 0.18 * charge - 0.02 * current


def written(folder, time, current, volts):
    path = folder / "drive.csv"
    rows = zip(*(column.tolist() for column in (time, current, volts)), strict=True)
    body = "\n".join(",".join(map(repr, row)) for row in rows)
    path.write_text(f"time_s,current_a,voltage_v\n{body}\n")
    return path


def refusal(folder, time, current, volts):
    with pytest.raises(DataError) as caught:
        read_measurement(written(folder, time, current, volts))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("current", [DRIVE, CYCLE], ids=["drive", "cycle"])
def test_a_current_without_its_sign_is_told_and_with_it_is_taken(tmp_path, current):
    read_measurement(written(tmp_path, TIME, current, voltage(current)))
    message = refusal(tmp_path, TIME, np.abs(current), voltage(current))
    assert "holds magnitudes" in message
    assert "--state" in message


def test_a_discharge_alone_is_no_magnitude(tmp_path):
    pulses = np.where((TIME % 400) < 40, 4.0, 0.0)
    read_measurement(written(tmp_path, TIME, pulses, voltage(pulses)))
    read_measurement(written(tmp_path, TIME, np.abs(DRIVE), voltage(np.abs(DRIVE))))


def test_warming_in_the_cold_is_no_charge(tmp_path):
    """The voltage of a cold cell first rises under a held current: 0.37 V at most in the records that set the limit."""
    current = np.full_like(TIME, 3.0)
    warming = voltage(current) - 0.45 * np.exp(-TIME / 600.0)
    read_measurement(written(tmp_path, TIME, current, warming))


@pytest.mark.parametrize(
    ("current", "factor", "words"),
    [
        (CYCLE, 1 / 3600, "--unit time_s=h"),
        (DRIVE, 1 / 3600, "--unit time_s=h"),
        (DRIVE, 1e3, "--unit time_s=ms"),
    ],
)
def test_a_time_in_another_unit_is_told(tmp_path, current, factor, words):
    assert words in refusal(tmp_path, factor * TIME, current, voltage(current))


def test_a_current_in_milliamperes_is_not_taken_for_a_time(tmp_path):
    message = refusal(tmp_path, TIME, 1e3 * DRIVE, voltage(DRIVE))
    assert "--unit current_a=mA" in message
    assert "time_s=ms" not in message


def test_a_voltage_that_stood_still_from_the_middle_on_was_taken(tmp_path):
    stuck = voltage(DRIVE)
    stuck[900:] = stuck[900]
    message = refusal(tmp_path, TIME, DRIVE, stuck)
    assert "row 901 (line 902), column voltage_v: the voltage stands still at" in message
    assert "--to-s 3600 " in message


def test_a_slow_fall_of_the_current_in_the_cold_was_held_for_a_charge(tmp_path):
    """The drop of a cold cell comes back by more than 0.5 V, while no two rows differ by much."""
    time = np.arange(0.0, 300.0, 0.1)
    current = 3.0 + 2.8 * np.cos(2.0 * np.pi * time / 60.0)
    cold = 4.1 - 0.15 * current - 1e-4 * np.cumsum(current)
    read_measurement(written(tmp_path, time, current, cold))


def test_what_comes_back_after_a_larger_current_was_held_for_a_charge(tmp_path):
    time = np.arange(0.0, 600.0, 0.5)
    current = np.where(time % 300.0 < 150.0, 10.0, 1.0)
    cold = 4.1 - 0.02 * current - 5e-5 * np.cumsum(current)
    since_s = time % 150.0
    cold -= np.where(current > 5.0, 0.7 * (1.0 - np.exp(-since_s / 4.0)), 0.7 * np.exp(-since_s / 4.0))
    read_measurement(written(tmp_path, time, current, cold))


def test_a_voltage_that_is_held_is_no_sensor_that_stands_still(tmp_path):
    """The end of a charge: the cycler holds 4.2 V, and the current falls."""
    pulses = np.where(TIME < 3600.0, np.where((TIME % 400) < 40, 4.0, 0.0), 0.0)
    current = np.where(TIME < 3600.0, pulses, -3.0 * np.exp(-(TIME - 3600.0) / 900.0))
    volts = np.where(TIME < 3600.0, voltage(pulses), 4.2)
    read_measurement(written(tmp_path, TIME, current, np.round(volts, 3)))


def held_charge():
    """A drive, then a charge up to 4.1 V, which the cycler holds while the chamber warms and cools the cell."""
    since_s, drive = TIME - 3600.0, 0.2 * DRIVE
    falls = -1.5 * np.exp(-since_s / 900.0) * (1.0 + 0.04 * np.sin(since_s / 8.0))
    current = np.where(since_s < 0.0, drive, np.where(since_s < 40.0, -1.5, falls))
    volts = np.where(since_s < 0.0, voltage(drive), np.where(since_s < 40.0, 4.08 + 0.0005 * since_s, 4.1))
    return current, np.round(volts, 5)


def test_a_voltage_held_in_a_chamber_that_sways_was_a_sensor_that_stands_still(tmp_path):
    read_measurement(written(tmp_path, TIME, *held_charge()))


@pytest.mark.parametrize("shift_v", [-0.05, 0.0], ids=["below its highest", "at its highest"])
def test_a_voltage_that_stands_still_on_charge_is_no_hold(tmp_path, shift_v):
    """Below where the charge came before, or under a current that goes up and down by more than a hold's."""
    current, volts = held_charge()
    volts[TIME > 3640.0] += shift_v
    if not shift_v:
        later = TIME > 3640.0
        current[later] = -1.0 - 0.4 * np.sign(np.sin(TIME[later] / 8.0))
    assert "the voltage stands still at" in refusal(tmp_path, TIME, current, volts)


def test_a_current_that_toggles_by_its_resolution_moves_no_voltage(tmp_path):
    """Of a cold cell, whose resistance makes more than the voltage's resolution of one step of the current's."""
    current = 0.0026 * np.round(0.4 * DRIVE / 0.0026)
    volts = np.round(4.3 - 0.3 * current - 1e-5 * np.cumsum(current), 4)
    current[900:960] = 0.0026 * np.tile([38, 39], 30)
    volts[900:960] = volts[899]
    read_measurement(written(tmp_path, TIME, current, volts))


def test_a_short_record_in_milliseconds_was_taken(tmp_path):
    """It moves too little charge to be beyond any cell's, and yet too much for its resistance and its voltage."""
    short = slice(0, 150)
    read_measurement(written(tmp_path, TIME[short], DRIVE[short], voltage(DRIVE)[short]))
    message = refusal(tmp_path, 1e3 * TIME[short], DRIVE[short], voltage(DRIVE)[short])
    assert "Ah would have moved while the voltage slides by" in message
    assert "declare it: --unit time_s=ms (" in message


def test_a_flat_potential_is_no_time_in_milliseconds(tmp_path):
    flat = 3.3 - 0.004 * np.cumsum(DRIVE) * 4.0 / 3600.0 - 0.02 * DRIVE
    read_measurement(written(tmp_path, TIME, DRIVE, flat))


@pytest.mark.parametrize("cycles", [1, 4])
def test_a_smooth_current_with_the_wrong_sign_was_read(tmp_path, cycles):
    """From row to row it moves a flat voltage by far less than its last digit."""
    time = np.arange(0.0, 4 * 3600.0, 2.0)
    current = 2.0 * np.sin(2.0 * np.pi * cycles * time / time[-1])
    charge = np.cumsum(current) * 2.0 / 3600.0
    noise = 1e-3 * np.random.default_rng(5).standard_normal(len(time))
    flat = np.round(3.3 - 0.012 * current - 0.005 * charge + noise, 3)
    read_measurement(written(tmp_path, time, current, flat))
    assert "the voltage rises with the current" in refusal(tmp_path, time, -current, flat)


def test_a_charge_whose_current_only_falls_has_no_wrong_sign(tmp_path):
    current = -3.0 * np.exp(-TIME / 3000.0)
    resting = 3.4 + 0.02 * np.sin(TIME / 500.0)
    read_measurement(written(tmp_path, TIME, current, np.round(resting - 0.02 * current, 3)))


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["as it is", "turned"])
def test_a_charge_alone_whose_voltage_is_held_was_of_the_wrong_sign(tmp_path, sign):
    """A row a minute at 3 A, and on at 4.2 V behind leads of 60 mohm: the cell's own voltage rises meanwhile."""
    time, current, charge = np.arange(0.0, 9000.0, 60.0), [], 0.0
    for _ in time:
        current.append(max(-3.0, (3.5 - 0.18 * charge - 4.2) / (0.02 + 0.06)))
        charge += current[-1] / 60.0
    falling = np.array(current)
    volts = 3.5 - 0.18 * np.cumsum([0.0, *current[:-1]]) / 60.0 - 0.02 * falling
    if sign > 0:
        assert len(read_measurement(written(tmp_path, time, falling, volts))) == len(time)
    else:
        assert "contradicts the one declared" in refusal(tmp_path, time, -falling, volts)


def test_five_minutes_of_a_drive_at_ten_rows_a_second_were_in_another_unit(tmp_path):
    """Half a second passes until a current's drop is in the voltage: from row to row a fifth of it shows."""
    time = np.arange(0.0, 300.0, 0.1)
    current = np.repeat(np.random.default_rng(0).normal(1.0, 3.0, 100), 31)[: len(time)]
    drop = [0.0]
    for now in current[1:]:
        drop.append(drop[-1] + 0.2 * (0.04 * now - drop[-1]))
    volts = 3.8 - 0.18 * np.cumsum(current) * 0.1 / 3600.0 - np.array(drop)
    assert len(read_measurement(written(tmp_path, time, current, volts))) == len(time)
    assert "--unit time_s=h" in refusal(tmp_path, TIME / 3600, CYCLE, voltage(CYCLE))


def resting(kind, rows=60):
    """A rest of a row in 10 s, whose current is what its sensor errs by."""
    time, rng = 10.0 * np.arange(rows), np.random.default_rng(2)
    noise = 5e-5 * rng.standard_normal(rows)
    if kind == "relaxing at 1 uA":
        return time, np.full(rows, 1e-6), 3.6 - 0.08 * np.exp(-time / 200.0) + noise
    if kind == "relaxing at 5 mA":
        return time, np.full(rows, 5e-3), 3.6 - 0.08 * np.exp(-time / 600.0) + noise
    if kind == "relaxing at 20 mA and noise":
        return time, 0.02 + 5e-4 * rng.standard_normal(rows), 3.6 - 0.08 * np.exp(-time / 600.0) + noise
    if kind == "2 mA and noise":
        return time, 2e-3 + 5e-4 * rng.standard_normal(rows), 3.6 + noise
    current = np.zeros(rows)
    current[0], current[3::9] = 8e-6, 1e-6
    noise[[0, 3]] = 1.6e-4, 1e-4
    return time, current, 3.6 + noise


@pytest.mark.parametrize(
    ("kind", "rows"),
    [
        ("single steps of 1 uA", 19),
        ("single steps of 1 uA", 400),
        ("2 mA and noise", 60),
        ("relaxing at 1 uA", 60),
        ("relaxing at 5 mA", 60),
        ("relaxing at 5 mA", 360),
        ("relaxing at 20 mA and noise", 360),
    ],
)
def test_a_rest_whose_current_is_noise_was_of_the_wrong_sign_or_magnitudes(tmp_path, kind, rows):
    assert len(read_measurement(written(tmp_path, *resting(kind, rows)))) == rows


@pytest.mark.parametrize("rows", [2, 5, 12, -5], ids=lambda rows: f"{rows} rows late")
@pytest.mark.parametrize("one_way", [False, True], ids=["drive", "discharges alone"])
def test_a_lag_of_the_voltage_was_a_wrong_sign_or_a_dead_current(tmp_path, one_way, rows):
    current = np.repeat(np.random.default_rng(8).normal(1.5, 3.0, 600), 3)
    current = np.abs(current) if one_way else current
    late = np.interp(TIME - 4.0 * rows, TIME, voltage(current))
    (note,) = read_measurement(written(tmp_path, TIME, current, late)).notes
    when = f"{4 * abs(rows)} s too {'late' if rows > 0 else 'early'}"
    assert f"Its voltage answers to the steps of its current {when}" in note
    assert "contradicts the one declared" in refusal(tmp_path, TIME, -current, late)


def test_a_lag_is_not_told_from_a_few_steps_or_of_a_row(tmp_path):
    """A logger that writes the voltage a row after its current, and a discharge between two rests."""
    row_late = np.interp(TIME - 4.0, TIME, voltage(DRIVE))
    assert read_measurement(written(tmp_path, TIME, DRIVE, row_late)).notes == ()
    load = np.where((TIME > 1000.0) & (TIME < 1800.0), 3.0, 0.0)
    later = np.interp(TIME - 40.0, TIME, voltage(load))
    assert read_measurement(written(tmp_path, TIME, load, later)).notes == ()


def test_a_current_with_noise_beside_a_quiet_voltage_was_a_voltage_that_stands_still(tmp_path):
    """A rest behind a drive, whose voltage is written to 0.1 mV, while its current has a noise of 0.5 %."""
    drive = np.where(TIME < 3600.0, DRIVE, 0.0)
    noise = 0.005 * np.abs(DRIVE).max() * np.random.default_rng(4).standard_normal(len(TIME))
    volts = np.round(voltage(drive), 4)
    read_measurement(written(tmp_path, TIME, drive + noise, volts))
    stuck = np.where(TIME < 3600.0, volts, volts[899])
    assert "the voltage stands still" in refusal(tmp_path, TIME, DRIVE + noise, stuck)


def test_an_interpolated_record_was_a_voltage_that_stands_still(tmp_path):
    """A voltage in steps of 1 mV beside a current that now and then toggles by 1 mA, which moves it by 0.02 mV."""
    toggles = 0.2 + 0.001 * (np.random.default_rng(4).random(len(TIME)) < 0.2)
    current = np.where(TIME < 3600.0, np.round(DRIVE, 3), toggles)
    volts = np.round(voltage(current), 3)
    dense = np.linspace(0.0, TIME[-1], 2 * len(TIME) + 77)
    read_measurement(written(tmp_path, TIME, current, volts))
    read_measurement(written(tmp_path, dense, np.interp(dense, TIME, current), np.interp(dense, TIME, volts)))


def test_a_voltage_that_stands_still_twice_hides_neither(tmp_path):
    """Two such stretches alone say nothing of the resolution of a voltage with noise."""
    volts = voltage(DRIVE) + 1e-4 * np.random.default_rng(5).standard_normal(len(TIME))
    for begin in (300, 1200):
        volts[begin : begin + 100] = volts[begin]
    assert "row 301 (line 302), column voltage_v: the voltage stands still" in refusal(
        tmp_path, TIME, DRIVE, volts
    )
