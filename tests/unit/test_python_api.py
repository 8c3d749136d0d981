"""`import aesi` at a prompt: what it offers, what it shows, and what it says of what cannot be meant."""

from dataclasses import dataclass, replace
from datetime import date
from functools import partial
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pandas as pd
import pytest

import aesi
from aesi.calibration import calibrate as fit_cell
from aesi.data.read import examined
from aesi.data.spectra import read_spectra
from aesi.errors import AesiError, CellError, DataError, InputError
from aesi.physics import initial_state
from aesi.physics.effects import CATALOGUE
from aesi.records import Spectrum

CELL = Path(__file__).resolve().parents[2] / "experiments" / "cells" / "nmc_30ah.bpx.json"
TIME = np.arange(1800.0)
SOC0 = 0.8


@pytest.fixture(scope="module")
def cell():
    return aesi.Cell.from_bpx(CELL)


@pytest.fixture(scope="module")
def current():
    held = np.repeat(np.random.default_rng(0).normal(10.0, 30.0, len(TIME) // 20), 20)
    held[:60] = 0.0
    return held


@pytest.fixture(scope="module")
def run(cell, current):
    return aesi.simulate(cell, TIME, current, SOC0)


@pytest.fixture(scope="module")
def record(cell, current):
    worse = aesi.simulate(
        cell, TIME, current, SOC0, [CATALOGUE["series_resistance"].activate(resistance_ohm=1e-3)]
    )
    noise = 1e-3 * np.random.default_rng(1).normal(size=len(TIME))
    return aesi.Measurement(TIME, current, worse.voltage_v + noise, np.full(len(TIME), 25.0), name="drive")


def test_dir_shows_the_api():
    assert set(dir(aesi)) == {*aesi.__all__, "__version__"}
    assert all(callable(getattr(aesi, name)) for name in aesi.__all__)


def test_a_run_is_short_in_words_and_whole_in_a_table_and_a_plot(run):
    assert repr(run).startswith("Run(1,800 rows over 1,799 s, ")
    frame = run.to_frame()
    assert list(frame.columns[:3]) == ["time_s", "current_a", "voltage_v"]
    assert set(run.states.columns) < set(frame.columns)
    assert len(frame) == len(run)
    assert [axis.title.text for axis in run.plot().select_yaxes()] == [
        "voltage, V",
        "current, A",
        "state of charge",
    ]


def test_a_measurement_has_its_temperature_where_it_was_measured(record):
    assert repr(record) == "Measurement('drive', 1,800 rows over 1,799 s, with temperature)"
    assert list(record.to_frame().columns) == ["time_s", "current_a", "voltage_v", "temperature_degc"]
    assert len(record.plot().data) == 3
    bare = aesi.Measurement(record.time_s, record.current_a, record.voltage_v)
    assert list(bare.to_frame().columns) == ["time_s", "current_a", "voltage_v"]
    assert len(bare.plot().data) == 2
    assert repr(bare.take(slice(0, 0))) == "Measurement('measurement', no rows)"


@pytest.mark.parametrize(("hold", "shape"), [("backward", "vh"), ("linear", "linear")])
def test_a_current_that_rows_hold_was_drawn_in_straight_lines(cell, record, hold, shape):
    run = aesi.simulate(cell, record.time_s, record.current_a, SOC0, hold=hold)
    for figure, first in ((record.held(hold).plot(), "measured"), (run.plot(), "simulated")):
        lines = {line.name: line.line.shape for line in figure.data}
        assert (lines["current"], lines[first]) == (shape, "linear")


def test_a_spectrum_is_short_in_words_and_whole_in_a_table():
    spectrum = Spectrum(
        "S1", np.array([1000.0, 1.0, 0.1]), np.array([0.01, 0.02 - 0.01j, 0.03 - 0.005j]), soc=0.5
    )
    assert repr(spectrum) == "Spectrum('S1', 3 points, 0.1 to 1e+03 Hz)"
    assert spectrum.to_frame().z_imag_ohm.tolist() == [0.0, -0.01, -0.005]


def test_a_model_and_its_prediction_are_short_in_words(cell, record):
    effect = CATALOGUE["series_resistance"].activate(resistance_ohm=1e-3)
    model = aesi.HybridModel(cell, (effect,), soc0=SOC0)
    assert repr(cell) == f"Cell({cell.name!r}, 30 Ah, {cell.lower_voltage_v:g} to {cell.upper_voltage_v:g} V)"
    assert repr(model) == f"HybridModel(cell {cell.name!r}, series_resistance(resistance_ohm=0.001))"
    prediction = model.predict(record.time_s, record.current_a)
    assert len(repr(prediction)) < 100
    assert "no band" in repr(prediction)
    assert "97.5 % band" in repr(replace(prediction, nominal=0.975))
    assert {trace.name for trace in prediction.plot().data} == {
        "predicted",
        "physics alone",
        "state of charge",
    }


def test_a_long_test_is_drawn_in_hours(record):
    slow = aesi.Measurement(60.0 * TIME, record.current_a, record.voltage_v)
    assert list(slow.plot().select_xaxes())[-1].title.text == "time, h"
    assert slow.plot().data[0].x[-1] == pytest.approx(1799 / 60)


def test_a_discovery_in_python_could_not_be_asked_for_some_effects_alone(cell, record):
    found = aesi.discover(cell, record, soc0=SOC0, only="series_resistance")
    assert found.content["tried"] == ["series_resistance"]
    assert any(note.startswith("tried alone: series_resistance;") for note in found.notes)


def test_a_discovery_takes_records_and_gives_table_plot_and_model(cell, record, tmp_path, monkeypatch):
    few = {name: CATALOGUE[name] for name in ("series_resistance", "voltage_sensor_offset")}
    monkeypatch.setattr("aesi.pipeline.discovery.discover.known_effects", lambda files: few)
    found = aesi.discover(cell, record, soc0=SOC0)
    assert found.effects == ("series_resistance",)
    assert repr(found).startswith("Finding(found series_resistance, ")
    assert found.rmse_mv("after") < 1.2 < found.rmse_mv("before")
    frame = found.to_frame()
    assert frame.score.is_monotonic_decreasing
    (named,) = frame[frame.effect == "series_resistance"].itertuples()
    assert (named.parameter, named.unit) == ("resistance_ohm", "ohm")
    assert named.low <= 1e-3 <= named.high
    assert {trace.name for trace in found.plot("test").data} >= {"measured", "after", "as declared"}
    for wrong in (lambda: found.rmse_mv("declared"), lambda: found.rmse_mv(part="valid")):
        with pytest.raises(InputError, match=r"'(declared|valid)' is not known; give '"):
            wrong()
    with pytest.raises(InputError, match="part = 'valid' is not known; give 'fit' or 'test'"):
        found.plot("valid")  # a sentence on nothing held out before
    assert found.model.cell.contact_resistance_ohm == pytest.approx(1e-3, rel=0.01), "a cell file can hold it"
    assert found.model.hold is None, "nobody declared one: the rows of the next record tell it"
    folder = found.save(tmp_path / "found")
    assert {path.name for path in folder.iterdir()} == {"discovery.json", "report.html", "model"}
    whole = aesi.discover(cell, record, soc0=SOC0, holdout=0.0, only=["series_resistance"])
    assert whole.content["candidates"][0]["test_rmse_mv"] is None
    with pytest.raises(InputError, match="no test part to plot; give part='fit'"):
        whole.plot()
    assert found.warnings == ()
    assert "tracking store" not in (folder / "report.html").read_text()


def test_what_a_file_is_refused_for_was_fitted_from_arrays(cell, record):
    late = (record.time_s < 600.0) | (record.time_s > 900.0)
    bare = aesi.Measurement(record.time_s, record.current_a, record.voltage_v, name="arrays")
    with pytest.raises(DataError, match="arrays, row 601, column time_s: a gap of 302 s after 599 s"):
        aesi.calibrate(cell, bare.take(late))
    with pytest.raises(DataError, match="contradicts the one declared; turn it"):
        aesi.discover(cell, aesi.Measurement(record.time_s, -record.current_a, record.voltage_v))


def test_rows_that_were_changed_after_they_were_read_were_not_examined(cell, record, tmp_path):
    record.to_frame().to_csv(tmp_path / "drive.csv", index=False)
    read = aesi.read_measurement(tmp_path / "drive.csv")
    assert read.was_examined
    assert read.held("linear").was_examined
    late = (record.time_s < 600.0) | (record.time_s > 900.0)
    changed = {
        "contradicts the one declared; turn it": replace(read, current_a=-read.current_a),
        "drive, row 601, column time_s: a gap of 302 s": read.take(late),
        "is plainly in mV": replace(read, voltage_v=1e3 * read.voltage_v),
    }
    for sentence, other in changed.items():
        assert not other.was_examined
        with pytest.raises(DataError, match=sentence):
            aesi.calibrate(cell, other)
    read.current_a[:] *= -1.0
    with pytest.raises(DataError, match="contradicts the one declared"):
        aesi.calibrate(cell, read)


def test_what_a_reader_doubted_is_told_once_of_a_part_of_its_rows(record, tmp_path):
    slow = np.where(record.time_s < 30.0, record.time_s, record.time_s + 1000.0)  # the cell rests there
    replace(record, time_s=slow).to_frame().to_csv(tmp_path / "drive.csv", index=False)
    read = aesi.read_measurement(tmp_path / "drive.csv")
    assert len(read.notes) == 1
    part = examined(read.take(slice(0, 1700)))
    assert part.notes == read.notes
    assert part.was_examined


def test_a_discovery_that_kept_nothing_back_showed_errors_that_are_no_number(
    cell, record, monkeypatch, tmp_path
):
    few = {"series_resistance": CATALOGUE["series_resistance"]}
    monkeypatch.setattr("aesi.pipeline.discovery.discover.known_effects", lambda files: few)
    found = aesi.discover(cell, record, soc0=SOC0, holdout=0.0)
    shown, page = repr(found), (found.save(tmp_path) / "report.html").read_text()
    assert "RMSE, free run, fit" in page
    assert "RMSE, free run, test" not in page
    assert shown.endswith("mV after, on the fitted data)")
    assert "nan" not in shown


def test_every_key_of_a_discovery_is_explained(cell, record, monkeypatch):
    monkeypatch.setattr(
        "aesi.pipeline.discovery.discover.known_effects",
        lambda files: {"series_resistance": CATALOGUE["series_resistance"]},
    )
    content = aesi.discover(cell, record, soc0=SOC0).content
    page = (Path(__file__).resolve().parents[2] / "docs" / "reference" / "files.md").read_text()
    listed = page[page.index("key of `discovery.json`") :]
    keys = [*content, *content["candidates"][0]]
    assert [key for key in keys if f"`{key}`" not in listed and f"`{key}[]`" not in listed] == []


def test_a_discovery_takes_files(cell, record, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "aesi.pipeline.discovery.discover.known_effects",
        lambda files: {"series_resistance": CATALOGUE["series_resistance"]},
    )
    record.to_frame().to_csv(tmp_path / "drive.csv", index=False)
    found = aesi.discover(CELL, str(tmp_path / "drive.csv"), soc0=SOC0, out=tmp_path / "out")
    assert found.effects == ("series_resistance",)
    assert (tmp_path / "out" / "discovery.json").is_file()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"hold": "zoh"}, "hold = 'zoh' is not known; give 'linear' or 'backward'."),
        ({"hold": ""}, "hold = '' is not known"),
        ({"on_depletion": "ignore"}, "on_depletion = 'ignore' is not known; give 'raise' or 'clip'."),
        ({"cell": "cell.bpx.json"}, "cell is the text 'cell.bpx.json', not a Cell; read one from its file"),
        ({"effects": "series_resistance"}, r"effects=\[CATALOGUE\['series_resistance'\].activate\(\)\]"),
        ({"effects": ["series_resistance"]}, r"give CATALOGUE\['series_resistance'\].activate\(\)"),
        ({"effects": [CATALOGUE["double_layer"]]}, r"give CATALOGUE\['double_layer'\].activate\(\)"),
        ({"effects": 3}, "effects is an object of type int; give a list"),
        ({"soc0": 90}, "soc0 = 90 is not a state of charge; .* so 90 % is 0.9"),
        ({"soc0": float("nan")}, "soc0 = nan is not a state of charge"),
        ({"soc0": "full"}, "soc0 = 'full' is not a state of charge"),
        ({"soc0": np.array([0.8])}, r"soc0 = array\(\[0.8\]\) is not a state of charge"),
        ({"soc0": "full", "on_depletion": "clip"}, "soc0 = 'full' is not a state of charge"),
        ({"soc0": [0.8], "on_depletion": "clip"}, r"soc0 = \[0.8\] is not a state of charge"),
        ({"soc0": np.linspace(4.0, 3.0, 600)}, r"^soc0 = array\(\[[^\n]{,40}\) is not a state of charge"),
        ({"soc0": True, "on_depletion": "clip"}, "soc0 = True is not a state of charge"),
        ({"soc0": float("nan"), "on_depletion": "clip"}, "soc0 = nan is not a state of charge"),
        ({"soc0": float("inf"), "on_depletion": "clip"}, "soc0 = inf is not a state of charge"),
        (
            {"time_s": pd.date_range("2024", periods=len(TIME), freq="s")},
            "time_s holds dates or durations; give",
        ),
        (
            {"time_s": pd.date_range("2024", periods=len(TIME), freq="s", tz="Europe/Berlin")},
            "time_s holds dates or durations; give",
        ),
        (
            {"current_a": pd.Series([True, None] * (len(TIME) // 2), dtype="boolean")},
            "current_a holds truth values; give numbers",
        ),
        ({"soc0": None, "rest_voltage_v": "3.9"}, "rest_voltage_v = '3.9' is not a voltage; give one"),
        ({"soc0": None, "rest_voltage_v": [3.9]}, r"rest_voltage_v = \[3.9\] is not a voltage; give one"),
        ({"rest_voltage_v": 3.9}, "soc0 and rest_voltage_v both say where the cell starts; give one of them"),
        ({"current_a": ["rest"] * len(TIME)}, "current_a holds 'rest', which is not a number"),
        ({"current_a": 1j * TIME}, "current_a holds complex numbers"),
        (
            {"current_a": np.ma.masked_array(TIME, mask=np.arange(len(TIME)) == 3)},
            "current_a is masked in row 4, counted from 1; drop or fill what is masked first",
        ),
        ({"current_a": np.full(len(TIME), np.nan)}, "current_a is nan in row 1, counted from 1"),
        ({"time_s": TIME[::-1]}, r"time_s does not increase at 1798 s \(row 2, counted from 1\)"),
        ({"time_s": 3.0}, r"time_s and current_a have shapes \(\) and \(1800,\)"),
        ({"temperature_degc": [25.0] * 3}, r"temperature_degc has the shape \(3,\); give one value or 1800"),
        (
            {"temperature_degc": np.where(TIME == 4.0, np.nan, 25.0)},
            "temperature_degc is nan in row 5, counted from 1; drop or fill",
        ),
        ({"temperature_degc": float("nan")}, "temperature_degc = nan degC is outside -60 to 150 degC"),
    ],
)
def test_what_cannot_be_meant_is_said_in_one_sentence(cell, current, changes, sentence):
    given = {"cell": cell, "time_s": TIME, "current_a": current, "soc0": SOC0} | changes
    with pytest.raises(InputError, match=sentence) as caught:
        aesi.simulate(**given)
    assert "\n" not in str(caught.value)


def test_lists_and_columns_of_a_table_are_arrays_of_floats():
    table = pd.DataFrame({"t": [0, 1, 3], "i": [1, 1, 2], "v": [3.9, 3.8, 3.7]}, index=[7, 8, 9])
    for given in ((table.t, table.i, table.v), tuple(table[name].tolist() for name in "tiv")):
        made = aesi.Measurement(*given)
        assert [column.dtype for column in (made.time_s, made.current_a, made.voltage_v)] == [float] * 3
        assert made.between(1.0, 4.0).voltage_v.tolist() == [3.8, 3.7]


@pytest.mark.parametrize(
    ("columns", "sentence"),
    [
        (([0.0, 1.0], [1.0, 1.0], [3.9]), "m: voltage_v has 1 rows, time_s has 2 rows"),
        (([[0.0], [1.0]], [1.0, 1.0], [3.9, 3.9]), r"m: time_s has the shape \(2, 1\); give one row"),
        (
            ([1.0, 0.0], [1.0, 1.0], [3.9, 3.9]),
            r"m: time_s does not increase at 0 s \(row 2, counted from 1\)",
        ),
        (([0.0, 1.0], [1.0, np.nan], [3.9, 3.9]), "m: current_a is nan in row 2"),
        (([0.0, 1.0], [1.0, 1.0], [3.9, 3.9], [25.0, np.nan]), "m: temperature_degc is nan in row 2"),
    ],
)
def test_columns_that_are_no_measurement_are_refused(columns, sentence):
    with pytest.raises(DataError, match=sentence):
        aesi.Measurement(*columns, name="m")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"holdout": 30}, "holdout = 30 is not a share of the record, .* 30 % is 0.3"),
        ({"holdout": -0.1}, "holdout = -0.1 is not a share"),
        ({"holdout": "half"}, "holdout = 'half' is not a share"),
        ({"soh": "new"}, "a state of health of 'new'"),
        ({"soh": 10**400}, r"a state of health of 1000+\.\.\.0+: it is the share"),
        ({"cell": None}, "an object of type NoneType is no cell; give a BPX file"),
        ({"only": 3}, "only = 3: give the id of an effect, or a list of ids"),
        ({"max_effects": -1}, "max_effects = -1 is not a whole number from 0 up to 10"),
        ({"max_effects": 1.5}, "max_effects = 1.5 is not a whole number"),
        ({"seed": "a"}, "seed = 'a' is not a whole number from 0"),
        ({"soc0": 90}, "soc0 = 90 is not a state of charge"),
        ({"hold": "zoh"}, "hold = 'zoh' is not known"),
        ({"data": None}, "an object of type NoneType is no record; give a file"),
        ({"data": pd.DataFrame({"time_s": [0.0]})}, "an object of type DataFrame is no record"),
        ({"data": [TIME, TIME]}, "an object of type ndarray is no record"),
        ({"data": aesi.Measurement([], [], [])}, r"too few rows \(0\)"),
        (
            {"data": aesi.Measurement([0.0, 1.0], [1.0, 1.0], [3.9, np.nan])},
            r"voltage_v is nan at 1 s \(row 2, counted from 1\)",
        ),
        ({"effect_files": "mine.py"}, "there is no effect file .*mine.py"),
        ({"only": "serie_resistance"}, "there is no effect 'serie_resistance'"),
        (
            {"only": ["film_growth"], "without": "film_growth"},
            "named both to be tried alone and to be left out",
        ),
        ({"out": __file__}, "cannot be a folder"),
    ],
)
def test_a_discovery_says_what_cannot_be_meant_before_it_searches(cell, record, changes, sentence):
    with pytest.raises(InputError, match=sentence) as caught:
        aesi.discover(**({"cell": cell, "data": record} | changes))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"starts": 1.5}, "starts = 1.5 is not a whole number from 1"),
        ({"seed": -1}, "seed = -1 is not a whole number from 0"),
        ({"seed": 2**32}, "seed = 4294967296 is not a whole number from 0 up to 4294967295"),
        ({"cut_offs_v": 4.2}, r"cut_offs_v = 4.2: give \(lower, upper\) V"),
        ({"cut_offs_v": (1, 2, 3)}, r"cut_offs_v = \(1, 2, 3\): give"),
        ({"body_mm": 5}, "a body of 5 mm: give diameter and height"),
        ({"mass_g": "x"}, "a mass of 'x' g is no number"),
        ({"mass_g": 10**400, "body_mm": (21, 70)}, r"a mass of 1000+\.\.\.0+ g is no number"),
        ({"cut_offs_v": (2.5, 10**400)}, r"1000+\.\.\.0+ V as the upper cut-off is no number"),
    ],
)
def test_a_calibration_says_what_cannot_be_meant_before_it_fits(cell, record, changes, sentence):
    with pytest.raises(InputError, match=sentence):
        aesi.calibrate(cell, record, **changes)


