"""Reading: what is accepted, what is refused, and with which words."""

import gzip
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from aesi.data import read_measurement
from aesi.data.channels.gaps import find_gaps
from aesi.data.current import read_current
from aesi.data.read import read
from aesi.data.readers.text import TextTable
from aesi.data.reading import Reading
from aesi.errors import DataError, InputError

N = 200
TIME = np.arange(N) * 1.0
CURRENT = np.where((TIME // 10) % 2 == 0, 5.0, -2.0)
VOLTAGE = 3.7 - 0.01 * CURRENT - 1e-4 * TIME
HEADER = "time_s,current_a,voltage_v"


def text(time=TIME, current=CURRENT, voltage=VOLTAGE, header=HEADER, separator=",", end="\n"):
    rows = (separator.join(map(repr, map(float, row))) for row in zip(time, current, voltage, strict=True))
    return header + end + end.join(rows) + end


def with_line(number: int, line: str) -> str:
    """The good file, one of its lines (1 is the header) replaced."""
    lines = text().split("\n")
    lines[number - 1] = line
    return "\n".join(lines)


def written(folder: Path, content: str | bytes, name: str = "drive.csv") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def refusal(folder: Path, content: str | bytes, **options) -> str:
    with pytest.raises(DataError) as caught:
        read_measurement(written(folder, content), **options)
    assert caught.value.exit_code == 2
    message = str(caught.value)
    assert "\n" not in message
    return message


def assert_same(measurement):
    np.testing.assert_allclose(measurement.time_s, TIME)
    np.testing.assert_allclose(measurement.current_a, CURRENT)
    np.testing.assert_allclose(measurement.voltage_v, VOLTAGE)


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(text().encode(), id="plain"),
        pytest.param(text(end="\r\n").encode(), id="windows lines"),
        pytest.param(b"\xef\xbb\xbf" + text().encode(), id="byte order mark"),
        pytest.param(text().encode("utf-16"), id="utf-16"),
        pytest.param(text(separator=";", header="time_s;current_a;voltage_v").encode(), id="semicolons"),
        pytest.param(
            text(separator=";", header="time_s;current_a;voltage_v").replace(".", ",").encode(),
            id="decimal commas",
        ),
        pytest.param(text(separator="\t", header='"time_s"\t"current_a"\t"voltage_v"').encode(), id="tabs"),
        pytest.param(b"# made by hand\n\n" + text().encode(), id="comment above"),
        pytest.param(b"logger\x85 1\n" + text().encode("latin-1"), id="dots in Windows' letters above"),
        pytest.param(b"page 1\x0c of 1\n" + text().encode(), id="form feed above"),
        pytest.param(text(header=" Time_s , CURRENT_A,voltage_v").encode(), id="other case"),
        pytest.param(gzip.compress(text().encode()), id="gzip"),
    ],
)
def test_every_way_of_writing_gives_the_same_numbers(tmp_path, content):
    assert_same(read_measurement(written(tmp_path, content)))


def test_parquet_is_read_like_csv(tmp_path):
    frame = pd.DataFrame({"time_s": TIME, "current_a": CURRENT, "voltage_v": VOLTAGE})
    frame.to_parquet(tmp_path / "drive.parquet")
    assert_same(read_measurement(tmp_path / "drive.parquet"))


def parquet(folder: Path, **columns) -> Path:
    """The good record as Parquet, some of its columns replaced or added."""
    path = folder / "drive.parquet"
    pd.DataFrame({"time_s": TIME, "current_a": CURRENT, "voltage_v": VOLTAGE, **columns}).to_parquet(path)
    return path


def test_stamps_in_parquet_were_refused_without_the_unit_that_reads_them(tmp_path):
    path = parquet(tmp_path, time_s=pd.date_range("2024-05-31", periods=N, freq="s"))
    with pytest.raises(DataError, match=r"holds timestamp.*times that are no numbers are declared: .*=date"):
        read(path, Reading())
    assert_same(read(path, Reading(units={"time_s": "date"})))


def test_a_blank_clock_time_in_parquet_was_a_time_of_another_form(tmp_path):
    clock = [f"0:{k // 60:02d}:{k % 60:02d}" for k in range(N)]
    clock[3] = " "
    with pytest.raises(DataError, match="row 4, column time_s is empty"):
        read(parquet(tmp_path, time_s=clock), Reading(units={"time_s": "h:m:s"}))


def test_a_name_that_two_columns_of_a_parquet_file_share_was_an_unexpected_error(tmp_path):
    words = np.where(CURRENT > 0, "discharge", "charge")
    columns = {"time_s": TIME, "current_a": np.abs(CURRENT), "voltage_v": VOLTAGE, "state": words}
    arrays = [*map(pa.array, columns.values()), pa.array(["-"] * N)]
    pq.write_table(pa.Table.from_arrays(arrays, [*columns, "state"]), tmp_path / "drive.parquet")
    with pytest.raises(DataError, match="column 'state' has the cell charged and discharged"):
        read(tmp_path / "drive.parquet", Reading())


def test_bdf_is_turned_to_discharge_positive(tmp_path):
    header = "Test Time / s,Current / A,Voltage / V"
    measurement = read_measurement(written(tmp_path, text(current=-CURRENT, header=header), "cell.bdf.csv"))
    assert_same(measurement)
    assert measurement.name == "cell"
    assert any("positive on charge" in note for note in measurement.notes)


def test_bdf_machine_names_are_known_too(tmp_path):
    header = "test_time_second,current_ampere,voltage_volt"
    assert_same(read_measurement(written(tmp_path, text(current=-CURRENT, header=header))))


def test_other_headers_are_mapped_with_their_sign(tmp_path):
    path = written(tmp_path, text(current=-CURRENT, header="Time [s],I[A],U[V]"))
    columns = {"time_s": "Time [s]", "current_a": "I[A]", "voltage_v": "U[V]"}
    assert_same(read_measurement(path, columns, "charge-positive"))


def test_a_missing_column_names_the_nearest_and_the_option(tmp_path):
    message = refusal(tmp_path, text(header="time_s,I[A],voltage_v"))
    assert "drive.csv" in message
    assert "current_a" in message
    assert '--column current_a="I[A]"' in message


@pytest.mark.parametrize("temperature", ["T_amb", "T"])
@pytest.mark.parametrize("stamps", ["timestamp", "Date_Time", "Datum", "DateTime"])
def test_a_temperature_was_proposed_as_the_time_beside_a_column_of_dates(tmp_path, stamps, temperature):
    header = f"{temperature},{stamps},current_a,voltage_v"
    line = "25.0,2024-03-05 09:12:00,1.0,3.7"
    message = refusal(tmp_path, "\n".join([header, line, line]) + "\n")
    assert f"the nearest: '{stamps}'." in message
    assert f'--column time_s="{stamps}"' in message


def test_most_rows_were_to_be_removed_where_a_thermocouple_was_read_less_often(tmp_path):
    rows = "".join(
        f"{t},{i},{v},{25 if k % 5 == 0 else ''}\n"
        for k, (t, i, v) in enumerate(zip(TIME, CURRENT, VOLTAGE, strict=True))
    )
    message = refusal(tmp_path, f"{HEADER},temperature_degc\n{rows}")
    assert "remove" not in message
    assert "interpolate it to all rows, or leave the column out" in message


