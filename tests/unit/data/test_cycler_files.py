"""Cyclers' exports and own files: each maker's names, units, preamble, states and sign give the same test.

The files are written here in the layout of real exports; those were read with the same code while it was written.
"""

import sys
import warnings
import zipfile
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from aesi.data import read_measurement
from aesi.data.current import read_current
from aesi.data.read import read
from aesi.data.reading import Reading
from aesi.errors import DataError

N = 90
TIME = np.arange(N) * 10.0
CURRENT = np.repeat([0.0, 2.0, -1.0, 3.0, 0.0, -2.0], 15)
"""A, discharge positive, as every file has to come out."""
VOLTAGE = np.round(3.7 - 0.03 * CURRENT - np.cumsum(CURRENT) * 1e-4, 5)
TEMPERATURE = np.round(25.0 + np.linspace(0.0, 1.0, N), 3)
STEP = np.repeat(np.arange(1, 7), 15)


def clock(seconds: float) -> str:
    """h:m:s with milliseconds."""
    return f"{int(seconds // 3600):02d}:{int(seconds // 60) % 60:02d}:{seconds % 60:06.3f}"


def words(discharge: str, charge: str, rest: str) -> list[str]:
    return [discharge if i > 0 else charge if i < 0 else rest for i in CURRENT]


def rows(*columns, separator: str = ",") -> list[str]:
    return [separator.join(str(cell) for cell in row) for row in zip(*columns, strict=True)]


def arbin() -> tuple[str, bytes]:
    head = "Data_Point,Date_Time,Test_Time(s),Step_Time(s),Step_Index,Cycle_Index,Current(A),Voltage(V),"
    head += "Charge_Capacity(Ah),Aux_Temperature_1(C)"
    stamps = [f"09/20/2024 08:{k // 60:02d}:{k % 60:02d}" for k in range(N)]
    body = rows(
        range(1, N + 1), stamps, TIME, TIME, STEP, STEP // 4, -CURRENT, VOLTAGE, TIME * 0, TEMPERATURE
    )
    return "arbin.csv", "\n".join([head, *body, ""]).encode()


def maccor() -> tuple[str, bytes]:
    lines = ["Today's Date 10/10/2019  Date of Test:\t10/10/2019\t Filename:\tC:\\test.010\tComment: x"]
    lines.append(
        "Rec#\tCyc#\tStep\tTestTime\tStepTime\tAmp-hr\tWatt-hr\tAmps\tVolts\tState\tES\tDPt Time\tTemp 1"
    )
    lines += rows(
        range(1, N + 1), STEP // 4, STEP, [f"0d {clock(t)}" for t in TIME], TIME, TIME * 0, TIME * 0,
        np.abs(CURRENT), VOLTAGE, words("D", "C", "R"), STEP, ["11/02/2019 23:28:51"] * N, TEMPERATURE,
        separator="\t",
    )  # fmt: skip
    return "maccor.010", "\r\n".join([*lines, ""]).encode()


