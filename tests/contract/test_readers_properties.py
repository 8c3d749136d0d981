"""Readers under random tables: the right numbers, or one DataError; never another error, never a wrong answer."""

import gzip
import os
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aesi.data import read_measurement
from aesi.errors import DataError
from aesi.records import Measurement

QUICK = settings(max_examples=120, deadline=None, suppress_health_check=list(HealthCheck), database=None)
THOROUGH = settings(QUICK, max_examples=10_000)
COLUMNS = ("time_s", "current_a", "voltage_v", "temperature_degc")


@dataclass(frozen=True)
class Sheet:
    """A table as it should come out, and the bytes of one way of writing it."""

    values: dict[str, np.ndarray]
    content: bytes
    lines: list[str]
    encoding: str
    separator: str
    packed: bool


def read(content: bytes, **options) -> Measurement:
    handle, name = tempfile.mkstemp(suffix=".csv")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        with warnings.catch_warnings():
            warnings.simplefilter("error", ResourceWarning)
            return read_measurement(Path(name), **options)
    finally:
        os.unlink(name)


def attempt(content: bytes) -> Measurement | None:
    """The measurement, or None where it was refused in one sentence of bearable length."""
    sentence = ""
    try:
        return read(content)
    except DataError as error:
        sentence = str(error)
    assert sentence
    assert "\n" not in sentence
    assert len(sentence) < 1000
    return None


def columns_of(rng: np.random.Generator, n: int, temperature: bool) -> dict[str, np.ndarray]:
    """A plausible test: uneven stamps, random currents, a voltage with an ohmic drop."""
    time = np.cumsum(rng.uniform(0.5, 1.5, n)) * 10.0 ** rng.integers(-1, 2)
    current = rng.uniform(-10, 10, n)
    voltage = 3.7 - 0.02 * current - 0.1 * np.arange(n) / n
    values = {"time_s": time, "current_a": current, "voltage_v": voltage}
    if temperature:
        values["temperature_degc"] = rng.uniform(20, 30, n)
    return {name: np.round(column, int(rng.integers(5, 10))) for name, column in values.items()}


@st.composite
def sheets(draw) -> Sheet:
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    values = columns_of(rng, draw(st.integers(2, 60)), draw(st.booleans()))
    separator = draw(st.sampled_from([",", ";", "\t", "|"]))
    decimal = draw(st.sampled_from([".", ","])) if separator != "," else "."
    quote = draw(st.sampled_from(["", '"']))
    end = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"]))
    order = draw(st.permutations([*values, "Schritt", "Größe"]))
    lines = [separator.join(f"{quote}{name}{quote}" for name in order)]
    for row in range(len(values["time_s"])):
        cells = [
            repr(float(values[name][row])).replace(".", decimal) if name in values else "Ruhe µ"
            for name in order
        ]
        lines.append(separator.join(cells))
    content = (end.join(lines) + end).encode(encoding)
    packed = draw(st.booleans())
    return Sheet(values, gzip.compress(content) if packed else content, lines, encoding, separator, packed)


def check_right(sheet: Sheet) -> None:
    measurement = read(sheet.content)
    for name in COLUMNS:
        column = getattr(measurement, name)
        if name in sheet.values:
            np.testing.assert_array_equal(column, sheet.values[name])
        else:
            assert column is None


def check_spoiled_cell(sheet: Sheet, data: st.DataObject) -> None:
    """A needed cell replaced by something else is refused by row, or the same number."""
    name = data.draw(st.sampled_from(["time_s", "current_a", "voltage_v"]))
    row = data.draw(st.integers(1, len(sheet.lines) - 1))
    junk = data.draw(
        st.sampled_from(["", "abc", "--", "1.2.3", "1e", "nan", "inf", "0x1F", "1_0", "１２", "99:00"])
    )
    cells = sheet.lines[row].split(sheet.separator)
    place = [cell.strip('"') for cell in sheet.lines[0].split(sheet.separator)].index(name)
    cells[place] = junk
    lines = [*sheet.lines[:row], sheet.separator.join(cells), *sheet.lines[row + 1 :]]
    content = ("\n".join(lines) + "\n").encode("utf-8")
    with pytest.raises(DataError) as caught:
        read(content)
    assert f"row {row} (line {row + 1})" in str(caught.value)
    assert name in str(caught.value)


def check_truncated(sheet: Sheet, data: st.DataObject) -> None:
    """A file cut anywhere is refused, or gives its first rows; only a last line without an end may differ, and a
    note says so."""
    measurement = attempt(sheet.content[: data.draw(st.integers(0, len(sheet.content)))])
    if measurement is None:
        return
    n = len(measurement)
    cut = any("last line does not end" in note for note in measurement.notes)
    sure = n - 1 if cut else n
    for name, column in sheet.values.items():
        np.testing.assert_array_equal(getattr(measurement, name)[:sure], column[:sure])


def check_any_bytes(content: bytes) -> None:
    measurement = attempt(content)
    if measurement is None:
        return
    assert len(measurement) >= 2
    assert np.all(np.diff(measurement.time_s) > 0)
    for column in (measurement.time_s, measurement.current_a, measurement.voltage_v):
        assert np.all(np.isfinite(column))


HEADS = (
    b"",
    b"time_s,current_a,voltage_v\n",
    b"time_s;current_a;voltage_v\r\n",
    b"\x1f\x8b",
    b"PAR1",
    b"\xff\xfe",
)
numbers = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True).map(repr),
    st.integers(-(10**12), 10**12).map(str),
    st.text(max_size=4),
)
any_bytes = st.one_of(
    st.tuples(st.sampled_from(HEADS), st.binary(max_size=300)).map(b"".join),
    st.lists(st.lists(numbers, min_size=2, max_size=4).map(",".join), max_size=8).map(
        lambda rows: (HEADS[1].decode() + "\n".join(rows)).encode("utf-8", "surrogatepass")
    ),
)


@QUICK
@given(sheets())
def test_any_way_of_writing_a_table_gives_its_numbers(sheet):
    check_right(sheet)


@QUICK
@given(sheets(), st.data())
def test_a_spoiled_cell_is_refused_by_row(sheet, data):
    check_spoiled_cell(sheet, data)


@QUICK
@given(sheets(), st.data())
def test_a_truncated_file_never_gives_a_wrong_number_in_silence(sheet, data):
    check_truncated(sheet, data)


@QUICK
@given(any_bytes)
def test_any_bytes_give_a_measurement_or_one_sentence(content):
    check_any_bytes(content)


@pytest.mark.slow
@THOROUGH
@given(sheets(), st.data())
def test_ten_thousand_tables(sheet, data):
    check_right(sheet)
    check_spoiled_cell(sheet, data)
    check_truncated(sheet, data)


@pytest.mark.slow
@THOROUGH
@given(any_bytes)
def test_ten_thousand_heaps_of_bytes(content):
    check_any_bytes(content)