def test_a_prior_of_no_parameter_was_told_by_python_once_the_records_were_read(cell, tmp_path):
    with pytest.raises(InputError, match="no_such_factor"):
        aesi.calibrate(cell, tmp_path / "missing.csv", priors={"no_such_factor": (1.0, 0.1)})


@pytest.mark.parametrize(("source", "type_"), [([], "list"), (3, "int"), (None, "NoneType")])
def test_what_is_no_file_of_a_cell_is_told(source, type_):
    """It said "a int is no cell"."""
    said = f"^an object of type {type_} is no cell; give the path of a BPX file, or its content as a dict"
    with pytest.raises(CellError, match=said):
        aesi.Cell.from_bpx(source)


TABLE = pd.DataFrame({"time_s": [0.0, 1.0], "current_a": [0.0, 0.0], "voltage_v": [3.9, 3.9]})


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (
            lambda cell, _: initial_state(cell, TABLE),
            "the record is an object of type DataFrame, not a Measurement",
        ),
        (lambda _, record: initial_state(str(CELL), record), "cell is the text .*, not a Cell"),
        (
            lambda cell, _: aesi.HybridModel(cell).predict_record(TABLE),
            "type DataFrame, not a Measurement; give aesi",
        ),
        (
            lambda cell, _: aesi.HybridModel(cell).predict_record("drive.csv"),
            "the record is the text 'drive.csv'",
        ),
        (
            lambda _, record: aesi.cross_check(CELL, record.time_s, record.current_a, SOC0),
            "not a Cell; read one",
        ),
        (
            lambda cell, _: aesi.HybridModel.load(cell),
            "an object of type Cell is no folder; give the path of a saved",
        ),
    ],
)
def test_a_table_for_a_record_and_a_path_for_a_cell_ended_in_an_attribute_error(cell, record, asked, said):
    with pytest.raises(InputError, match=said) as caught:
        asked(cell, record)
    assert "\n" not in str(caught.value)