def test_a_lone_t_is_the_time_where_no_column_has_dates(tmp_path):
    assert '--column time_s="T"' in refusal(tmp_path, "T,current_a,voltage_v\n1,2,3\n2,2,3\n")
    path = tmp_path / "named.csv"
    path.write_text("T,current_a,voltage_v\n1,2,3.7\n2,2,3.6\n")
    assert not any("temperature" in note for note in read(path, Reading({"time_s": "T"})).notes)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("T", ""), ("T (K)", "K"), ("T/K", "K"), ("T [C]", ""), ("T_F", "degF")],
)
def test_a_temperature_under_its_symbol_was_passed_over_without_a_word(tmp_path, name, unit):
    path = tmp_path / "drive.csv"
    path.write_text(f"time_s,current_a,voltage_v,{name}\n1,2,3.7,298\n2,2,3.6,298\n")
    declared = f" --unit temperature_degc={unit}" if unit else ""
    assert any(
        f'is not used; --column temperature_degc="{name}"{declared} takes it' in note
        for note in read(path, Reading()).notes
    )
    message = refusal(tmp_path, f"{name},Zeit,current_a,voltage_v\n298,1,2,3\n298,2,2,3\n")
    assert '--column time_s="Zeit"' in message


@pytest.mark.parametrize(
    "names",
    ["Temps (s),Courant (A),Tension (V)", "Tempo [s],Corrente [A],Tensione [V]", "t/s,Ibat/A,Ubat/V"],
)
def test_names_in_other_languages_were_not_proposed_by_their_units(tmp_path, names):
    message = refusal(tmp_path, text(header=names))
    time, current, voltage = names.split(",")
    assert (
        f'--column time_s="{time}" --column current_a="{current}" --column voltage_v="{voltage}"' in message
    )
    limit = refusal(tmp_path, text(header=HEADER.replace("current_a", "Imax limit (A)")))
    assert '--column current_a="NAME"' in limit


def test_a_zeitstempel_was_a_temperature_and_proposed_before_the_time(tmp_path):
    message = refusal(tmp_path, "Zeitstempel,Zeit,current_a,voltage_v\n1,2,3,4\n1,2,3,4\n")
    assert '--column time_s="Zeit"' in message
    path = tmp_path / "drive.csv"
    path.write_text("Zeitstempel,current_a,voltage_v,Temp\n1,2,3.7,25\n2,2,3.6,25\n")
    assert not any(
        "from 'Zeitstempel'" in note
        for note in read(path, Reading({"time_s": "Zeitstempel", "temperature_degc": "Temp"})).notes
    )


@pytest.mark.parametrize(
    ("stamp", "pattern"),
    [
        ("27.10.2024 02:45:00", "%d.%m.%Y %H:%M:%S'"),
        ("27.10.2024 02:45:00.5", "%d.%m.%Y %H:%M:%S.%f'"),
        ("10/27/2024 02:45:00", "%m/%d/%Y %H:%M:%S'"),
    ],
)
def test_a_pattern_was_proposed_that_does_not_fit_the_dates(tmp_path, stamp, pattern):
    assert f"--unit 'time_s={pattern}" in refusal(tmp_path, with_line(6, f"{stamp},1.0,3.7"))


def test_a_test_s_time_is_proposed_before_a_date(tmp_path):
    message = refusal(tmp_path, "Date,Test Time,current_a,voltage_v\n1,2,3,4\n1,2,3,4\n")
    assert '--column time_s="Test Time"' in message


def test_a_mark_for_a_missing_value_was_refused_without_a_remedy(tmp_path):
    message = refusal(tmp_path, with_line(6, "4.0,---,3.7"))
    assert message.endswith("holds '---', which is not a number: correct it, or remove the row.")


def test_a_column_that_is_no_time_was_told_as_one_written_too_coarsely(tmp_path):
    message = refusal(tmp_path, text(time=np.full(len(TIME), 25.0)))
    assert f"the time is 25 s in all {len(TIME)} rows" in message
    assert "--column time_s=NAME" in message
    assert "--duplicates" not in message


def test_two_cells_row_by_row_in_one_file_were_told_as_a_coarse_time(tmp_path):
    both = {"time": np.repeat(TIME, 2), "current": np.repeat(CURRENT, 2), "voltage": np.repeat(VOLTAGE, 2)}
    both["voltage"] = both["voltage"] - 0.01 * (np.arange(2 * len(TIME)) % 2)
    assert "Or the file holds 2 cells or channels, a row of each at every stamp" in refusal(
        tmp_path, text(**both)
    )


@pytest.mark.parametrize(
    ("line", "words"),
    [
        pytest.param("4.0,abc,3.7", ["current_a", "row 5", "line 6", "'abc'"], id="no number"),
        pytest.param("4.0,1_000,3.7", ["current_a", "row 5", "not a number"], id="underscore"),
        pytest.param("4.0,,3.7", ["current_a", "row 5", "line 6", "NaN"], id="empty"),
        pytest.param("4.0,nan,3.7", ["current_a", "row 5", "NaN"], id="nan"),
        pytest.param("4.0,1.0,inf", ["voltage_v", "row 5", "infinite"], id="infinite"),
        pytest.param("4.0,1.0", ["row 5", "line 6", "2 cells"], id="short row"),
        pytest.param("2.5,5.0,3.7", ["time_s", "row 5", "runs back"], id="time back"),
        pytest.param("3.0,5.0,3.7", ["time_s", "row 5", "twice"], id="duplicate"),
        pytest.param("4.0,5.0,0.0", ["voltage_v", "row 5", "0 V"], id="dropout"),
    ],
)
def test_one_bad_row_is_named(tmp_path, line, words):
    message = refusal(tmp_path, with_line(6, line))
    assert "drive.csv" in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("decimal", "cell", "sign"),
    [
        (",", "1.000", "comma"),
        (",", "1.000,0", "comma"),
        (",", "1,000,0", "comma"),
        (",", "4.5", "comma"),
        (",", "4.5e1", "comma"),
        (".", "1,000.0", "point"),
        (".", "1,000.0e0", "point"),
    ],
)
def test_a_number_written_otherwise_than_the_rest_was_told_in_the_words_of_a_library(
    tmp_path, decimal, cell, sign
):
    lines = text(separator=";", header="time_s;current_a;voltage_v").replace(".", decimal).splitlines()
    lines[100] = f"{cell};5{decimal}0;3{decimal}7"
    message = refusal(tmp_path, "\n".join(lines))
    assert f"drive.csv, row 100 (line 101): column 'time_s' holds '{cell}'" in message
    assert f"other numbers have a decimal {sign}; write it in all of them" in message


@pytest.mark.parametrize("decimal", [".", ","])
def test_a_unit_in_a_cell_with_a_decimal_comma_was_taken_for_a_wrong_decimal_sign(tmp_path, decimal):
    lines = text(separator=";", header="time_s;current_a;voltage_v").replace(".", decimal).splitlines()
    lines[100] = f"99{decimal}0;5{decimal}0 A;3{decimal}7"
    message = refusal(tmp_path, "\n".join(lines))
    assert f"column 'current_a' holds '5{decimal}0 A', which is not a number: write numbers alone" in message


