"""MATLAB files: a structure of vectors is a table, and what is none, or several, is one sentence."""

import numpy as np
import pytest
from scipy.io import savemat

from aesi.data import read_measurement
from aesi.data.readers import open_table
from aesi.errors import DataError

TIME = np.arange(100.0)
CURRENT = np.repeat([0.0, 1.0, -1.0, 0.0], 25)
"""A, discharge positive."""
VOLTAGE = 3.7 - 0.05 * CURRENT - 1e-4 * np.cumsum(CURRENT)
MEAS = {
    "TimeStamp": np.array([f"6/7/2017 12:29:{k % 60:02d} PM" for k in range(100)], dtype=object),
    "Voltage": VOLTAGE,
    "Current": -CURRENT,
    "Ah": -np.cumsum(CURRENT) / 3600.0,
    "Battery_Temp_degC": 25.0 + TIME / 100.0,
    "Time": TIME,
    "Chamber_Temp_degC": np.full(100, np.nan),
}
"""As in Kollmeyer's set of the Panasonic 18650PF."""


@pytest.fixture
def file(tmp_path):
    def write(content, **options):
        savemat(tmp_path / "test.mat", content, **options)
        return tmp_path / "test.mat"

    return write


def refusal(path, **reading):
    with pytest.raises(DataError) as caught:
        read_measurement(path, **reading)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("column", [False, True])
def test_a_published_structure_is_read_as_it_is(file, column):
    record = read_measurement(file({"meas": MEAS, "Comment": "fresh"}, oned_as="column" if column else "row"))
    np.testing.assert_array_equal(record.time_s, TIME)
    np.testing.assert_array_equal(record.current_a, CURRENT)
    np.testing.assert_array_equal(record.voltage_v, VOLTAGE)
    np.testing.assert_array_equal(record.temperature_degc, MEAS["Battery_Temp_degC"])
    assert record.name == "test"
    assert record.notes[0] == "test.mat: Read from the structure 'meas'."
    assert any("Recognised as an export of Kollmeyer" in note for note in record.notes)


@pytest.mark.parametrize("version", ["4", "5"])
def test_vectors_by_themselves_are_a_table_and_what_is_none_is_told(file, version):
    content = {"time_s": TIME, "current_a": CURRENT, "voltage_v": VOLTAGE, "rate_hz": 1.0}
    record = read_measurement(file(content, format=version))
    np.testing.assert_array_equal(record.current_a, CURRENT)
    assert record.notes == ("test.mat: Not read, for they are no vectors: 'rate_hz'.",)


def test_cells_of_words_are_a_column(file):
    table = open_table(file({"meas": MEAS}))
    place = table.header.index("TimeStamp")
    assert table.read_text((place,))[0][:2] == ["6/7/2017 12:29:00 PM", "6/7/2017 12:29:01 PM"]


def test_of_several_structures_one_is_chosen_by_a_column(file):
    path = file({"first": MEAS, "second": {**MEAS, "Voltage": VOLTAGE + 0.1}})
    message = refusal(path)
    assert "holds 2 tables, the structures 'first', 'second'" in message
    assert '--column time_s="first.NAME"' in message
    record = read_measurement(path, columns={"time_s": "second.Time"})
    np.testing.assert_array_equal(record.voltage_v, VOLTAGE + 0.1)
    np.testing.assert_array_equal(record.current_a, CURRENT)
    both = {"time_s": "second.Time", "voltage_v": "first.Voltage"}
    assert "holds 2 tables" in refusal(path, columns=both)


def test_vectors_that_are_not_equally_long_are_named(file):
    message = refusal(file({"meas": {**MEAS, "Current": -CURRENT[:-1]}}))
    assert "the vectors of 'meas' are not equally long ('TimeStamp' has 100 rows, 'Current' 99)" in message


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ({"data": np.ones((9, 3))}, "(it has 'data')"),
        ({"many": [MEAS, MEAS]}, "(it has 'many')"),
        ({}, "no variable"),
    ],
)
def test_a_file_without_a_table_says_what_it_has(file, content, told):
    message = refusal(file(content))
    assert "holds no table" in message
    assert told in message
    assert "table2struct" in message


def test_a_structure_of_one_row_has_too_few_of_them(file):
    row = {name: values[0] for name, values in MEAS.items() if name != "TimeStamp"}
    assert "too few rows" in refusal(file({"meas": row}))


def test_version_7_3_is_told_how_to_be_saved_again(tmp_path):
    path = tmp_path / "new.mat"
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM"
    path.write_bytes(head.ljust(512, b"\0") + b"\x89HDF\r\n\x1a\n")
    assert (
        "version 7.3 (HDF5), which is not read; save it again in MATLAB by save(FILE, ..., '-v7')"
        in refusal(path)
    )


def test_a_damaged_file_and_a_text_under_the_name_of_one(file, tmp_path):
    path = file({"meas": MEAS})
    path.write_bytes(path.read_bytes()[:2000])
    assert "is damaged or no MATLAB file" in refusal(path)
    path.write_text("time_s,current_a,voltage_v\n0,0,3.7\n1,1,3.6\n2,0,3.7\n")
    assert "but it is text and no MATLAB file; read as text" in read_measurement(path).notes[0]