def test_a_number_of_numpy_is_a_state_of_charge(cell, current):
    one, other = (aesi.simulate(cell, TIME, current, soc0) for soc0 in (SOC0, np.array(SOC0)))
    np.testing.assert_array_equal(one.voltage_v, other.voltage_v)
    lost = [CATALOGUE["lithium_inventory_loss"].activate(loss=0.05)]
    z = [aesi.impedance(cell, [1.0], soc, effects=lost)[0] for soc in (0.5, np.array(0.5))]
    assert z[0] == z[1]


def test_a_run_keeps_its_columns_when_the_arrays_that_were_given_change(cell):
    time, held = np.arange(60.0), np.full(60, 1.0)
    run = aesi.simulate(cell, time, held, SOC0)
    held[:], time[:] = 5.0, 7.0
    assert run.current_a[0] == 1.0
    assert run.time_s[-1] == 59.0


@pytest.mark.parametrize(("argument", "told"), [("error0_v", "is no voltage"), ("soc0_sd", "is no standard")])
def test_a_text_in_place_of_a_number_is_told_by_a_prediction(cell, current, argument, told):
    with pytest.raises(InputError, match=f"{argument} = 'x' {told}"):
        aesi.HybridModel(cell).predict(TIME, current, SOC0, **{argument: "x"})


