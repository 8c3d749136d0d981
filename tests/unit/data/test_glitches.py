"""Rows that contradict their neighbours, a current that stands still, and what readers say of doubtful columns."""

import numpy as np
import pytest

from aesi.data import read_measurement
from aesi.errors import DataError

TIME = np.arange(0.0, 3600.0, 1.0)
CURRENT = np.repeat(np.random.default_rng(5).normal(1.5, 4.0, len(TIME) // 6), 6)
VOLTAGE = 4.1 - 0.18 * np.cumsum(CURRENT) / 3600.0 - 0.02 * CURRENT


def written(
    folder, current=CURRENT, voltage=VOLTAGE, time=TIME, header="time_s,current_a,voltage_v", more=()
):
    path = folder / "drive.csv"
    columns = [map(repr, column.tolist()) for column in (time, current, voltage, *more)]
    path.write_text("\n".join([header, *(",".join(row) for row in zip(*columns, strict=True))]) + "\n")
    return path


def notes(folder, *columns, **options):
    return " ".join(read_measurement(written(folder, *columns, **options)).notes)


def refusal(folder, *columns, reading=None, **options):
    with pytest.raises(DataError) as caught:
        read_measurement(written(folder, *columns, **options), **(reading or {}))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("leap_v", [0.5, -0.3])
def test_a_voltage_that_leapt_for_single_rows_was_taken_in_silence(tmp_path, leap_v):
    leaping = VOLTAGE.copy()
    leaping[[700, 2000, 2900]] += leap_v
    said = notes(tmp_path, CURRENT, leaping)
    assert f"Its voltage is {leaping[700]:.4g} V at row 701 (line 702) alone" in said
    assert "(rows like it: 3)" in said


def test_the_end_of_a_discharge_in_rows_of_a_minute_was_a_glitch(tmp_path):
    """After pulses that tell a resistance of 35 mohm a knee falls ever faster, and the load ends."""
    time = 60.0 * np.arange(60.0)
    current = np.where(np.arange(60) % 10 < 5, 0.0, 2.3)
    current[40:55], current[55:] = 2.3, 0.0
    voltage = 3.3 - 1e-3 * np.arange(60) - 0.035 * current
    voltage[49:55] = [3.1, 2.95, 2.75, 2.593, 2.385, 2.038]
    voltage[55:] = [2.719, 2.894, 2.946, 2.96, 2.97]
    assert "glitch" not in notes(tmp_path, current, voltage, time=time)
    voltage[20] -= 0.5
    assert "at row 21 (line 22) alone" in notes(tmp_path, current, voltage, time=time)


def test_a_current_that_leaps_was_held_for_magnitudes(tmp_path):
    """Its steps move the voltage neither way; what signs and units are told by are the other rows."""
    current = np.abs(CURRENT)
    voltage = 4.1 - 0.18 * np.cumsum(current) / 3600.0 - 0.02 * current
    leaping = current.copy()
    leaping[40::120] = 999.0
    said = notes(tmp_path, leaping, voltage)
    assert "Its current is 999 A at row 41 (line 42) alone" in said
    assert "and the voltage does not answer (rows like it: 30)" in said


def test_a_voltage_that_goes_on_elsewhere_is_two_tests(tmp_path):
    joined = VOLTAGE.copy()
    joined[1803:] -= 0.45
    said = notes(tmp_path, CURRENT, joined)
    assert "row 1804 (line 1805), 1 s after the row before it" in said
    assert "--to-s 1802 or --from-s 1803" in said


def test_pulses_of_a_row_and_a_coarse_voltage_are_no_glitches(tmp_path):
    pulses = np.where(np.arange(len(TIME)) % 50 == 7, 12.0, 0.1)
    logged_late = 4.1 - 0.03 * (pulses + np.roll(pulses, 1)) - 0.1 * np.cumsum(pulses) / 3600.0
    for current, voltage in ((pulses, logged_late), (CURRENT, np.round(VOLTAGE, 1))):
        assert "Its " not in notes(tmp_path, current, voltage)


@pytest.mark.parametrize("dead_a", [0.0, 0.002])
def test_a_dead_current_under_a_voltage_of_a_drive_was_taken(tmp_path, dead_a):
    message = refusal(tmp_path, np.full_like(CURRENT, dead_a), 0.9 * VOLTAGE)
    assert (
        f"column current_a: the current is {dead_a:g} A in all 3,600 rows while the voltage turns" in message
    )
    tail = CURRENT.copy()
    tail[2400:] = dead_a
    message = refusal(tmp_path, tail, VOLTAGE)
    assert "row 2401 (line 2402)" in message
    assert "read one side of it: --to-s 2400 (" in message


def test_a_noisy_voltage_and_one_that_relaxes_need_no_current(tmp_path):
    noisy = VOLTAGE.copy()
    noise = np.random.default_rng(2).normal(0.0, 0.02, len(TIME))
    rests = np.where(TIME < 1000.0, CURRENT, 0.0)
    noisy = (
        4.1
        - 0.18 * np.cumsum(rests) / 3600.0
        - 0.02 * rests
        - 0.2 * np.exp(-np.maximum(TIME - 1000.0, 0.0) / 300.0)
    )
    read_measurement(written(tmp_path, rests, noisy + noise))


def test_the_rests_of_a_test_alone_are_no_dead_current(tmp_path):
    """Between them the cell is discharged; in each of them the voltage comes back."""
    pulse = np.where(TIME % 180.0 < 40.0, 9.0, 0.0)
    voltage = (
        4.0 - 0.2 * np.cumsum(pulse) / 3600.0 - 0.01 * pulse - 0.1 * np.exp(-(TIME % 180.0 - 40.0) / 30.0)
    )
    rests = (TIME % 180.0 >= 45.0) & (TIME % 5.0 == 0.0)
    read_measurement(written(tmp_path, pulse[rests], voltage[rests], TIME[rests]))


@pytest.mark.parametrize("volts", [VOLTAGE / 1000.0, VOLTAGE / 1e6])
def test_a_cell_of_millivolts_was_taken(tmp_path, volts):
    assert "V in the median, which is that of no cell" in refusal(tmp_path, CURRENT, volts)


def test_thousands_that_were_read_as_decimals_are_those_of_no_cell(tmp_path):
    path = tmp_path / "de.csv"
    rows = [f"{k};{2 + k % 3};{4194 - k:,}" for k in range(30)]
    path.write_text("time_s;current_a;voltage_v\n" + "\n".join(rows) + "\n")
    with pytest.raises(DataError, match=r"taken in mV as declared .* whether a sign between thousands"):
        read_measurement(path, units={"voltage_v": "mV"})


@pytest.mark.parametrize(
    ("declared", "words"),
    [("h", "time_s was taken in h, as declared"), ("ms", "time_s was taken in ms, as declared")],
)
def test_a_unit_that_was_declared_wrongly_was_advised_another(tmp_path, declared, words):
    message = refusal(tmp_path, reading={"units": {"time_s": declared}})
    assert words in message
    assert "--unit" not in message


def test_the_days_of_a_spreadsheet_are_named(tmp_path):
    assert "declare it: --unit time_s=d (" in refusal(tmp_path, CURRENT, VOLTAGE, 45000.0 + TIME / 86400.0)


def test_a_time_in_whole_minutes_was_advised_to_drop_nearly_all_rows(tmp_path):
    message = refusal(tmp_path, CURRENT, VOLTAGE, np.floor(TIME / 60.0) * 60.0)
    assert "98% of the rows have the stamp of the row before" in message
    assert "with stamps 60 s apart; export it with its decimals" in message


def test_a_few_stamps_that_are_there_twice_may_still_be_dropped(tmp_path):
    time = TIME.copy()
    time[5::100] = time[4::100]
    assert "or choose: --duplicates first, or last" in refusal(tmp_path, CURRENT, VOLTAGE, time)


def test_a_time_that_starts_again_is_a_second_test(tmp_path):
    message = refusal(tmp_path, CURRENT, VOLTAGE, np.tile(TIME[:1800], 2))
    assert "and starts again there, as that of a second test does" in message


def test_the_temperature_that_was_taken_is_told_from_those_that_were_not(tmp_path):
    degc = [np.full_like(TIME, each) for each in (25.0, 10.0, 10.0)]
    header = "time_s,current_a,voltage_v,{},T_amb [°C],T_chamber"
    said = notes(tmp_path, header=header.format("temperature_degc"), more=degc)
    assert "taken from column 'temperature_degc', and not from 'T_amb [°C]', 'T_chamber'." in said
    said = notes(tmp_path, header=header.format("T_cell [°C]"), more=degc)
    assert "Column 'T_cell [°C]' looks like a temperature and is not used" in said
    names = "Tambient [°C],T_cell,T_chamber"
    said = notes(tmp_path, header=f"time_s,current_a,voltage_v,{names}", more=degc)
    assert "Column 'T_cell' looks like a temperature and is not used" in said
    assert "there is also 'Tambient [°C]', 'T_chamber'" in said
    said = notes(
        tmp_path,
        header="time_s,current_a,voltage_v,temperature_degc,temperature_k",
        more=[degc[0], degc[0] + 273.15],
    )
    assert "and not from" not in said


def test_a_line_of_units_in_fahrenheit_was_a_row(tmp_path):
    path = tmp_path / "units.csv"
    rows = [f"{k},{100 * (1 + k % 2)},{4.0 - 0.002 * (k % 2) - k / 1e4},77" for k in range(20)]
    path.write_text("\n".join(["time_s,current_a,voltage_v,temperature_degc", "s,mA,V,degF", *rows]) + "\n")
    found = read_measurement(path)
    assert found.temperature_degc[0] == pytest.approx(25.0)
    assert found.current_a[1] == pytest.approx(0.2)
    for words in (
        "current_a was converted from mA, as the line of units says",
        "temperature_degc was converted from degF",
    ):
        assert any(words in note for note in found.notes)


def quoted(cell):
    rows = [f'"{k}","{cell}","3,{650 - k}"' for k in range(20)]
    return "time_s,current_a,voltage_v\n" + "\n".join(rows) + "\n"


def test_decimal_commas_in_quotes_were_taken_for_thousands(tmp_path):
    path = tmp_path / "quoted.csv"
    path.write_text(quoted("0,5"))
    found = read_measurement(path)
    assert found.current_a[3] == 0.5
    assert any("decimal comma" in note for note in found.notes)
    path.write_text(quoted("1,234"))
    with pytest.raises(DataError, match="write nothing between the thousands"):
        read_measurement(path)


@pytest.mark.parametrize(
    ("cell", "words"),
    [("−0.992", "its minus is the sign of a typesetter"), ("current_a", "a second table begins there")],
)
def test_what_is_no_number_for_a_reason_is_told_with_it(tmp_path, cell, words):
    path = tmp_path / "odd.csv"
    rows = [f"{k},{k % 2},{4.0 - k / 1e3}" for k in range(20)]
    path.write_text("\n".join(["time_s,current_a,voltage_v", *rows, f"20,{cell},3.9"]) + "\n")
    with pytest.raises(DataError, match=words):
        read_measurement(path)


def test_a_dead_sensor_with_noise_was_taken_for_a_current(tmp_path):
    noise = 0.003 + 0.01 * np.random.default_rng(2).normal(size=len(TIME))
    said = refusal(tmp_path, noise, VOLTAGE)
    assert "the steps of the current" in said
    assert "do not move it (their correlation is 0.0" in said
    partly = CURRENT.copy()
    partly[1500:2700] = noise[1500:2700]
    said = refusal(tmp_path, partly, VOLTAGE)
    assert "row 1501 (line 1502)" in said
    assert "the current stays within -0.0" in said
    assert "--to-s 1500 or --from-s 2699" in said


@pytest.mark.parametrize("rows_late", [1, 2])
def test_a_voltage_that_is_written_rows_late_is_no_dead_current(tmp_path, rows_late):
    late = np.roll(VOLTAGE, rows_late)
    late[:rows_late] = VOLTAGE[0]
    read_measurement(written(tmp_path, CURRENT, late))


@pytest.mark.parametrize(("noise_v", "told"), [(0.0, True), (1e-3, True), (0.01, False)])
def test_two_tests_that_were_joined_in_a_rest_a_tenth_of_a_volt_apart(tmp_path, noise_v, told):
    """At rest nothing explains a step; in noise that is as large, it is not told."""
    current, voltage = CURRENT.copy(), VOLTAGE.copy()
    current[1700:1900], voltage[1700:1900] = 0.0, 3.95 - 0.005 * np.exp(-np.arange(200) / 30.0)
    voltage = voltage + noise_v * np.random.default_rng(3).normal(size=len(TIME))
    assert "goes from" not in notes(tmp_path, current, voltage)
    joined = voltage.copy()
    joined[1800:] -= 0.09
    assert (
        "V at row 1801 (line 1802), 1 s after the row before it" in notes(tmp_path, current, joined)
    ) == told


def test_a_line_of_means_below_a_table_was_a_second_test(tmp_path):
    rows = np.append(np.arange(len(TIME)), 0)
    said = refusal(tmp_path, CURRENT[rows], VOLTAGE[rows], TIME[rows])
    assert "time runs back from 3599 s to 0 s; it is the last row alone, as a line of sums or means" in said


@pytest.mark.parametrize(("hours", "told"), [(1.0, True), (2.0, False)])
def test_a_clock_that_was_put_forward_was_rows_that_are_missing(tmp_path, hours, told):
    time = TIME + np.where(np.arange(len(TIME)) > 1000, 3600.0 * hours, 0.0)
    assert ("a clock that was put forward to summer time" in refusal(tmp_path, time=time)) == told


@pytest.mark.parametrize("name", ["C-rate", "c_rate", "power_w", "Power", "Current (W)", "capacity (Ah)"])
def test_a_c_rate_or_a_power_was_taken_for_a_current(tmp_path, name):
    said = refusal(tmp_path, header=f"time_s,{name},voltage_v", reading={"columns": {"current_a": name}})
    assert "by its name, and current_a is needed in A; convert the column" in said
    read_measurement(
        written(tmp_path, header="time_s,Power supply (A),voltage_v"),
        columns={"current_a": "Power supply (A)"},
    )


@pytest.mark.parametrize(("rows", "told"), [(1, False), (4, True)])
def test_a_voltage_that_is_written_less_often_than_its_current_was_taken_for_the_cell_s(tmp_path, rows, told):
    held = np.round(VOLTAGE[np.arange(len(TIME)) // rows * rows], 4)
    assert (
        "of the steps of the current, as where it is written less often" in notes(tmp_path, CURRENT, held)
    ) == told