@pytest.mark.parametrize(
    ("order", "words"),
    [
        pytest.param(np.arange(N)[::-1], "199 times in all: sort the rows", id="reversed"),
        pytest.param(np.random.default_rng(0).permutation(N), "sort the rows by their time", id="shuffled"),
        pytest.param(
            np.arange(N) % 50, "begins anew 3 times, as the time of a step does", id="time of a step"
        ),
        pytest.param(np.arange(N) % 150 + np.arange(N) // 150, "split it there", id="two tests"),
    ],
)
def test_times_that_run_back_are_told_by_what_they_are(tmp_path, order, words):
    assert words in refusal(tmp_path, text(time=TIME[order]))


@pytest.mark.parametrize("bounds", [(50, 100, 150), (3, 8, 12), (0, 60, N)])
@pytest.mark.parametrize("start_s", [0.0, 1.7e9 + 0.1])
def test_a_block_of_rows_that_stood_behind_another_was_to_be_split_into_two_tests(tmp_path, bounds, start_s):
    first, second, end = bounds
    rows = np.arange(N)
    swapped = np.concatenate([rows[:first], rows[second:end], rows[first:second], rows[end:]])
    uneven = start_s + TIME + 0.2 * np.sin(TIME)
    for clock in (start_s + TIME, uneven):
        assert "out of order, since by their time" in refusal(tmp_path, text(time=clock[swapped]))
    moved = np.concatenate([rows[:40], rows[120:], rows[80:120], rows[40:80]])
    assert "sort the rows by it" in refusal(tmp_path, text(time=TIME[moved]))


@pytest.mark.parametrize(
    "clock",
    [
        pytest.param(np.where(TIME < 100, TIME, TIME - 1.5), id="a clock that was put back a little"),
        pytest.param(np.where(TIME < 100, TIME + 500.0, TIME), id="an earlier test behind a later one"),
        pytest.param(np.where(TIME < 100, TIME, TIME - 99.5), id="two tests of one length"),
    ],
)
def test_tests_with_clocks_of_their_own_are_not_to_be_sorted(tmp_path, clock):
    assert "split it there" in refusal(tmp_path, text(time=clock))


def test_pieces_with_clocks_of_their_own_were_to_be_sorted_into_one_another(tmp_path):
    clock = np.where(
        np.arange(N) // 50 % 2, TIME - 10.0, TIME
    )  # each second piece starts before the first ends
    assert "Sorting would mix them" in refusal(tmp_path, text(time=clock))


def test_a_clock_that_passes_midnight_is_told_from_two_tests(tmp_path):
    clock = (TIME + 86_300.0) % 86_400.0
    assert "starts anew at midnight" in refusal(tmp_path, text(time=clock))
    hours = np.where(TIME < 100, 36.0 * TIME, 36.0 * (TIME - 100.0))
    assert "one continuous test: split it there" in refusal(tmp_path, text(time=hours))


def test_a_sign_that_is_declared_is_believed_of_bdf_too(tmp_path):
    content = text(header="Test Time / s,Current / A,Voltage / V")
    assert "--sign discharge-positive" in refusal(tmp_path, content)
    measurement = read_measurement(tmp_path / "drive.csv", sign="discharge-positive")
    assert_same(measurement)
    assert any("declared positive on discharge" in note for note in measurement.notes)


def test_the_first_bad_row_is_named_below_blank_lines(tmp_path):
    message = refusal(tmp_path, text().replace("\n", "\n\n") + "x,1,2\n")
    assert "row 201 (line 403)" in message


def test_duplicates_can_be_dropped_and_that_is_said(tmp_path):
    path = written(tmp_path, with_line(6, "3.0,5.0,3.7"))
    measurement = read_measurement(path, duplicates="last")
    assert len(measurement) == N - 1
    assert any("1 row was dropped" in note for note in measurement.notes)


def test_a_gap_is_refused_with_both_ways_out(tmp_path):
    lines = text().split("\n")
    content = "\n".join(lines[:60] + lines[150:])
    message = refusal(tmp_path, content)
    assert "gap of 91 s after 58 s" in message
    assert len(read_measurement(written(tmp_path, content), stop_s=58)) == 59
    assert len(read_measurement(written(tmp_path, content), start_s=149)) == N - 149


def test_gaps_some_rows_apart_hid_one_another(tmp_path):
    lines = text().split("\n")
    message = refusal(tmp_path, "\n".join(lines[:60] + lines[100:108] + lines[150:]))
    assert "gap of 41 s after 58 s" in message


def test_the_intervals_of_a_logger_that_writes_slowly_in_a_rest_are_no_gaps():
    after_pulse = np.array([*np.ones(20), 60.9, 52.4, *np.ones(20)])  # of an HPPC test at one row in a minute
    at_changes = np.tile([1.0, 1.0, 2.0, 5.0, 12.0, 50.0, 600.0, 530.0], 5)
    pairs_at_steps = np.tile([0.1, 60.0], 30)
    for step in (after_pulse, at_changes, pairs_at_steps):
        assert find_gaps({"time_s": np.cumsum(step)}) == []


def test_the_time_of_a_step_was_proposed_beside_that_of_the_test(tmp_path):
    table = text(header="Time,I[A],U[V]").splitlines()
    total = [f"{row},{cell}" for row, cell in zip(table, ["Total Time (h)", *TIME / 3600], strict=True)]
    assert '--column time_s="Total Time (h)" --unit time_s=h' in refusal(tmp_path, "\n".join(total))


def test_a_part_that_is_the_whole_file_was_taken_without_a_word(tmp_path):
    notes = read_measurement(written(tmp_path, text()), stop_s=99_999).notes
    said = "Read up to 99999 s as asked, which leaves out nothing: its times run from 0 s to 199 s."
    assert any(said in note for note in notes)


def test_a_part_without_rows_named_an_option_that_nobody_had_given(tmp_path):
    message = refusal(tmp_path, text(), start_s=300.0, stop_s=400.0)
    assert message == (
        "drive.csv: read from 300 s on up to 400 s as asked, it has no row, and a record needs two; its times run from "
        "0 s to 199 s."
    )


@pytest.mark.parametrize(
    "end", [{"start_s": float("nan")}, {"stop_s": float("nan")}, {"stop_s": float("inf")}]
)
def test_a_time_that_is_none_was_taken_for_the_whole_record(tmp_path, end):
    assert "give a time in seconds" in refusal(tmp_path, text(), **end)


def test_a_sparsely_logged_rest_is_no_gap_but_a_note(tmp_path):
    time = np.concatenate([np.arange(50.0), [500.0], 500 + np.arange(1.0, 50)])
    current = np.concatenate([np.tile([5.0, -5.0], 20), np.zeros(20), np.tile([5.0, -5.0], 20)])
    voltage = 3.7 - 0.01 * current
    measurement = read_measurement(written(tmp_path, text(time, current, voltage)))
    assert len(measurement) == len(time)
    assert any("rested" in note for note in measurement.notes)


def test_another_voltage_after_a_while_without_rows_is_no_rest(tmp_path):
    time = np.concatenate([np.arange(50.0), 499.0 + np.arange(50.0)])
    current = np.concatenate([np.tile([5.0, -5.0], 20), np.zeros(20), np.tile([5.0, -5.0], 20)])
    voltage = np.where(time < 50.0, 3.7, 3.69) - 0.01 * current
    assert "a gap of 450 s after 49 s" in refusal(tmp_path, text(time, current, voltage))


def pulses_logged_on_change(begins: bool, charge_a=4.0):
    """Rows of three pulses, (n, 3) s, A, V: a row a second in a pulse of 30 s, one at the end of a rest; then a steady
    current for 600 s with its last row, and a rest alike. `begins`: with the first row of each rest and current too."""
    rows, now, open_v = [(0.0, 0.0, 3.9)], 0.0, 3.9
    for _ in range(3):
        rows += [(now + s, 8.0, open_v - 0.08 - 1e-3 * s) for s in range(1, 31)]
        now, open_v = now + 30.0, open_v - 0.005
        rows += [(now + 0.5, 0.0, open_v - 0.03)] * begins + [(now + 5400.0, 0.0, open_v)]
        now += 5400.0
        rows += [(now + 0.5, charge_a, open_v - 0.01 * charge_a)] * begins
        open_v -= 0.01 * charge_a
        rows += [(now + 600.0, charge_a, open_v - 0.01 * charge_a)] * begins
        now += 600.0 * begins
        rows += [(now + 0.5, 0.0, open_v - 5e-3 * charge_a), (now + 1800.0, 0.0, open_v)] * begins
        now += 1800.0 * begins
    return np.array(rows).T


@pytest.mark.parametrize("charge_a", [4.0, -4.0])
def test_a_pulse_test_that_was_logged_on_change_was_refused_for_a_gap(tmp_path, charge_a):
    table = pulses_logged_on_change(True, charge_a)
    record = read_measurement(written(tmp_path, text(*table)))
    assert len(record) == table.shape[1]
    told = " ".join(record.notes)
    assert "No rows for 1.8e+03 to 5.4e+03 s at 6 places, the first at 30.5 s; the cell rested." in told
    assert "No rows for 599.5 s from 5430.5 s on; the current before and after them is the same" in told


def test_a_rest_of_which_the_last_row_alone_was_written_was_refused_for_a_gap(tmp_path):
    table = pulses_logged_on_change(False)
    record = read_measurement(written(tmp_path, text(*table)))
    assert record.hold_taken == "backward"
    assert any("No rows for 5400 s from 30 s on; the cell rested." in note for note in record.notes)


@pytest.mark.parametrize(
    ("row", "change"),
    [
        pytest.param(31, (0.0, 0.0, -0.12), id="rest at a lower voltage than under the load"),
        pytest.param(31, (0.0, 0.0, 0.06), id="rest at a higher voltage than before the load"),
        pytest.param(31, (0.0, 8.0, 0.0), id="the first row of a load"),
    ],
)
def test_a_row_that_ends_no_rest_does_not_tell_what_the_cell_did_before_it(tmp_path, row, change):
    table = pulses_logged_on_change(False)
    table[:, row] += change
    message = refusal(tmp_path, text(*table))
    assert "a gap of 5400 s after 30 s" in message
    assert "give its first row as well as its last" in message


def test_a_steady_current_under_which_the_voltage_went_the_other_way_is_a_gap(tmp_path):
    table = pulses_logged_on_change(True)
    table[2, 34] += 0.06
    assert "a gap of 599.5 s after 5430.5 s" in refusal(tmp_path, text(*table))


def test_a_lone_row_long_after_the_test_is_dropped_and_that_is_said(tmp_path):
    content = text() + "50000.0,0.0,3.9\n"
    measurement = read_measurement(written(tmp_path, content))
    assert_same(measurement)
    assert any("dropped" in note for note in measurement.notes)


def test_a_lone_row_long_before_the_test_ended_it(tmp_path):
    first = f"time_s,current_a,voltage_v\n{TIME[0] - 50000.0},0.0,3.1\n"
    measurement = read_measurement(written(tmp_path, first + text().partition("\n")[2]))
    np.testing.assert_array_equal(measurement.time_s, TIME)
    assert any("The first row, 50000 s before the one after it" in note for note in measurement.notes)
    stuck = np.array(VOLTAGE)
    stuck[60:] = stuck[60]
    message = refusal(tmp_path, first + text(voltage=stuck).partition("\n")[2])
    assert "row 62 (line 63), column voltage_v: the voltage stands still" in message


def test_a_cell_that_was_taken_off_at_the_end_is_told_how_to_be_read(tmp_path):
    volts = np.array(VOLTAGE)
    volts[-2:] = -0.0006
    message = refusal(tmp_path, text(voltage=volts))
    assert f"leave out where the cell was not connected: --to-s {TIME[-3]:g} (" in message
    read_measurement(written(tmp_path, text(voltage=volts)), stop_s=float(TIME[-3]))
    volts[50] = -0.0006
    assert "--to-s" not in refusal(tmp_path, text(voltage=volts))


def test_a_quotation_mark_that_is_not_closed_was_told_as_a_row_cut_short_in_the_last_line(tmp_path):
    lines = text().splitlines()
    lines[50] = f'"{lines[50]}'
    message = refusal(tmp_path, "\n".join(lines) + "\n")
    assert "row 50 (line 51): a quotation mark is opened there and not closed" in message


@pytest.mark.parametrize("suffix", [".mpr", ".ndax", ".parquet", ".csv"])
def test_a_pointer_of_git_lfs_is_told_whatever_file_it_stands_for(tmp_path, suffix):
    file = tmp_path / f"drive{suffix}"
    file.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    with pytest.raises(DataError, match="a pointer to them"):
        read_measurement(file)


def test_a_remark_of_two_lines_is_no_quotation_mark_left_open(tmp_path):
    header, *lines = text().splitlines()
    remarked = [f'{line},"two\nlines"' for line in lines]
    (tmp_path / "drive.csv").write_text("\n".join([f"{header},remark", *remarked]) + "\n")
    assert len(read_measurement(tmp_path / "drive.csv")) == len(lines)
    remarked[70] = remarked[70].replace(lines[70], lines[70].replace(",", ",oops", 1), 1)
    assert "oops" in refusal(tmp_path, "\n".join([f"{header},remark", *remarked]) + "\n")


def test_a_file_without_a_column_said_that_it_has_and_no_more(tmp_path):
    pd.DataFrame().to_parquet(tmp_path / "drive.parquet")
    with pytest.raises(DataError, match="It has: none "):
        read_measurement(tmp_path / "drive.parquet")


def test_a_row_without_a_voltage_among_good_ones_was_told_as_a_wrong_column(tmp_path):
    volts = np.array(VOLTAGE)
    volts[50] = 0.0
    assert "rows like it: 1): remove or correct these rows, or check the column" in refusal(
        tmp_path, text(voltage=volts)
    )
    assert "remove" not in refusal(tmp_path, text(voltage=0.0 * VOLTAGE))


def test_the_voltage_of_a_pack_was_told_as_one_in_another_unit(tmp_path):
    volts = np.array(VOLTAGE)
    assert "divide a voltage of cells in series by their number" in refusal(
        tmp_path, text(voltage=4.0 * volts)
    )
    volts[50] *= 4.0
    assert "in series" not in refusal(tmp_path, text(voltage=volts))


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"current": -CURRENT}, ["sign", "--sign charge-positive"]),
        ({"current": 1000 * CURRENT}, ["current_a", "mA"]),
        ({"voltage": 1000 * VOLTAGE}, ["voltage_v", "mV"]),
        ({"voltage": np.full(N, 3.7)}, ["voltage_v", "all 200 rows"]),
    ],
)
def test_values_that_contradict_themselves_are_refused(tmp_path, columns, words):
    message = refusal(tmp_path, text(**columns))
    for word in words:
        assert word in message