def test_a_charge_of_no_cell_is_told_in_a_few_digits(cell):
    with pytest.raises(AesiError) as caught:
        aesi.simulate(cell, [0, 1, 2], [1e300] * 3, 0.6)
    assert len(str(caught.value)) < 600


def test_a_prediction_takes_one_temperature_for_all_rows(cell, current):
    model = aesi.HybridModel(cell)
    one, many = (model.predict(TIME, current, SOC0, temperature_degc=t) for t in (10.0, [10.0] * len(TIME)))
    np.testing.assert_array_equal(one.voltage_v, many.voltage_v)


def test_an_impedance_says_what_cannot_be_meant(cell):
    for changes, sentence in (
        ({"soc": 50}, "^soc = 50 is not a state of charge"),
        ({"soc": [0.5, 0.6]}, "is not a state of charge"),
        ({"soc": None}, "soc = None is no state of charge"),
        ({"temperature_degc": "room"}, "temperature_degc holds 'room', which is not a number"),
        ({"temperature_degc": [25.0, 30.0]}, r"temperature_degc has the shape \(2,\); a cell at rest"),
        ({"effects": "double_layer"}, "effects is the text 'double_layer'"),
        ({"frequency_hz": "1 kHz"}, "frequency_hz holds '1 kHz', which is not a number"),
    ):
        with pytest.raises(InputError, match=sentence):
            aesi.impedance(**({"cell": cell, "frequency_hz": [1.0], "soc": 0.5} | changes))


