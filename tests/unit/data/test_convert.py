"""A record written for others and read back is the same record."""

import gzip

import numpy as np
import pytest

from aesi.data import read_measurement
from aesi.data.convert import convert_file, record_lines
from aesi.data.reading import Reading
from aesi.errors import DataError


@pytest.fixture
def source(tmp_path):
    time = np.arange(0.0, 120.0)
    current = np.where((time > 10) & (time < 60), 2.0, np.where(time > 80, -1.0, 0.0))
    table = np.column_stack([time, 1e3 * current, 3.9 - 0.03 * current, np.full(len(time), 24.5)])
    path = tmp_path / "source.csv"
    np.savetxt(path, table, delimiter=",", header="time_s,current_a,voltage_v,temperature_degc", comments="")
    return path


@pytest.mark.parametrize("name", ["out.csv", "out.csv.gz"])
@pytest.mark.parametrize("layout", ["aesi", "bdf"])
def test_a_conversion_and_back_changes_nothing(source, tmp_path, layout, name):
    milli = Reading(units={"current_a": "mA"})
    written = convert_file(source, tmp_path / "new" / name, milli, layout)
    again = read_measurement(tmp_path / "new" / name)
    assert not any("its name ends" in note.lower() for note in again.notes)  # it is what its name says
    np.testing.assert_allclose(again.to_frame(), written.to_frame(), rtol=1e-9)  # ten digits are written
    assert again.current_a.max() == 2.0
    content = (tmp_path / "new" / name).read_bytes()
    header = (gzip.decompress(content) if name.endswith(".gz") else content).decode().splitlines()[0]
    assert header.startswith("time_s,current_a" if layout == "aesi" else "Test Time / s,Voltage / V")


def test_what_a_record_holds_is_told_with_its_charge(source):
    record = convert_file(source, source.with_name("out.csv"))
    # 49 s of 2 kA, in amperes as written, and 38.5 s of 1 kA: rows a second apart are joined by straight lines.
    assert "27.22 Ah discharged, 10.69 Ah charged" in record_lines(record)[1]
    assert record.charge_ah == pytest.approx(27.22 - 10.69, abs=0.01)
    assert "27.22 Ah discharged, 10.83 Ah charged" in record_lines(record.held("backward"))[1]


def test_nothing_was_said_of_the_resistance_where_the_current_has_no_steps(tmp_path):
    path = tmp_path / "steady.csv"
    path.write_text("time_s,current_a,voltage_v\n" + "".join(f"{k},2,{4 - 1e-4 * k}\n" for k in range(100)))
    (line,) = (x for x in record_lines(convert_file(path, tmp_path / "o.csv")) if "not told" in x)
    assert "fewer than 5 steps of the current are clear" in line


def test_a_place_that_cannot_be_written_is_one_sentence(source):
    with pytest.raises(DataError, match="cannot be written"):
        convert_file(source, source / "below.csv")


def test_stamps_since_1970_are_still_told_apart(tmp_path):
    path = tmp_path / "logged.csv"
    time = 1.7e9 + 0.1 * np.arange(50)
    current = np.where(np.arange(50) % 20 < 10, 1.0, 0.0)
    table = np.column_stack([time, current, 4.0 - 0.05 * current])
    np.savetxt(path, table, delimiter=",", header="time_s,current_a,voltage_v", comments="", fmt="%.15g")
    convert_file(path, tmp_path / "out.csv")
    np.testing.assert_allclose(np.diff(read_measurement(tmp_path / "out.csv").time_s), 0.1, atol=1e-4)


def test_a_current_in_kiloamperes_or_c_rates_was_written_without_a_word(tmp_path):
    rng = np.random.default_rng(0)
    time, current = np.arange(0.0, 600.0), np.repeat(rng.normal(1.0, 3.0, 60), 10)
    volts = 3.9 - 0.02 * current - 0.05 * np.cumsum(current) / 3600.0

    def told(scale):
        path = tmp_path / "drive.csv"
        table = np.column_stack([time, scale * current, volts])
        np.savetxt(path, table, delimiter=",", header="time_s,current_a,voltage_v", comments="")
        (line,) = (x for x in record_lines(convert_file(path, tmp_path / "o.csv")) if "Steps" in x)
        return line

    assert told(1.0).startswith("Steps of the current show 20 mohm, as cells of 1 to 45 Ah do; if it is none")
    assert "show 20000 mohm, as cells of 0.001 to 0.045 Ah do" in told(1e-3)
    assert "show 4 mohm, as cells of 5 to 220 Ah do" in told(5.0)  # not 2.2e+02
    assert "show 100 mohm, as cells of 0.2 to 9 Ah do" in told(0.2)