def biologic() -> tuple[str, bytes]:
    lines = ["EC-Lab ASCII FILE", "Nb header lines : 5", "", "Modulo Bat: Temperature max = 70 °C"]
    lines.append("mode\tNs\ttime/s\tEcell/V\t<I>/mA\tTemperature/°C\tcycle number\t")
    body = rows(STEP, STEP, TIME, VOLTAGE, -1e3 * CURRENT, TEMPERATURE, STEP // 4, separator="\t")
    lines += [f"{line}\t".replace(".", ",") for line in body]
    return "biologic.mpt", "\r\n".join([*lines, ""]).encode("latin-1")


def neware() -> tuple[str, bytes]:
    head = "DataPoint,Cycle Index,Step Index,Step Type,Time,Total Time,Current(mA),Voltage(V),Capacity(mAh),T1(℃),Date"
    kinds = words("CC DChg", "CC Chg", "Rest")
    times = [clock(t) for t in TIME]
    dates = ["2024-03-01 12:00:00"] * N
    body = rows(
        range(1, N + 1),
        STEP // 4,
        STEP,
        kinds,
        times,
        times,
        -1e3 * CURRENT,
        VOLTAGE,
        TIME * 0,
        TEMPERATURE,
        dates,
    )
    return "neware.csv", "\n".join([head, *body, ""]).encode("utf-8-sig")


def neware_layers() -> tuple[str, bytes]:
    """Rows of the cycle and of each step above their records; tabs pad the cells."""
    lines = [
        "Cycle Index,Chg. Cap.(Ah),DChg. Cap.(Ah)",
        ",Step Index,Step Type,Step Time",
        ",,DataPoint,Time,Total Time,Current(A),Voltage(V),Capacity(Ah),Date,T1(?)",
        '1,"\t0.1","\t0.2"',
    ]
    body = rows(
        range(1, N + 1), TIME, [clock(t) for t in TIME], -CURRENT, VOLTAGE, TIME * 0,
        ["2026-03-06 12:37:25"] * N, TEMPERATURE,
    )  # fmt: skip
    for k, line in enumerate(body):
        if k % 15 == 0:
            lines.append(f",{k // 15 + 1},Rest,00:10:00")
        lines.append(",," + ",".join(f'"\t{cell}"' for cell in line.split(",")))
    return "neware_layers.csv", "\r\n".join([*lines, ""]).encode("latin-1")


def pec() -> tuple[str, bytes]:
    lines = ["Request Year:,2026", "Test:,25205", "Test Description:,", "#END RESULTS CHECK"]
    lines.append(
        "Test,Cell,Rack,Step,Cycle,Total Time (Seconds),Step Time (Seconds),Voltage (mV),Current (mA),"
        "ReasonCode,Cell surface temperature (°C),"
    )
    lines += rows(
        [187] * N, [1] * N, ["SBT0550"] * N, STEP, STEP // 4, TIME, TIME, 1e3 * VOLTAGE, -1e3 * CURRENT,
        [30] * N, TEMPERATURE, [""] * N,
    )  # fmt: skip
    return "pec.csv", "\n".join([*lines, ""]).encode()


def bitrode() -> tuple[str, bytes]:
    """As of a published test, doi:10.5281/zenodo.2580327; three counters share a name."""
    head = (
        "Exclude,Time(s),Cycle,Loop,Loop,Loop,Step,StepTime(s),Current(A),Voltage(V),Power(W),Capacity(Ah),"
        "Energy(Wh),Mode,Data,Temperature(C)"
    )
    body = rows(
        ["No"] * N, TIME, STEP // 4, [1] * N, [1] * N, [1] * N, STEP, TIME, -CURRENT, VOLTAGE, TIME * 0, TIME * 0,
        TIME * 0, words("DCHG", "CHRG", "REST"), [" "] * N, TEMPERATURE,
    )  # fmt: skip
    return "bitrode.csv", "\r\n".join([head, *body, ""]).encode()


def neware_magnitudes() -> tuple[str, bytes]:
    name, content = neware()
    return name, content.replace(b",-", b",")


def digatron(start_s: float = 0.0) -> tuple[str, bytes]:
    """Blank lines, a block about the test and a line of one NUL stand above the names, each line ends in a comma."""
    lines = [
        "",
        "",
        "Measurement ID,575",
        "Start Time,11/16/2018 6:36:11 PM",
        "OrderNo,",
        "Nominal Voltage, 3.7",
    ]
    lines += ["Maximum Voltage, 4.2", "", "\0"]
    lines.append(
        "Time Stamp,Step,Status,Prog Time,Step Time,Cycle,Cycle Level,Procedure,Voltage,Current,Temperature,Cnt,"
    )
    lines.append(",,,,,,,,[V],[mA],[C],[Cnt],")
    times = [clock(t) for t in start_s + TIME]
    body = rows(
        ["11/17/2018 8:39:30 PM"] * N, STEP, words("DCH", "CHA", "PAU"), times, times, STEP // 4, STEP, ["p"] * N,
        VOLTAGE, -1e3 * CURRENT, TEMPERATURE, STEP,
    )  # fmt: skip
    return "digatron.csv", "\r\n".join([*lines, *[f"{line}," for line in body], ""]).encode()


def basytec() -> tuple[str, bytes]:
    lines = ["~Resultfile from Basytec Battery Test System", "~Battery: cell", "~"]
    lines.append("~Time[h]\tDataSet\tt-Step[h]\tLine\tCommand\tU[V]\tI[A]\tAh[Ah]\tT1[°C]\tCyc-Count\tState")
    body = rows(
        [repr(float(t)) for t in TIME / 3600], range(1, N + 1), TIME / 3600, STEP,
        words("Discharge", "Charge", "Pause"), VOLTAGE, -CURRENT, TIME * 0, TEMPERATURE, STEP // 4, STEP * 0,
        separator="\t",
    )  # fmt: skip
    return "basytec.txt", "\n".join([*lines, *body, ""]).encode("latin-1")


def novonix() -> tuple[str, bytes]:
    lines = ["[Summary]", "Novonix UHPC data file", "Mass (g): 1.000", "[End Summary]", "[Data]"]
    lines.append(
        "Date and Time,Cycle Number,Step Type,Run Time (h),Step Time (h),Current (A),Potential (V),Capacity (Ah),"
        "Temperature (°C),Circuit Temperature (°C),Step Number"
    )
    hours = [repr(float(t)) for t in TIME / 3600]
    stamps = ["2025-07-19 15:26:20"] * N
    body = rows(
        stamps, STEP // 4, STEP, hours, hours, -CURRENT, VOLTAGE, TIME * 0, TEMPERATURE, TEMPERATURE + 1, STEP
    )
    return "novonix.csv", "\n".join([*lines, *body, ""]).encode()


def bdf() -> tuple[str, bytes]:
    head = (
        "Test Time / s,Voltage / V,Current / A,Surface Temperature T1 / degC,Step Index / 1,Cycle Count / 1"
    )
    body = rows(TIME, VOLTAGE, -CURRENT, TEMPERATURE, STEP, STEP // 4)
    return "test.bdf.csv", "\n".join([head, *body, ""]).encode()


def workbook() -> tuple[str, bytes]:
    """Neware's, with a sheet about the test first and clock times as Excel keeps them."""
    import io

    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Start", datetime(2024, 3, 1)])
    sheet = book.create_sheet("record")
    sheet.append(["DataPoint", "Cycle Index", "Step Index", "Step Type", "Time", "Total Time", "Current(A)",
                  "Voltage(V)", "Capacity(Ah)", "T1(°C)"])  # fmt: skip
    kinds = words("CC DChg", "CC Chg", "Rest")
    for k in range(N):
        passed = timedelta(seconds=float(TIME[k]))
        cells = [k + 1, int(STEP[k] // 4), int(STEP[k]), kinds[k], passed, passed, float(-CURRENT[k])]
        sheet.append([*cells, float(VOLTAGE[k]), 0.0, float(TEMPERATURE[k])])
    stream = io.BytesIO()
    book.save(stream)
    return "neware.xlsx", stream.getvalue()


EXPORTS: tuple[Callable[[], tuple[str, bytes]], ...] = (
    arbin, maccor, biologic, neware, neware_layers, neware_magnitudes, digatron, basytec, novonix, pec, bitrode, bdf,
    workbook,
)  # fmt: skip


def written(folder: Path, export: Callable[[], tuple[str, bytes]]) -> Path:
    name, content = export()
    path = folder / name
    path.write_bytes(content)
    return path


def workbook_of(path: Path, sheets: dict[str, Iterable[Sequence]]) -> Path:
    """A workbook with these rows in each sheet."""
    book = pytest.importorskip("openpyxl").Workbook()
    book.remove(book.active)
    for name, lines in sheets.items():
        sheet = book.create_sheet(name)
        for line in lines:
            sheet.append(line)
    book.save(path)
    return path


def test_battery_data_in_hours_and_milliamperes_is_converted_by_its_names(tmp_path):
    path = tmp_path / "bdf.csv"
    lines = ["Test Time / h,Current / mA,Voltage / V", *rows(TIME / 3600.0, -1e3 * CURRENT, VOLTAGE)]
    path.write_text("\n".join([*lines, ""]))
    data = read_measurement(path)
    assert data.time_s == pytest.approx(TIME, abs=1e-6)
    assert data.current_a == pytest.approx(CURRENT)
    assert any("converted from h" in note for note in data.notes)


def test_a_biologic_file_without_a_current_takes_it_from_the_charge(tmp_path, monkeypatch):
    charge = np.concatenate([[0.0], -1e3 * CURRENT[1:] * np.diff(TIME) / 3600.0])
    kinds = [("time/s", float), ("Ewe/V", float), ("dq/mA.h", float), ("Ns", int)]
    stored = np.array(list(zip(TIME, VOLTAGE, charge, STEP, strict=True)), dtype=kinds)
    galvani = SimpleNamespace(BioLogic=SimpleNamespace(MPRfile=lambda path: SimpleNamespace(data=stored)))
    monkeypatch.setitem(sys.modules, "galvani", galvani)
    path = tmp_path / "gcpl.mpr"
    path.write_bytes(b"BIO-LOGIC MODULAR FILE")
    data = read_measurement(path)
    assert data.current_a[1:] == pytest.approx(CURRENT[1:])
    assert any("stores no current" in note for note in data.notes)


def test_a_binary_whose_time_begins_anew_with_each_step_is_put_together(tmp_path, monkeypatch):
    import pandas as pd

    frame = pd.DataFrame(
        {
            "Test Time / s": np.tile(np.arange(15) * 10.0, 6),
            "Current / A": -CURRENT,
            "Voltage / V": VOLTAGE,
            "Step Count / 1": STEP,
            "Cycle Count / 1": 2 * np.pi * (STEP // 4 + 1),
        }
    )
    monkeypatch.setitem(sys.modules, "bdf", SimpleNamespace(read=lambda path, validate: frame))
    path = tmp_path / "test.ndax"
    path.write_bytes(b"PK\x03\x04")
    data = read(path, Reading(duplicates="first"))
    assert data.time_s[-1] == pytest.approx(6 * 140.0)
    assert any("begins anew" in note for note in data.notes)
    assert len(read(path, Reading(cycle="2", duplicates="first"))) == 43  # steps 4 to 6, less one stamp each


def test_the_ends_of_steps_in_a_binary_of_newares_were_refused_as_no_other_exports_are(tmp_path, monkeypatch):
    frame = pd.DataFrame({"Test Time / s": TIME, "Current / A": -CURRENT, "Voltage / V": VOLTAGE})
    frame.loc[15, "Test Time / s"] = TIME[14]
    monkeypatch.setitem(sys.modules, "bdf", SimpleNamespace(read=lambda path, validate: frame))
    path = tmp_path / "test.nda"
    path.write_bytes(b"NEWARE")
    data = read_measurement(path)
    np.testing.assert_allclose(data.current_a, np.delete(CURRENT, 15))
    assert any("1 row was dropped whose stamp is there twice, the first kept" in note for note in data.notes)


def test_an_arbin_export_without_its_points_was_not_known(tmp_path):
    """As MITS Pro writes its workbooks of late, and batteryarchive.org its time series, without steps either."""
    head = "Date_Time,Test_Time (s),Cycle_Index,Current (A),Voltage (V),Charge_Capacity (Ah),"
    head += "Environment_Temperature (C),Cell_Temperature (C)"
    body = rows(["2010-09-02"] * N, TIME, STEP, -CURRENT, VOLTAGE, TIME * 0, TEMPERATURE - 1.0, TEMPERATURE)
    (tmp_path / "archive.csv").write_text("\n".join([head, *body, ""]))
    data = read_measurement(tmp_path / "archive.csv")
    np.testing.assert_allclose(data.current_a, CURRENT)
    np.testing.assert_allclose(data.temperature_degc, TEMPERATURE)


def test_a_digatron_export_was_held_for_binary_by_the_line_above_its_names(tmp_path):
    name, content = digatron(start_s=26.0 * 3600.0)
    path = tmp_path / name
    path.write_bytes(content)
    record = read_measurement(path)
    assert record.time_s == pytest.approx(26.0 * 3600.0 + TIME)
    assert any("Recognised as an export of Digatron" in note for note in record.notes)
    path.write_bytes(content.replace(b"PAU", b"P\0U", 1))
    with pytest.raises(DataError, match="holds binary data"):
        read_measurement(path)


def test_many_sparsely_logged_rests_are_one_note(tmp_path):
    time = np.concatenate([1000.0 * k + np.arange(100.0) for k in range(6)])
    current = np.tile(np.repeat([0.0, 1.0, 0.0], [10, 80, 10]), 6)
    path = tmp_path / "rests.csv"
    path.write_text("\n".join(["time_s,current_a,voltage_v", *rows(time, current, 3.7 - 0.03 * current), ""]))
    notes = [note for note in read_measurement(path).notes if "rested" in note]
    assert notes == ["rests.csv: No rows for 901 s at 5 places, the first at 99 s; the cell rested."]


def test_a_temperature_of_zero_everywhere_is_told_of(tmp_path):
    path = tmp_path / "cold.csv"
    lines = rows(TIME, CURRENT, VOLTAGE, TIME * 0)
    path.write_text("\n".join(["time_s,current_a,voltage_v,temperature_degc", *lines, ""]))
    assert any("no sensor is connected" in note for note in read_measurement(path).notes)


@pytest.mark.parametrize("form", ["h:mm:ss", "[h]:mm:ss"])
@pytest.mark.parametrize("start_d", [0.995, 61.995])
def test_a_time_of_the_day_in_a_sheet_ended_at_24_hours(tmp_path, form, start_d):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["time_s", "current_a", "voltage_v"])
    for row in zip(start_d + TIME / 86400.0, CURRENT.tolist(), VOLTAGE.tolist(), strict=True):
        book.active.append([float(cell) for cell in row])
        book.active.cell(book.active.max_row, 1).number_format = form
    book.save(tmp_path / "long.xlsx")
    record = read_measurement(tmp_path / "long.xlsx", units={"time_s": "h:m:s"})
    np.testing.assert_allclose(record.time_s, 86400.0 * start_d + TIME, atol=1e-3)


def test_of_three_electrodes_the_potential_of_one_was_taken_for_the_voltage_of_the_cell(tmp_path):
    header = "time/s\tEwe/V\tEce/V\t<I>/mA"
    lines = [header, *rows(TIME, VOLTAGE + 0.1, TIME * 0 + 0.1, -1e3 * CURRENT, separator="\t")]
    path = tmp_path / "three.mpt"
    path.write_text("\n".join([*lines, ""]))
    with pytest.raises(
        DataError, match=r"'Ewe/V' and 'Ece/V' are potentials .* --column voltage_v=\"Ewe/V\""
    ):
        read_measurement(path)
    assert read_measurement(path, {"voltage_v": "Ewe/V"}).voltage_v == pytest.approx(VOLTAGE + 0.1)


def test_of_two_columns_of_one_name_in_an_export_the_first_was_taken_without_a_word(tmp_path):
    head, *body = arbin()[1].decode().splitlines()
    lines = ["Voltage(V)," + head, *(f"3.6,{line}" for line in body)]
    (tmp_path / "arbin.csv").write_text("\n".join([*lines, ""]))
    with pytest.raises(
        DataError, match=r"has 2 columns named 'Voltage\(V\)' \(numbers 1, 9\); rename all but one"
    ):
        read_measurement(tmp_path / "arbin.csv")


@pytest.mark.parametrize("above", ["", "Serial,1234\n"], ids=["nothing above", "a line above"])
@pytest.mark.parametrize("mark", [str, lambda k: "!" if k % 7 == 3 else ""], ids=["row numbers", "flags"])
def test_a_first_column_without_a_name_made_layers_of_an_export(tmp_path, above, mark):
    head, *body = arbin()[1].decode().splitlines()
    lines = ["," + head, *(f"{mark(k)},{line}" for k, line in enumerate(body))]
    (tmp_path / "arbin.csv").write_text(above + "\n".join([*lines, ""]))
    record = read_measurement(tmp_path / "arbin.csv")
    np.testing.assert_allclose(record.time_s, TIME)
    np.testing.assert_allclose(record.current_a, CURRENT)
    assert not any("cycles and steps" in note for note in record.notes)


def test_a_first_step_in_the_line_of_its_cycle_hid_the_layers_of_a_report(tmp_path):
    name, content = neware_layers()
    lines = content.decode("latin-1").split("\r\n")
    joined = [*lines[:3], lines[3] + lines[4], *lines[5:]]
    (tmp_path / name).write_text("\r\n".join(joined), encoding="latin-1", newline="")
    record = read_measurement(tmp_path / name)
    np.testing.assert_allclose(record.time_s, TIME)
    np.testing.assert_allclose(record.voltage_v, VOLTAGE)


@pytest.mark.parametrize("export", EXPORTS, ids=lambda export: export.__name__)
def test_every_export_gives_the_same_test(tmp_path, export):
    record = read_measurement(written(tmp_path, export))
    np.testing.assert_allclose(record.time_s, TIME, atol=1e-6)
    np.testing.assert_allclose(record.current_a, CURRENT, atol=1e-9)
    np.testing.assert_allclose(record.voltage_v, VOLTAGE, atol=1e-9)
    assert record.temperature_degc is not None
    np.testing.assert_allclose(record.temperature_degc, TEMPERATURE, atol=1e-9)
    assert any("turned" in note or "sign of the current" in note for note in record.notes)


WITH_STEPS = tuple(
    export for export in EXPORTS if export is not neware_layers
)  # whose steps are rows of their own


@pytest.mark.parametrize("export", WITH_STEPS, ids=lambda export: export.__name__)
def test_a_step_of_every_export_can_be_taken(tmp_path, export):
    record = read_measurement(written(tmp_path, export), step="2:3")
    np.testing.assert_allclose(record.current_a, CURRENT[15:45], atol=1e-9)
    assert len(read_measurement(written(tmp_path, export), cycle=0)) == 45


def test_the_charge_between_the_stretches_of_a_step_is_told(tmp_path):
    step = np.tile(np.repeat([1, 2], 10), 60)
    pulses = pd.DataFrame({"time_s": np.arange(1200.0), "current_a": np.where(step == 2, 3.6, 0.0)})
    pulses["voltage_v"], pulses["step"] = np.linspace(4.0, 3.9, 1200) - 0.05 * (step == 2), step
    pulses.to_csv(tmp_path / "pulses.csv", index=False)
    rests = read_measurement(tmp_path / "pulses.csv", step=1)
    assert any("60 stretches" in note and " 0.59 Ah that the rows between" in note for note in rests.notes)
    assert not any(
        "stretches" in note for note in read_measurement(tmp_path / "pulses.csv", step="1:2").notes
    )


def test_the_battery_data_alliance_reads_the_same(tmp_path):
    """Voltage and current of BaSyTec's layout; batterydf 0.1 leaves Neware's mA as they are and turns hours twice."""
    reader = pytest.importorskip("bdf")
    path = written(tmp_path, basytec)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        frame = reader.read(path, validate=False)
    record = read_measurement(path)
    np.testing.assert_allclose(record.voltage_v, frame["Voltage / V"].to_numpy(dtype=float), atol=1e-9)
    np.testing.assert_allclose(record.current_a, -frame["Current / A"].to_numpy(dtype=float), atol=1e-9)


def test_two_rows_at_a_change_of_step_are_one(tmp_path):
    name, content = arbin()
    lines = content.decode().split("\n")
    doubled = [*lines[:16], lines[16].replace("150.0,", "140.0,"), *lines[16:]]
    path = tmp_path / name
    path.write_text("\n".join(doubled))
    record = read_measurement(path)
    assert len(record) == N
    assert any("1 row was dropped" in note for note in record.notes)
    with pytest.raises(DataError, match="--duplicates"):
        read_measurement(path, duplicates="refuse")


def test_magnitudes_that_nothing_turns_are_told_and_the_state_turns_them(tmp_path):
    path = tmp_path / "plain.csv"
    head = "time_s,current_a,voltage_v,Richtung"
    long = np.repeat([1.0, -1.0], 60)
    voltage = np.concatenate([np.linspace(4.0, 3.2, 60), np.linspace(3.2, 4.0, 60)])
    kinds = ["E" if i > 0 else "L" for i in long]
    path.write_text("\n".join([head, *rows(60.0 * np.arange(120), np.abs(long), voltage, kinds), ""]))
    with pytest.raises(DataError, match=r"holds magnitudes.*--state"):
        read_measurement(path)
    with pytest.raises(DataError, match=r"row 1 \(line 2\): .*--state-word E=charge or E=discharge"):
        read_measurement(path, state="Richtung")
    said = Reading({"state": "Richtung"}, state_words={"E": "discharge", "L": "charge"})
    np.testing.assert_allclose(read(path, said).current_a, long)
    assert not any("was declared" in note for note in read(path, said).notes)


def test_a_sign_beside_a_column_of_states_had_no_effect_and_nothing_said_so(tmp_path):
    path = tmp_path / "plain.csv"
    body = rows(TIME, np.abs(CURRENT), VOLTAGE, words("D", "C", "R"))
    path.write_text("\n".join(["time_s,current_a,voltage_v,State", *body, ""]))
    record = read_measurement(path, state="State", sign="charge-positive")
    np.testing.assert_allclose(record.current_a, CURRENT)
    told = "declared charge-positive, and column 'State' says which way it flows: the column was followed."
    assert any(told in note for note in record.notes)


@pytest.mark.parametrize(
    ("cells", "unit"),
    [
        ([clock(t) for t in TIME], "h:m:s"),
        ([f"2024-05-31 12:{int(t) // 60:02d}:{int(t) % 60:02d}" for t in TIME], "date"),
        ([f"31.05.2024 12:{int(t) // 60:02d}:{int(t) % 60:02d}" for t in TIME], "%d.%m.%Y %H:%M:%S"),
        ([f"{t / 60!r}" for t in TIME.tolist()], "min"),
        ([f"{t * 1e3!r}" for t in TIME.tolist()], "ms"),
    ],
)
def test_times_are_read_as_they_are_declared(tmp_path, cells, unit):
    path = tmp_path / "logger.csv"
    body = rows(cells, 1e3 * CURRENT, 1e3 * VOLTAGE, 273.15 + TEMPERATURE)
    path.write_text("\n".join(["t,i,u,temp", *body, ""]))
    columns = {"time_s": "t", "current_a": "i", "voltage_v": "u", "temperature_degc": "temp"}
    declared = {"time_s": unit, "current_a": "mA", "voltage_v": "mV", "temperature_degc": "K"}
    record = read_measurement(path, columns, units=declared)
    np.testing.assert_allclose(record.time_s, TIME, atol=1e-6)
    np.testing.assert_allclose(record.current_a, CURRENT, atol=1e-9)
    np.testing.assert_allclose(record.voltage_v, VOLTAGE, atol=1e-9)
    np.testing.assert_allclose(record.temperature_degc, TEMPERATURE, atol=1e-9)


def test_a_time_that_is_no_clock_time_is_named(tmp_path):
    path = tmp_path / "logger.csv"
    path.write_text("time_s,current_a,voltage_v\n00:00:01,1.0,3.7\n00:00:xx,1.0,3.7\n00:00:03,1,3.7\n")
    with pytest.raises(DataError, match=r"row 2 \(line 3\).*'00:00:xx'.*time_s=s \(or min, h, "):
        read_measurement(path, units={"time_s": "h:m:s"})
    with pytest.raises(DataError, match="--unit time_s=h:m:s"):
        read_measurement(path)


def test_a_time_in_milliseconds_spelt_out_was_proposed_in_seconds(tmp_path):
    (tmp_path / "bdf.csv").write_text(
        "test_time_millisecond,current_ampere,voltage_volt\n0,1,3.7\n1000,1,3.6\n"
    )
    with pytest.raises(DataError, match=r'--column time_s="test_time_millisecond" --unit time_s=ms\. It has'):
        read_measurement(tmp_path / "bdf.csv")


def test_an_unknown_unit_names_those_that_there_are(tmp_path):
    path = tmp_path / "logger.csv"
    path.write_text("time_s,current_a,voltage_v\n0,1.0,3.7\n1,1.0,3.7\n")
    with pytest.raises(DataError, match="A, mA, uA, kA"):
        read_measurement(path, units={"current_a": "miles"})


def test_a_table_below_other_lines_is_found_by_the_names_given(tmp_path):
    path = tmp_path / "logger.csv"
    path.write_text("Bench 7, cell 12\nstarted,today\n\nZeit;Strom;Spannung\n0;1,0;3,7\n1;1,0;3,69\n")
    columns = {"time_s": "Zeit", "current_a": "Strom", "voltage_v": "Spannung"}
    record = read_measurement(path, columns)
    np.testing.assert_allclose(record.voltage_v, [3.7, 3.69])
    assert any("3 lines before the header" in note for note in record.notes)


def test_a_temperature_under_another_name_is_not_dropped_in_silence(tmp_path):
    path = tmp_path / "logger.csv"
    body = rows(TIME, CURRENT, VOLTAGE, TEMPERATURE)
    path.write_text("\n".join(["time_s,current_a,voltage_v,Cell Temp (°C)", *body, ""]), encoding="utf-8")
    notes = read_measurement(path).notes
    assert any('--column temperature_degc="Cell Temp (°C)"' in note for note in notes)
    assert not read_measurement(path, {"temperature_degc": None}).notes[0].endswith("is not used;")


def test_all_that_is_missing_is_said_at_once_with_the_right_names(tmp_path):
    path = tmp_path / "logger.csv"
    path.write_text(
        "Timestamp,Step Time (s),Test Time (min),I limit (A),Cell current (mA),U (V)\n1,2,3,4,5,6\n1,2,3,4,5,6\n"
    )
    with pytest.raises(DataError) as caught:
        read_measurement(path)
    message = str(caught.value)
    assert '--column time_s="Test Time (min)" --unit time_s=min' in message
    assert '--column current_a="Cell current (mA)" --unit current_a=mA' in message
    assert '--column voltage_v="U (V)"' in message


def test_the_names_below_a_block_about_the_test_were_not_proposed(tmp_path):
    """Decimal commas outnumber the semicolons of the rows."""
    path = tmp_path / "logger.csv"
    path.write_text(
        "Cell: 12\nDate;12.3.2024\n\nZeit [min];Strom [mA];Spannung [V];Temp.\n"
        "0,0;-1,5;3,70;25,0\n0,5;-1,5;3,71;25,0\n"
    )
    with pytest.raises(DataError) as caught:
        read_measurement(path)
    message = str(caught.value)
    assert '--column time_s="Zeit [min]" --unit time_s=min --column current_a="Strom [mA]"' in message
    assert "'Temp.'" in message


def test_the_names_of_a_sheet_were_not_proposed(tmp_path):
    record = [["Elapsed (s)", "Current (A)", "U (V)"], [0, 1.0, 3.7], [1, 1.0, 3.69]]
    path = workbook_of(tmp_path / "logger.xlsx", {"Sheet": [["Bench 7"]], "Record": record})
    with pytest.raises(DataError, match=r'--column time_s="Elapsed .s." --column current_a="Current .A."'):
        read_measurement(path)


def test_the_names_of_a_sheet_of_sums_were_proposed_before_those_of_the_records(tmp_path):
    sums = [["Cycle", "PlatTimeD/Sec", "MedVoltD/V"], [1, 0, 3.7], [2, 0, 3.6]]
    record = [["Elapsed (s)", "Current (A)", "U (V)"], *([k, 1.0, 3.7] for k in range(9))]
    path = workbook_of(tmp_path / "logger.xlsx", {"Sheet": sums, "Record": record})
    with pytest.raises(DataError, match=r'--column time_s="Elapsed .s." --column current_a="Current .A."'):
        read_measurement(path)


def test_a_zip_archive_of_a_record_was_taken_for_a_workbook(tmp_path):
    with zipfile.ZipFile(tmp_path / "cell7.zip", "w") as archive:
        archive.writestr("cell7.csv", "time_s,current_a,voltage_v\n0,1,3.7\n1,1,3.69\n")
    with pytest.raises(DataError, match=r"is a zip archive \(cell7.csv\); unpack it, and give a file of it"):
        read_measurement(tmp_path / "cell7.zip")


def test_magnitudes_beside_the_words_of_both_directions_were_read_as_a_discharge(tmp_path):
    path = tmp_path / "profile.csv"
    body = rows(TIME, np.abs(CURRENT), words("Entladen", "Laden", "Pause"))
    path.write_text("\n".join(["time_s,current_a,Mode", *body, ""]), encoding="utf-8")
    with pytest.raises(DataError, match=r'.Mode. has the cell charged and discharged: .* --state "Mode"'):
        read_current(path)
    np.testing.assert_allclose(read_current(path, Reading({"state": "Mode"})).current_a, CURRENT)
    np.testing.assert_allclose(read_current(path, Reading({"state": None})).current_a, np.abs(CURRENT))


def test_words_that_say_one_direction_alone_leave_a_discharge_what_it_is(tmp_path):
    path = tmp_path / "profile.csv"
    body = rows(TIME, np.abs(CURRENT), words("DChg", "DChg", "Rest"))
    path.write_text("\n".join(["time_s,current_a,Mode", *body, ""]), encoding="utf-8")
    np.testing.assert_allclose(read_current(path).current_a, np.abs(CURRENT))


def test_a_unit_in_a_cell_is_told_where_it_belongs(tmp_path):
    path = tmp_path / "logger.csv"
    path.write_text("time_s,current_a,voltage_v\n0,1.0 A,3.7\n1,1.0 A,3.69\n")
    with pytest.raises(DataError, match=r"'1.0 A', which is not a number: write numbers alone, and the unit"):
        read_measurement(path)


@pytest.mark.parametrize(
    ("name", "module", "package"),
    [
        ("test.ndax", "bdf", "batterydf"),
        ("test.mpr", "galvani", "galvani"),
        ("test.xlsx", "openpyxl", "openpyxl"),
    ],
)
def test_without_the_reader_it_says_what_to_install(tmp_path, monkeypatch, name, module, package):
    path = tmp_path / name
    path.write_bytes((b"BIO-LOGIC MODULAR FILE" if module == "galvani" else b"PK\x03\x04") + b"x" * 50)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(DataError, match=f"pip install {package}"):
        read_measurement(path)


@pytest.mark.parametrize(
    ("name", "module"), [("test.ndax", "bdf"), ("test.mpr", "galvani"), ("test.xlsx", "openpyxl")]
)
def test_a_damaged_file_is_one_sentence(tmp_path, name, module):
    pytest.importorskip(module)
    path = tmp_path / name
    path.write_bytes(b"PK\x03\x04 nothing of the kind")
    with pytest.raises(DataError, match=name.replace(".", r"\.")) as caught:
        read_measurement(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [bytes(range(256)), b"EC-Lab ASCII FILE\n", b"BIO"])
@pytest.mark.parametrize("module", ["galvani", None])
def test_a_wrong_beginning_of_a_biologic_file_was_told_in_the_words_of_galvani(
    tmp_path, monkeypatch, content, module
):
    if module is None:
        monkeypatch.setitem(sys.modules, "galvani", None)
    path = tmp_path / "test.mpr"
    path.write_bytes(content)
    with pytest.raises(DataError) as caught:
        read_measurement(path)
    assert str(caught.value) == (
        "test.mpr does not begin as BioLogic's .mpr files do; copy it again from the cycler's computer, or give it the "
        "ending of the kind of file that it is (.mpt for EC-Lab's text)."
    )


@pytest.mark.parametrize("name", ["cell.nda", "cell.ndax"])
def test_a_damaged_file_of_newares_was_told_by_a_log_and_a_list_of_readers_that_was_cut_short(
    tmp_path, caplog, name
):
    pytest.importorskip("bdf")
    path = tmp_path / name
    path.write_bytes(b"abc")
    with pytest.raises(DataError) as caught:
        read_measurement(path)
    told = str(caught.value)
    assert told.startswith(f"{name} cannot be read by batterydf: ")
    assert told.endswith("; copy it again, or export the test as CSV.")
    assert "ImportError" not in told
    assert not caplog.records


def test_an_empty_current_of_a_resting_row_is_refused_not_taken_for_none(tmp_path):
    path = tmp_path / "rest.csv"
    path.write_text("time_s,current_a,voltage_v,State\n0,1,4,D\n1,1,3.99,D\n2,,4,R\n3,1,3.98,D\n")
    with pytest.raises(DataError, match=r"row 3 \(line 4\), column current_a is empty"):
        read_measurement(path, state="State")


def test_dates_over_a_change_to_summer_time_run_on(tmp_path):
    path = tmp_path / "night.csv"
    path.write_text(
        "time_s,current_a,voltage_v\n2024-03-31T01:59:59+01:00,1,4\n2024-03-31T03:00:00+02:00,1,3.99\n"
        "2024-03-31T03:00:01+02:00,1,3.98\n"
    )
    np.testing.assert_allclose(read_measurement(path, units={"time_s": "date"}).time_s, [0.0, 1.0, 2.0])


def test_blank_rows_of_a_sheet_count_where_a_row_is_named(tmp_path):
    lines = [["time_s", "current_a", "voltage_v"], [0, 1, 4.0], [None], [None], [1, "one", 3.9]]
    path = workbook_of(tmp_path / "gaps.xlsx", {"Sheet": lines})
    with pytest.raises(DataError, match=r"row 2 \(row 5 of the sheet\): column 'current_a' holds 'one'"):
        read_measurement(path)


def test_a_test_that_goes_on_in_another_sheet_lost_it_without_a_word(tmp_path):
    lines = [[float(k), 1.0, 3.7 - 1e-4 * k] for k in range(100)]
    head = ["time_s", "current_a", "voltage_v"]
    sheets = {"Sheet": [], "Channel_1-1": [head, *lines[:50]], "Channel_1-2": [head, *lines[50:]]}
    notes = read_measurement(workbook_of(tmp_path / "long.xlsx", sheets)).notes
    assert notes[0].endswith("Read from the sheet 'Channel_1-1'.")
    assert "Not read: 'Channel_1-2', with the same columns" in notes[1]


def test_a_sheet_with_a_number_that_no_float_holds_ended_in_an_overflow(tmp_path):
    lines = np.column_stack([TIME, CURRENT, VOLTAGE]).tolist()
    lines[40][1] = 777777
    sheets = {"Sheet": [["time_s", "current_a", "voltage_v"], *lines]}
    workbook_of(tmp_path / "plain.xlsx", sheets)
    # As another program may write it: openpyxl reads such a cell, and does not write it.
    with zipfile.ZipFile(tmp_path / "plain.xlsx") as plain, zipfile.ZipFile(tmp_path / "a.xlsx", "w") as book:
        for name in plain.namelist():
            book.writestr(name, plain.read(name).replace(b">777777<", b">1" + 400 * b"0" + b"<"))
    with pytest.raises(
        DataError,
        match=r"a\.xlsx, row 41 \(row 42 .*'current_a' holds a whole number of more than 308 digits; remove",
    ):
        read_measurement(tmp_path / "a.xlsx")


def test_a_workbook_under_the_name_of_a_text_file_was_refused_by_that(tmp_path):
    pytest.importorskip("openpyxl")
    frame = pd.DataFrame({"time_s": TIME, "current_a": CURRENT, "voltage_v": VOLTAGE})
    frame.to_excel(tmp_path / "a.xlsx", index=False)
    (tmp_path / "a.xlsx").rename(tmp_path / "a.csv")
    assert read_measurement(tmp_path / "a.csv").voltage_v == pytest.approx(VOLTAGE, abs=1e-12)