def test_a_record_without_any_current_ended_a_calibration_with_an_index_error(cell):
    rest = aesi.Measurement(TIME, np.zeros(len(TIME)), np.full(len(TIME), 4.0), name="rest")
    with pytest.raises(DataError, match="rest: the current is 0 A in all 1,800 rows"):
        aesi.calibrate(cell, rest)


@pytest.mark.parametrize(
    ("days", "sentence"),
    [
        (
            {"dates": {"drive": "2019-05-31"}},
            r"dates\['drive'\] = '2019-05-31' is no day; give a datetime.date",
        ),
        ({"as_of": 2019}, "as_of = 2019 is no day"),
    ],
)
def test_a_day_that_is_text_or_a_number_is_told(cell, record, days, sentence):
    with pytest.raises(InputError, match=sentence):
        aesi.calibrate(cell, record, **days)


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        ({"temperatures_degc": 25.0}, "temperatures_degc = 25.0 names no record; give a dict"),
        ({"priors": [0.01, 0.001]}, r"priors = \[0.01, 0.001\] names no parameter; give a dict of"),
        (
            {"priors": {"contact.resistance": 0.01}},
            r"priors\['contact.resistance'\] = 0.01 is no pair of numbers; give a dict of",
        ),
        ({"priors": {"contacts": (0.01, 0.001)}}, "the prior of contacts: there is no such parameter"),
        ({"temperatures_degc": {"nope": 10}}, "the temperature of nope: there is no such record among"),
        ({"dates": {"nope": date(2019, 5, 31)}}, "the date of nope: there is no such record"),
        ({"dates": ["2019-05-31"]}, r"dates = \['2019-05-31'\] names no record; give a dict"),
        ({"temperatures_degc": {"drive": "room"}}, "the temperature of drive holds 'room', which is not a n"),
        ({"temperatures_degc": {"drive": [25.0, 26.0]}}, "the temperature of drive is a row of 2; give one"),
    ],
)
def test_what_is_said_of_records_in_a_form_that_nothing_reads_was_an_error_of_python(
    cell, record, said, sentence
):
    with pytest.raises(InputError, match=sentence):
        aesi.calibrate(cell, record, **said)