def test_the_sign_of_a_plain_discharge_is_checked_along_the_test(tmp_path):
    discharge = np.full(N, 3.0)
    falling = np.linspace(4.1, 3.2, N)
    read_measurement(written(tmp_path, text(current=discharge, voltage=falling)))
    assert "along the test" in refusal(tmp_path, text(current=-discharge, voltage=falling))


def test_a_unit_in_the_name_is_believed(tmp_path):
    message = refusal(tmp_path, text(header="time_s,I[mA],voltage_v"), columns={"current_a": "I[mA]"})
    assert "in mA by its name" in message


@pytest.mark.parametrize(
    ("quantity", "name"),
    [
        ("time_s", "Time [m]"),
        ("time_s", "Time (mn)"),
        ("time_s", "Time / ks"),
        ("current_a", "Current [mA/cm2]"),
        ("current_a", "Current [% of C]"),
        ("current_a", "Current [dA]"),
        ("voltage_v", "U (cV)"),
    ],
)
def test_an_unknown_unit_in_a_name_was_taken_for_si(tmp_path, quantity, name):
    content = text(header=HEADER.replace(quantity, name))
    message = refusal(tmp_path, content, columns={quantity: name})
    assert f"declare the one it is in, as in --unit {quantity}=" in message
    si = quantity.rpartition("_")[2]
    assert len(read_measurement(tmp_path / "drive.csv", {quantity: name}, units={quantity: si})) == N


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "empty"),
        (HEADER.encode(), "too few rows below its header (0)"),
        (text().split("\n", 1)[1].encode(), "names the columns"),
        (bytes(range(256)) * 10, "binary"),
        (gzip.compress(text().encode())[:300], "truncated"),
        (b"PAR1" + b"x" * 20, "damaged"),
        (b"PK\x03\x04" + b"x" * 20, "spreadsheet"),
        (text(separator=" ", header="time_s current_a voltage_v").encode(), "no comma"),
        (text(header="time_s,voltage_v,voltage_v").encode(), "2 columns named"),
        (text().encode() + b"200.0,5.0", "2 cells"),
        (b"<!DOCTYPE html>\n<html><body>Log in, please</body></html>", "web page"),
        (b"<html>\n<head><title>404</title></head></html>", "web page"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n", "git lfs pull"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path, content, word):
    assert word in refusal(tmp_path, content)


NAMELESS = text().split("\n", 1)[1]
BY_NUMBER = {"time_s": "#1", "current_a": "#2", "voltage_v": "#3"}


@pytest.mark.parametrize(
    "above", ["", "LabVIEW Measurement\t\nSeparator\tComma\n***End_of_Header***\t\n\t\n", "# a note\n\n"]
)
def test_a_table_without_names_could_not_be_read_or_lost_its_first_row(tmp_path, above):
    path = tmp_path / "drive.txt"
    path.write_text(above + NAMELESS)
    record = read_measurement(path, BY_NUMBER)
    assert len(record) == N
    np.testing.assert_allclose(record.time_s, TIME)
    np.testing.assert_allclose(record.current_a, CURRENT)
    assert "numbered" in " ".join(record.notes)


def test_a_table_without_names_says_its_first_row_and_how_columns_are_called(tmp_path):
    said = refusal(tmp_path, "No,0.0,3.6,1.5,x\nNo,1.0,3.6,1.5,x\n")
    assert "--column time_s=#N" in said
    assert "#2 '0.0', #3 '3.6'" in said


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize(
    "names", [(), ("Zeit, s", "Strom, A", "U1, U2, V")], ids=["no names", "names with commas"]
)
def test_a_table_was_cut_at_the_commas_of_its_numbers_or_names(tmp_path, separator, decimal, names):
    columns = dict(zip(BY_NUMBER, names or BY_NUMBER.values(), strict=True))
    rows = text(header="", separator=separator).replace(".", decimal).lstrip()
    path = written(tmp_path, f"{separator.join(names)}\n{rows}".lstrip(), "drive.txt")
    assert_same(read_measurement(path, columns))


@pytest.mark.parametrize("decimal", [".", ","])
def test_a_decimal_comma_was_not_seen_behind_a_rest_in_whole_numbers(tmp_path, decimal):
    rest_s = 120
    current = np.concatenate([np.zeros(rest_s), CURRENT])
    voltage = np.concatenate([np.full(rest_s, 3700.0), 1e3 * VOLTAGE])
    rows = (
        f"{t};{i:g};{v:.6g}".replace(".", decimal)
        for t, (i, v) in enumerate(zip(current, voltage, strict=True))
    )
    path = written(tmp_path, "\n".join(["time_s;current_a;voltage_v", *rows, ""]))
    record = read_measurement(path, units={"voltage_v": "mV"})
    np.testing.assert_allclose(record.voltage_v[rest_s:], VOLTAGE, atol=1e-3)


def test_a_number_that_no_column_has_is_told(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text(NAMELESS)
    with pytest.raises(DataError, match="no column '#9' for time_s"):
        read_measurement(path, {**BY_NUMBER, "time_s": "#9"})


def test_a_header_with_a_name_too_few_is_no_table_without_names(tmp_path):
    said = refusal(tmp_path, "time_s,current_a,voltage_v\n0,1,3.7,25\n1,1,3.7,25\n")
    assert "4 cells where the header has 3; a column has no name, or a separator stands within a cell" in said


def test_a_row_with_decimal_commas_between_commas_was_said_to_be_cut_short(tmp_path):
    said = refusal(tmp_path, "time_s,current_a,voltage_v\n0,0,1,5,3,7\n1,0,1,5,3,69\n")
    assert "row 1 (line 2): 6 cells where the header has 3; " in said
    assert "cut short" not in said
    assert said.endswith("separate the cells by semicolons.")


def test_no_file_and_a_folder(tmp_path):
    with pytest.raises(DataError, match="no file"):
        read_measurement(tmp_path / "nowhere.csv")
    with pytest.raises(DataError, match="folder"):
        read_measurement(tmp_path)


def test_a_last_line_without_end_is_said(tmp_path):
    measurement = read_measurement(written(tmp_path, text()[:-1]))
    assert any("last line" in note for note in measurement.notes)


def test_temperature_can_be_left_out(tmp_path):
    lines = [f"{line},300.0" for line in text().strip().split("\n")]
    lines[0] = HEADER + ",temperature_degc"
    path = written(tmp_path, "\n".join(lines) + "\n")
    with pytest.raises(DataError, match="kelvin"):
        read_measurement(path)
    assert read_measurement(path, {"temperature_degc": None}).temperature_degc is None


@pytest.mark.parametrize("stated", ["40", "-10.5", "0", 40, -10.5, 0])
def test_a_temperature_that_is_known_needed_a_column(tmp_path, stated):
    path = tmp_path / "drive.csv"
    path.write_text(text())
    record = read_measurement(path, {"temperature_degc": stated})
    np.testing.assert_array_equal(record.temperature_degc, np.full(N, float(stated)))
    assert [note for note in record.notes if "temperature" in note] == [
        f"drive.csv: temperature_degc is {stated} in every row, as stated."
    ]


@pytest.mark.parametrize(("stated", "unit"), [("77", "degF"), ("298.15", "K")])
def test_the_unit_of_a_stated_temperature_was_dropped(tmp_path, stated, unit):
    record = read_measurement(
        written(tmp_path, text()), {"temperature_degc": stated}, units={"temperature_degc": unit}
    )
    np.testing.assert_allclose(record.temperature_degc, 25.0)
    assert record.notes == (
        f"drive.csv: temperature_degc is {stated} {unit}, 25 degC, in every row, as stated.",
    )


def test_a_stated_temperature_that_no_cell_has_was_looked_for_in_a_column_of_the_file(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text(text())
    with pytest.raises(DataError) as caught:
        read_measurement(path, {"temperature_degc": "298.15"})
    assert str(caught.value).startswith(
        "drive.csv: stated for every row: 298.15 degC is outside -60 to 150 degC (in kelvin? --unit "
    )
    assert "state another" in str(caught.value)
    assert "row 1" not in str(caught.value)


def test_decimation_keeps_the_charge_and_is_said(tmp_path):
    measurement = read_measurement(written(tmp_path, text()), max_rows=50)
    assert len(measurement) <= 50
    charge_ah = measurement.discharged_ah("backward")[-1]
    last = np.searchsorted(TIME, measurement.time_s[-1]) + 1
    # Rows a second apart: the current is straight between them, and a row is the average since the row before.
    assert 3600.0 * charge_ah == pytest.approx(np.trapezoid(CURRENT[:last], TIME[:last]))
    assert any("Decimated from 200" in note for note in measurement.notes)


@pytest.mark.parametrize("options", [{"sign": "positive"}, {"duplicates": "all"}, {"columns": {"x": "y"}}])
def test_unknown_options_are_refused(tmp_path, options):
    refusal(tmp_path, text(), **options)


@pytest.mark.parametrize("line", ["8.0,x,3.6", "8.0,5.0", "1.0,5.0,3.6"], ids=["word", "short", "runs back"])
def test_a_refused_file_is_closed_while_its_error_lives(tmp_path, monkeypatch, line):
    opened = []
    original = TextTable._bytes
    monkeypatch.setattr(TextTable, "_bytes", lambda table: opened.append(original(table)) or opened[-1])
    with pytest.raises(DataError):
        read_measurement(written(tmp_path, with_line(10, line)))
    assert len(opened) >= 3  # a look at the head, the columns, and the search for the row
    assert all(stream.closed for stream in opened)


def test_a_current_of_zero_under_a_moving_voltage_is_refused(tmp_path):
    falling = np.linspace(4.1, 3.2, N)
    said = refusal(tmp_path, text(current=0.0 * CURRENT, voltage=falling))
    assert "current_a: the current is 0 A in all 200 rows while the voltage moves by 0.90 V" in said


@pytest.mark.parametrize(
    "name", ["T_cell", "Tcell [degC]", "T surf", "thermocouple 1", "TC1", "Can Temp", "T2"]
)
def test_a_temperature_under_another_header_is_told_of(tmp_path, name):
    rows = "".join(f"{t},{i},{v},25.0\n" for t, i, v in zip(TIME, CURRENT, VOLTAGE, strict=True))
    found = read_measurement(written(tmp_path, f"{HEADER},{name}\n{rows}"))
    assert found.temperature_degc is None
    assert any(f"{name!r} looks like a temperature and is not used" in note for note in found.notes)


def test_a_voltage_that_a_simulation_does_not_need_is_told_of(tmp_path):
    rows = "".join(f"{t},{i},{1e3 * v}\n" for t, i, v in zip(TIME, CURRENT, VOLTAGE, strict=True))
    found = read_current(written(tmp_path, f"time_s,current_a,Voltage [mV]\n{rows}"))
    assert found.voltage_v is None
    option = '--column voltage_v="Voltage [mV]" --unit voltage_v=mV takes it.'
    assert any(
        "'Voltage [mV]' looks like a voltage and is not used" in n and n.endswith(option) for n in found.notes
    )


def test_a_room_in_fahrenheit_is_doubted(tmp_path):
    rows = "".join(f"{t},{i},{v},77\n" for t, i, v in zip(TIME, CURRENT, VOLTAGE, strict=True))
    path = written(tmp_path, f"{HEADER},temperature_degc\n{rows}")
    assert "starts at 77 degC" in read_measurement(path).notes[-1]
    converted = read_measurement(path, units={"temperature_degc": "F"})
    np.testing.assert_allclose(converted.temperature_degc, 25.0)
    assert not any("starts at" in note for note in converted.notes)


@pytest.mark.parametrize(
    ("number", "unit", "advice"),
    [
        (298.15, "F", "if that is in kelvin: --unit temperature_degc=K."),
        (77, None, "if that is in Fahrenheit: --unit temperature_degc=degF."),
        (140 + 273.15, "K", "check the column."),
        (170, "F", "check the column."),
    ],
)
def test_a_doubted_temperature_was_advised_the_unit_in_which_it_was_taken(tmp_path, number, unit, advice):
    rows = "".join(f"{t},{i},{v},{number}\n" for t, i, v in zip(TIME, CURRENT, VOLTAGE, strict=True))
    path = written(tmp_path, f"{HEADER},temp\n{rows}")
    said = read(
        path, Reading({"temperature_degc": "temp"}, {} if unit is None else {"temperature_degc": unit})
    )
    assert said.notes[-1].endswith(f"warmer than cells are tested; {advice}")


def test_a_temperature_in_kelvin_that_is_none_was_asked_whether_it_is_in_kelvin(tmp_path):
    rows = "".join(f"{t},{i},{v},700\n" for t, i, v in zip(TIME, CURRENT, VOLTAGE, strict=True))
    path = written(tmp_path, f"{HEADER},temp\n{rows}")
    for unit, asked in ((None, True), ("K", False)):
        reading = Reading({"temperature_degc": "temp"}, {} if unit is None else {"temperature_degc": unit})
        with pytest.raises(DataError, match="is outside -60 to 150 degC") as caught:
            read(path, reading)
        assert ("in kelvin?" in str(caught.value)) is asked


LOGGER = {"time_s": "Zeit/min", "current_a": "Strom/mA", "voltage_v": "Spannung/V", "temperature_degc": "T/K"}
LOGGED = {"time_s": "min", "current_a": "mA", "voltage_v": "V", "temperature_degc": "K"}


@pytest.mark.parametrize(
    ("quantity", "declared", "words"),
    [
        (
            "time_s",
            "h",
            "column 'Zeit/min' is in min by its header, and h was declared for time_s; declare --unit",
        ),
        ("current_a", "uA", "column 'Strom/mA' is in mA by its header, and uA was declared"),
        ("current_a", "A", "column 'Strom/mA' is in mA by its header, and A was declared"),
        ("temperature_degc", "degF", "column 'T/K' is in K by its header, and degF was declared"),
    ],
)
def test_a_unit_that_contradicts_the_header_was_taken_in_silence(tmp_path, quantity, declared, words):
    rows = zip(TIME / 60.0, 1e3 * CURRENT, VOLTAGE, strict=True)
    path = written(
        tmp_path, ",".join(LOGGER.values()) + "\n" + "".join(f"{t},{i},{v},298\n" for t, i, v in rows)
    )
    np.testing.assert_allclose(read(path, Reading(LOGGER, LOGGED)).current_a, CURRENT)
    with pytest.raises(DataError, match=words):
        read(path, Reading(LOGGER, LOGGED | {quantity: declared}))


def test_an_si_unit_of_the_header_was_overruled_in_silence(tmp_path):
    """What the checks advise of a column in SI by its name, whose values are plainly not."""
    path = written(tmp_path, text(time=1e3 * TIME))
    note = "time_s was converted from ms as declared, though column 'time_s' is in s by its header."
    assert read_measurement(path, units={"time_s": "ms"}).notes[-1].endswith(note)


def test_a_quantity_that_was_cut_short_was_taken_for_another(tmp_path):
    """Of 'temp': did you mean 'step'?"""
    with pytest.raises(DataError, match=r"did you mean 'temperature_degc'\? There are"):
        read_measurement(written(tmp_path, text()), columns={"temp": "T"})


def test_a_time_in_hours_is_doubted(tmp_path):
    path = written(tmp_path, text(time=TIME / 3600.0))
    (note,) = read_measurement(path).notes
    assert (
        "every 0.278 ms, quicker than cyclers write them; if the time is in another unit: --unit time_s=h, min or d ("
        in note
    )
    profile = written(
        tmp_path, "time_s,current_a\n" + "".join(f"{t / 3600},1\n" for t in TIME), "profile.csv"
    )
    assert any("quicker than cyclers" in one for one in read_current(profile).notes)
    assert not any("quicker" in one for one in read_measurement(path, units={"time_s": "h"}).notes)


def test_a_file_of_json_was_told_of_columns_that_are_none(tmp_path):
    path = written(tmp_path, '\ufeff{"Header": {"BPX": "1.1.0"}}', "cell.bpx.json")
    with pytest.raises(DataError, match=r"cell.bpx.json is JSON, .* a cell's file is given as --cell"):
        read_measurement(path)


def test_a_thermocouple_that_drops_out_is_doubted(tmp_path):
    temperature = np.where((TIME == 50) | (TIME == 120), 0.0, 25.0)
    columns = zip(TIME, CURRENT, VOLTAGE, temperature, strict=True)
    rows = "".join(f"{t},{i},{v},{k}\n" for t, i, v, k in columns)
    (note,) = read_measurement(written(tmp_path, f"{HEADER},temperature_degc\n{rows}")).notes
    assert "goes from 25 to 0 degC within 1 s at row 51 (line 52)" in note
    assert "jumps like it: 4" in note


def test_a_gap_in_a_current_alone_was_crossed_in_silence(tmp_path):
    time = np.where(TIME < 100, TIME, TIME + 14_400.0)
    rows = "\n".join(f"{t},{i}" for t, i in zip(time, CURRENT, strict=True))
    profile = read_current(written(tmp_path, f"time_s,current_a\n{rows}\n"))
    assert [note for note in profile.notes if "No rows for 14401 s from 99 s on" in note]
    corners = written(tmp_path, "time_s,current_a\n0,0\n60,0\n3660,0\n3661,5\n", "corners.csv")
    assert read_current(corners).notes == ()


def test_a_unit_without_its_column_and_words_without_theirs_were_passed_over_in_silence(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text("time_s,current_a,voltage_v,mode\n0,1,4.0,D\n1,1,3.99,D\n2,-1,4.02,C\n3,0,4.0,R\n")
    plain = read_measurement(path)
    assert plain.notes == ()
    said = " ".join(read(path, Reading(units={"temperature_degc": "K"})).notes)
    assert "A unit was declared for temperature_degc (K), and there is no such column" in said
    words = {"D": "discharge"}
    with pytest.raises(DataError, match=r"no column is known .* name it: --state .* There are: .*'mode'"):
        read(path, Reading(state_words=words))
    assert len(read(path, Reading({"state": "mode"}, state_words=words))) == 4


def of_a_slow_discharge(signed, turn=1.0):
    """4 A of discharge and of charge for 100 s each, and then 2,000 s at 0.04 A in rows that are marked as rest."""
    kinds = ["D"] * 100 + ["C"] * 100 + ["R"] * 2000
    current = turn * np.array([4.0] * 100 + [-4.0 if signed else 4.0] * 100 + [0.04] * 2000)
    volts = {"D": 3.6, "C": 3.8, "R": 3.7}
    lines = (
        f"{t},{i},{volts[kind] - 1e-5 * t:.5f},{kind}"
        for t, (i, kind) in enumerate(zip(current, kinds, strict=True))
    )
    return "time_s,current_a,voltage_v,mode\n" + "\n".join(lines) + "\n"


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_a_current_with_a_sign_was_zeroed_in_rows_marked_rest(tmp_path, turn):
    path = written(tmp_path, of_a_slow_discharge(True, turn))
    record = read(path, Reading({"state": "mode"}))
    assert record.current_a[[0, 150, 1000]].tolist() == [4.0, -4.0, 0.04]
    said = " ".join(record.notes)
    assert "In 2,000 rows up to 0.04 A (22.2 mAh in all) flows at rest; it was kept with its own sign" in said


def test_what_was_zeroed_at_rest_was_not_said(tmp_path):
    record = read(written(tmp_path, of_a_slow_discharge(False)), Reading({"state": "mode"}))
    assert record.current_a[[0, 150, 1000]].tolist() == [4.0, -4.0, 0.0]
    said = " ".join(record.notes)
    assert "In 2,000 rows up to 0.04 A (22.2 mAh in all) flows at rest, in no direction that is told" in said


def test_a_column_that_says_another_direction_than_the_current_was_followed_in_silence(tmp_path):
    body = of_a_slow_discharge(True).replace("\n50,4.0,", "\n50,-2.0,")
    record = read(written(tmp_path, body), Reading({"state": "mode"}))
    assert record.current_a[50] == 2.0
    assert "In 1 row up to 2 A (0.556 mAh in all) the column says another direction" in " ".join(record.notes)


@pytest.mark.parametrize("suffix", [".xlsx", ".xls", ".parquet", ".csv.gz"])
def test_text_under_the_name_of_another_format_was_read_without_a_word(tmp_path, suffix):
    named = suffix.removeprefix(".csv")
    (note,) = read_measurement(written(tmp_path, text(), f"drive{suffix}")).notes
    assert f"Its name ends in {named}, but it is text and no " in note
    with pytest.raises(DataError, match=f"its name ends in {named}, but it is text .*: .*\n?"):
        read_measurement(written(tmp_path, "\x00\x01", f"broken{suffix}"))


def test_a_row_without_a_time_was_left_out_as_if_asked(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text("time_s,current_a,voltage_v\n0,1,4.0\n1,1,3.99\n,1,3.98\n3,1,3.97\n4,0,4.0\n")
    with pytest.raises(DataError, match=r"row 3 \(line 4\), column time_s is empty"):
        read_measurement(path, start_s=0.5)


def test_an_open_range_of_cycles_was_taken_for_its_first(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text("time_s,current_a,voltage_v,cycle\n0,1,4.0,1\n1,1,3.9,1\n2,1,3.8,2\n3,0,3.9,2\n")
    with pytest.raises(DataError, match="cycle = '1:' has to be a number, or from:to"):
        read_measurement(path, cycle="1:")
    assert len(read_measurement(path, cycle="1:2")) == 4


def test_a_bad_cell_left_a_thread_behind_that_aborted_the_process(tmp_path, monkeypatch):
    def streamed(*_, **__):
        pytest.fail("a Python file in pyarrow's hands is read ahead in a thread")

    monkeypatch.setattr("pyarrow.PythonFile", streamed)
    with pytest.raises(DataError, match="'OVR'"):
        read_measurement(written(tmp_path, with_line(50, "48.0,5.0,OVR")))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_file_of_many_blocks_is_read_whole(tmp_path, monkeypatch, end):
    monkeypatch.setattr("aesi.data.readers.text.BLOCK_BYTES", 101)
    for packed in (str.encode, lambda content: gzip.compress(content.encode()), lambda c: c.encode("utf-16")):
        data = read_measurement(written(tmp_path, packed(text(end=end))))
        np.testing.assert_array_equal(data.voltage_v, VOLTAGE)
        np.testing.assert_array_equal(data.time_s, TIME)


@pytest.mark.parametrize("pattern", ["%Q", "%", "%d.%d"])
def test_a_pattern_that_is_none_of_a_date_was_an_error_of_python(tmp_path, pattern):
    day = f"{HEADER}\n2024-01-01,1,3.7\n2024-01-02,1,3.6\n"
    message = refusal(tmp_path, day, units={"time_s": pattern})
    assert f"{pattern!r} is no pattern of a date" in message


@pytest.mark.parametrize("kept", ["first", "last"])
def test_rows_of_one_stamp_alone_were_a_record_of_one_row(tmp_path, kept):
    message = refusal(tmp_path, f"{HEADER}\n5,1,3.7\n5,1,3.6\n", duplicates=kept)
    assert "all 2 rows have the stamp 5 s, and a record needs two" in message


def test_a_column_of_cycles_without_a_number_ran_from_nan_to_nan(tmp_path):
    rows = f"{HEADER},cyc\n0,1,3.7,\n1,1,3.6,\n"
    message = refusal(tmp_path, rows, columns={"cycle": "cyc"}, cycle=1)
    assert "column 'cyc' is empty in every row" in message


def test_a_voltage_that_failed_could_not_be_left_out_of_a_current_to_simulate(tmp_path):
    path = written(tmp_path, text(voltage=np.where(TIME < 50, VOLTAGE, np.nan)))
    with pytest.raises(DataError, match="voltage_v is empty or NaN"):
        read_current(path)
    found = read_current(path, Reading({"voltage_v": None}))
    assert found.voltage_v is None
    assert found.current_a.tolist() == CURRENT.tolist()
    assert found.notes == ("drive.csv: voltage_v was left out as asked.",)
    with pytest.raises(DataError, match="voltage_v cannot be left out"):
        read_measurement(path, {"voltage_v": None})


def test_looking_for_gaps_in_a_slowly_sampled_record_took_longer_than_reading_it(calls_of):
    step = np.full(300_000, 10.0)
    step[[0, 5000, 5003, 299_999]] = 200.0
    columns = {"time_s": np.concatenate([[0.0], np.cumsum(step)])}
    assert calls_of(lambda: find_gaps(columns)) < 1000  # not row by row
    assert find_gaps(columns) == [0, 5000, 5003, 299_999]
    assert find_gaps({"time_s": np.array([0.0, 1e6])}) == []


def test_a_charge_that_the_rows_do_not_tell_was_read_without_a_word(tmp_path):
    """Pulses of 10 s every minute, a row at the end of each pulse and of each pause: the current of the row after
    is right, and of straight lines a third flows."""
    ends = np.cumsum(np.tile([50.0, 10.0], 30))
    pulse = np.tile([0.0, 3.0], 30)
    voltage = 3.9 - 1e-5 * ends - 0.03 * pulse
    path = tmp_path / "pulses.csv"
    pd.DataFrame({"time_s": ends, "current_a": pulse, "voltage_v": voltage}).to_csv(path, index=False)
    (told,) = [note for note in read_measurement(path).notes if "do not tell the charge" in note]
    assert (
        "either way 0.25 Ah with the current of the row after, as is assumed unless --hold says otherwise"
        in told
    )
    assert "0.729 Ah with straight lines between the rows, 1.21 Ah with that of the row before" in told
    both = (ends[1::2, None] + [-59.0, -10.0, -9.0, 0.0]).ravel()  # rows before and after each change
    pulse = np.tile([0.0, 0.0, 3.0, 3.0], 30)
    voltage = 3.9 - 1e-5 * both - 0.03 * pulse
    pd.DataFrame({"time_s": both, "current_a": pulse, "voltage_v": voltage}).to_csv(path, index=False)
    assert not any("do not tell the charge" in note for note in read_measurement(path).notes)


@pytest.mark.parametrize("stated", [25, 25.0, np.int64(25), np.float32(25.0), "25"])
def test_a_temperature_as_a_number_of_numpy_ended_in_a_traceback(tmp_path, stated):
    record = read_measurement(written(tmp_path, text()), {"temperature_degc": stated})
    np.testing.assert_array_equal(record.temperature_degc, np.full(N, 25.0))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"columns": {"temperature_degc": True}},
            "the column of temperature_degc is True; give its name as text",
        ),
        (
            {"columns": {"temperature_degc": [25]}},
            "the column of temperature_degc is [25]; give its name as text",
        ),
        ({"columns": ["I"]}, "columns = ['I'] names no quantities; give a dict"),
        ({"units": {"current_a": None}}, "the unit of current_a is None; give it as text"),
        ({"units": "mA"}, "units = 'mA' names no quantities; give a dict"),
        ({"start_s": "10"}, "from '10' s; give a time in seconds"),
        ({"state": 5}, "has no column '5' for state"),
        ({"max_rows": 2.5}, "max_rows = 2.5 is not a whole number"),
        ({"columns": {1: "I"}}, "1 is not a quantity to map. There are time_s"),
    ],
)
def test_an_option_of_another_type_ended_in_a_traceback(tmp_path, options, words):
    with pytest.raises(InputError) as caught:
        read_measurement(written(tmp_path, text()), **options)
    assert words in str(caught.value)


def test_the_advice_to_remove_a_stretch_of_empty_cells_led_to_the_refusal_of_a_gap(tmp_path):
    voltage = np.where((TIME >= 30) & (TIME < 80), np.nan, VOLTAGE)
    message = refusal(tmp_path, text(voltage=voltage))
    assert "or read one side of them: --to-s 29 or --from-s 80" in message
    path = written(tmp_path, text(voltage=voltage))
    assert len(read_measurement(path, stop_s=29.0).time_s) == 30
    assert read_measurement(path, start_s=80.0).time_s[0] == 80.0
    scattered = np.where(TIME % 40 == 7, np.nan, VOLTAGE)
    assert "read one side" not in refusal(tmp_path, text(voltage=scattered))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_line_break_in_a_quoted_name_hid_the_names_of_a_table(tmp_path, separator):
    names = ['"Test\nTime\n(s)"', '"Current\n(A)"', "U"]
    rows = [f"{t}.0{separator}{1.0 if t > 2 else 0.0}{separator}{3.8 - 0.01 * t:.2f}" for t in range(20)]
    path = tmp_path / "excel.csv"
    lines = ['probe of 3" and 4.5"', f'Remark{separator}"of two\nlines"', separator.join(names), *rows]
    path.write_bytes("\r\n".join([*lines, ""]).encode())
    with pytest.raises(DataError, match='--column time_s="Test Time \\(s\\)" --column current_a='):
        read_measurement(path)
    columns = {"time_s": "Test Time (s)", "current_a": "Current\n(A)", "voltage_v": "U"}
    record = read_measurement(path, columns)
    np.testing.assert_array_equal(record.time_s, np.arange(20.0))
    np.testing.assert_allclose(record.voltage_v, 3.8 - 0.01 * np.arange(20.0))


def test_the_names_of_a_sheet_with_line_breaks_could_not_be_given_as_options(tmp_path):
    pd.DataFrame(
        {
            "Zeit\n[s]": np.arange(20.0),
            "Strom\n[A]": [0.0] * 3 + [1.0] * 17,
            "U\n[V]": np.linspace(3.8, 3.6, 20),
        }
    ).to_excel(tmp_path / "sheet.xlsx", index=False)
    columns = {"time_s": "Zeit [s]", "current_a": "Strom [A]", "voltage_v": "U [V]"}
    assert len(read_measurement(tmp_path / "sheet.xlsx", columns)) == 20


@pytest.mark.parametrize(
    ("name", "unit", "sign"),
    [
        ("Amps (chg+)", "", "charge-positive"),
        ("Strom [mA] (Entladen = -)", "mA", "charge-positive"),
        ("I [+ = discharge]", "", "discharge-positive"),
        ("I (charge negative)", "", "discharge-positive"),
        ("I (charge -)", "", "discharge-positive"),
    ],
)
def test_a_direction_in_the_name_of_a_current_was_a_unit_to_declare_and_then_a_wrong_sign(
    tmp_path, name, unit, sign
):
    scale = (-1.0 if sign == "charge-positive" else 1.0) * (1000.0 if unit else 1.0)
    current = scale * np.r_[np.zeros(3), np.ones(17)]
    rows = "".join(f"{t},{i},{3.8 - 0.01 * t:.2f}\n" for t, i in enumerate(current))
    path = written(tmp_path, f"time_s,{name},voltage_v\n{rows}")
    with pytest.raises(DataError) as caught:
        read_measurement(path)
    options = f" --unit current_a={unit}" * bool(unit) + f" --sign {sign}" * (sign == "charge-positive")
    assert f'Say which is meant: --column current_a="{name}"{options}. It has' in str(caught.value)
    columns, units = {"current_a": name}, {"current_a": unit} if unit else None
    if sign == "charge-positive":
        with pytest.raises(
            DataError, match="is positive on charge by its name; declare it: --sign charge-positive"
        ):
            read_measurement(path, columns, units=units)
    record = read_measurement(path, columns, sign if sign == "charge-positive" else None, units=units)
    np.testing.assert_array_equal(record.current_a, np.r_[np.zeros(3), np.ones(17)])


def test_a_channel_is_no_direction(tmp_path):
    rows = "".join(f"{t},{i},{3.8 - 0.01 * t:.2f}\n" for t, i in enumerate([0.0] * 3 + [1.0] * 17))
    path = written(tmp_path, f"time_s,I (channel -1),voltage_v\n{rows}")
    with pytest.raises(DataError, match="'channel -1' in place of a unit"):
        read_measurement(path, {"current_a": "I (channel -1)"})