@dataclass(frozen=True)
class Answer:
    """Of a fit that was not made."""

    notes: tuple[str, ...] = ()


def test_spectra_were_fitted_by_the_command_line_alone(cell, record, tmp_path, monkeypatch):
    frequency = np.array([0.1, 1.0, 10.0, 1000.0])
    z_ohm = aesi.impedance(cell, frequency, soc=0.6)
    rows = {"frequency_hz": frequency, "z_real_ohm": z_ohm.real, "z_imag_ohm": z_ohm.imag, "soc": 0.6}
    pd.DataFrame(rows).to_csv(tmp_path / "eis.csv", index=False)
    (read,) = read_spectra(tmp_path / "eis.csv")
    asked = []

    def fitted(cell, records, conditions, **_):
        asked.append(conditions)
        return Answer()

    monkeypatch.setattr("aesi.pipeline.calibrate.calibrate", fitted)
    for given in (tmp_path / "eis.csv", str(tmp_path / "eis.csv"), read, [read]):
        aesi.calibrate(cell, record, spectra=given)
    assert [[one.digest for one in each.spectra] for each in asked] == 4 * [[read.digest]]
    with pytest.raises(
        InputError, match="spectra: an object of type int is no spectrum; give a file of spectra"
    ):
        aesi.calibrate(cell, record, spectra=3)
    with pytest.raises(DataError, match="is there twice"):
        aesi.calibrate(cell, record, spectra=[read, read])
    milliohm = replace(read, z_ohm=1e3 * read.z_ohm)
    with pytest.raises(DataError, match="as of no cell"):
        aesi.calibrate(cell, record, spectra=milliohm)
    turned = replace(read, z_ohm=read.z_ohm.conj())
    with pytest.raises(DataError, match="imaginary part of z_ohm: it is positive in all rows up to"):
        aesi.calibrate(cell, record, spectra=turned)  # only files were refused for it


def test_arrays_in_another_unit_were_told_options_of_the_command_line_alone(cell, record):
    with pytest.raises(DataError, match="give it in A, or declare"):
        aesi.discover(cell, replace(record, current_a=1e3 * record.current_a, source=""))


def test_a_table_in_place_of_a_file_is_told_what_takes_one():
    with pytest.raises(InputError, match=r"of type DataFrame is no file; .* aesi\.Measurement\(time_s"):
        aesi.read_measurement(pd.DataFrame({"time_s": TIME}))


def test_a_parameter_that_is_no_number_is_told():
    with pytest.raises(InputError, match="resistance_ohm is a whole number of more than 308 digits"):
        CATALOGUE["series_resistance"].activate(resistance_ohm=10**400)
    with pytest.raises(InputError, match="resistance_ohm = '1m' is not a number"):
        CATALOGUE["series_resistance"].activate(resistance_ohm="1m")
    with pytest.raises(InputError, match="resistance_ohm = True is not a number"):
        CATALOGUE["series_resistance"].activate(resistance_ohm=True)


def test_a_type_checker_lets_through_what_the_functions_take():
    from aesi.numerics.typing import Numbers

    for function, names in (
        (aesi.simulate, ("time_s", "current_a")),
        (aesi.HybridModel.predict, ("time_s", "current_a")),
        (aesi.impedance, ("frequency_hz",)),
        (aesi.cross_check, ("time_s", "current_a")),
    ):
        assert {get_type_hints(function)[name] for name in names} == {Numbers}, function


def test_the_effects_of_a_saved_model_were_left_out_of_its_calibration_without_a_word(
    cell, record, monkeypatch
):
    monkeypatch.setattr("aesi.pipeline.calibrate.calibrate", partial(fit_cell, evaluations=1))
    model = aesi.HybridModel(cell, (CATALOGUE["ocv_hysteresis"].activate(),))
    assert (
        aesi.calibrate(model, record)
        .notes[0]
        .startswith("the effect ocv_hysteresis of the saved model: left out")
    )
    assert not any("saved model" in note for note in aesi.calibrate(cell, record).notes)


def test_files_of_one_name_in_two_folders_had_one_name_in_python(cell, record, monkeypatch, tmp_path):
    monkeypatch.setattr("aesi.pipeline.calibrate.calibrate", partial(fit_cell, evaluations=1))
    files = [tmp_path / folder / "drive.csv" for folder in ("cold", "warm")]
    for file, shift in zip(files, (0.0, 1e-3), strict=True):
        file.parent.mkdir()
        replace(record, voltage_v=record.voltage_v + shift).to_frame().to_csv(file, index=False)
    assert [one.name for one in aesi.calibrate(cell, files).errors] == ["cold drive", "warm drive"]


def test_a_file_from_one_of_another_body_kept_that_body(cell, record, monkeypatch):
    """Volume, surface and density of the start file, since a fit moves their products alone."""
    monkeypatch.setattr("aesi.pipeline.calibrate.calibrate", partial(fit_cell, evaluations=1))
    made = aesi.calibrate(cell, record, body_mm=(200.0, 150.0, 9.0), mass_g=600.0)
    found = made.cell
    assert (found.volume_m3, found.surface_area_m2) == pytest.approx((270e-6, 663e-4))
    assert found.density_kg_m3 == pytest.approx(0.6 / 270e-6)
    assert "the body of the cell as given: 270 cm3, 663 cm2, 2222 kg/m3." in made.notes
    kept = aesi.calibrate(cell, record)
    bodies = [(c.volume_m3, c.surface_area_m2, c.density_kg_m3) for c in (kept.cell, cell)]
    assert bodies[0] == bodies[1]
    assert not any("the body" in note for note in kept.notes)
    with pytest.raises(CellError, match="in the body that was given: density, specific heat capacity and"):
        aesi.calibrate(cell, record, body_mm=(2.0, 1.5, 0.9))


def test_a_cell_with_other_cut_offs_needed_a_start_file_of_its_own(cell, record, monkeypatch):
    monkeypatch.setattr("aesi.pipeline.calibrate.calibrate", partial(fit_cell, evaluations=1))
    found = aesi.calibrate(cell, record, cut_offs_v=(2.6, 4.15)).cell
    assert (found.lower_voltage_v, found.upper_voltage_v) == (2.6, 4.15)
    assert aesi.calibrate(cell, record).cell.upper_voltage_v == cell.upper_voltage_v
    with pytest.raises(CellError, match=r"the lower cut-off \(4.15 V\) has to be"):
        aesi.calibrate(cell, record, cut_offs_v=(4.15, 2.6))
