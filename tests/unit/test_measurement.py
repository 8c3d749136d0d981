"""What a record says of itself."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import aesi
from aesi.data.convert import record_lines
from aesi.errors import DataError, InputError
from aesi.records import Measurement, Run, Spectrum, at_its_temperature
from aesi.records.checked import checked_dt

BPX = Path(__file__).resolve().parents[2] / "experiments" / "cells" / "nmc_30ah.bpx.json"


def test_a_known_state_of_charge_is_that_of_the_first_row():
    record = Measurement([0.0, 1.0, 2.0], np.zeros(3), np.full(3, 3.7)).begun_at(0.5)
    assert (record.soc0, record.take(slice(0, 2)).soc0, record.held("linear").soc0) == (0.5, 0.5, 0.5)
    assert (
        record.take(slice(1, None)).soc0
        is record.between(0.5, 3.0).soc0
        is record.begun_at(None).soc0
        is None
    )
    assert record.take(np.array([], dtype=int)).soc0 is None
    for wrong in (50, -0.1, np.nan):
        with pytest.raises(DataError, match="is no state of charge; give one from 0"):
            record.begun_at(wrong)


def test_the_charge_of_a_pulse_between_far_rows_depends_on_how_the_current_runs():
    """6 A for the first 10 min or as a triangle over 20 min, then 3 A of charge for half an hour."""
    record = Measurement([0.0, 600.0, 1200.0, 1201.0, 3001.0], [0.0, 6.0, 0.0, -3.0, -3.0], np.full(5, 3.7))
    held = record.discharged_ah("backward")
    straight = record.discharged_ah("linear")
    assert held[[1, 2]] == pytest.approx([1.0, 1.0])
    assert straight[[1, 2]] == pytest.approx([0.5, 1.0])
    assert held[-1] == pytest.approx(1.0 - 3.0 / 3600.0 - 1.5)
    assert held[-1] == pytest.approx(record.charge_ah), (
        "in straight lines, where all else took it as a logger's"
    )
    assert straight[-1] == pytest.approx(record.held("linear").charge_ah)
    with pytest.raises(DataError, match=r"hold = 'straight' is not known; give 'linear' or 'backward'[.]"):
        record.discharged_ah("straight")  # taken as linear before


def test_a_range_was_told_by_two_figures_that_read_the_same():
    assert at_its_temperature(np.array([25.01, 25.02])) == "at its measured temperature, 25.0 degC"
    assert at_its_temperature(np.array([25.0, 26.0])) == "at its measured temperature, 25.0 to 26.0 degC"
    still = np.array([3.7, 3.7001])
    assert ", 3.700 V, " in repr(Run(np.arange(2.0), np.zeros(2), still, {}))
    assert repr(Spectrum("z", [1.0], [1e-3])).endswith("1 points, 1 Hz)")
    record = Measurement(np.arange(2.0), [1.0, 1.0], still, np.array([25.0, 25.001]))
    described = " ".join(record_lines(record, of_cell=True))
    assert "1 A, positive" in described
    assert "Temperature 25 degC" in described


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"hold": "Backward"}, "drive: hold = 'Backward' is not known; give 'linear' or 'backward'"),
        ({"voltage_v": None}, "drive: voltage_v is None; give one row of numbers, NaN for unknown voltages"),
        ({"time_s": None}, "drive: time_s is None"),
        ({"current_a": [[1.0], [2.0, 3.0]]}, "drive: current_a holds rows of several lengths"),
        ({"current_a": np.array([False, True])}, "drive: current_a holds truth values; give numbers"),
        ({"current_a": [True, 2.0]}, "drive: current_a holds truth values; give numbers"),
        ({"current_a": np.array([2.0, True], object)}, "drive: current_a holds truth values; give numbers"),
        ({"name": None}, "the name of a measurement is None, which is no text; leave it out, or give one"),
        ({"temperature_degc": np.nan}, "drive: temperature_degc is nan in row 1"),
    ],
)
def test_a_record_that_cannot_be_was_made_and_failed_where_it_was_used(changes, sentence):
    columns = {"time_s": [0.0, 1.0], "current_a": [1.0, 1.0], "voltage_v": [3.7, 3.6], "name": "drive"}
    with pytest.raises(DataError, match=sentence):
        Measurement(**(columns | changes))


def test_a_temperature_of_all_rows_was_refused_where_a_simulation_takes_one():
    record = Measurement([0.0, 1.0, 2.0], np.zeros(3), np.full(3, 3.7), temperature_degc=25.0)
    np.testing.assert_array_equal(record.temperature_degc, [25.0, 25.0, 25.0])
    assert (
        record.digest == Measurement([0.0, 1.0, 2.0], np.zeros(3), np.full(3, 3.7), np.full(3, 25.0)).digest
    )


def test_a_current_that_is_a_condition_was_simulated_as_one_ampere():
    time_s = np.arange(10.0)
    with pytest.raises(DataError, match="current_a holds truth values; give numbers"):
        aesi.simulate(aesi.Cell.from_bpx(BPX), time_s, time_s > 5.0, 0.5)


@pytest.mark.parametrize(("offset", "told"), [(0.0, "2.5 s"), (1.7e9, "1700000002.5 s")])
def test_a_row_stamped_since_1970_was_told_by_six_digits_which_all_rows_share(offset, told):
    time = offset + np.array([0.0, 2.5, 2.5])
    with pytest.raises(DataError, match=f"time_s does not increase at {told}"):
        Measurement(time, np.ones(3), np.full(3, 3.7))


def test_times_in_nanoseconds_were_simulated_without_an_end():
    told = r"time_s has a step of 1e\+11 s before row 2, counted from 1, longer than a year .*has to be in seconds"
    with pytest.raises(DataError, match=told):
        aesi.simulate(aesi.Cell.from_bpx(BPX), [0.0, 1e11], [0.0, 0.0], 0.5)
    with pytest.raises(DataError, match=f"drive: {told}"):
        Measurement(np.array([0.0, 1e11]), np.zeros(2), np.zeros(2), name="drive")


@pytest.mark.parametrize(
    ("frequency_hz", "z_ohm", "words"),
    [
        ([1.0, 2.0], [0.01], "z_ohm has 1 rows, frequency_hz has 2 rows"),
        ([], [], "s has no frequency; a spectrum needs at least one"),
        ([1.0, np.inf], [0.01, 0.02], "frequency_hz is inf in row 2"),
        ([1.0, 2.0], [0.01, complex(0.01, np.nan)], "z_ohm is nan in row 2"),
        ([1.0, 0.0], [0.01, 0.02], "frequency_hz is 0 Hz in row 2, .* above 0"),
        ([1.0, 2.0], [0.01, 0.0], r"\|Z\| is 0 ohm in row 2"),
        ([1.0], ["z"], "z_ohm holds 'z', which is not a number"),
        ([[1.0]], [[0.01]], "has the shape"),
    ],
)
def test_a_spectrum_was_taken_whatever_it_held(frequency_hz, z_ohm, words):
    with pytest.raises(DataError, match=words):
        Spectrum("s", frequency_hz, z_ohm)


def test_a_spectrum_of_lists_is_one_of_arrays():
    one = Spectrum("s", [2, 1], [0.01, 0.02 - 0.01j])
    assert one.frequency_hz.dtype == float
    assert one.z_ohm.tolist() == [0.01 + 0j, 0.02 - 0.01j]


def test_a_step_that_no_float_holds_ended_in_an_overflow():
    with pytest.raises(InputError, match="has to be a positive number of seconds"):
        checked_dt(10**400)


@pytest.mark.parametrize("column", range(3))
def test_a_column_with_a_number_that_no_float_holds_ended_in_an_overflow(column):
    columns = [[0.0, 1.0], [1.0, 1.0], [3.9, 3.9]]
    columns[column][1] = 10**400
    label = ("time_s", "current_a", "voltage_v")[column]
    with pytest.raises(DataError, match=f"m: {label} holds a whole number of more than 308 digits"):
        Measurement(*columns, name="m")


def test_a_plot_of_a_record_without_rows_ended_in_an_index_error():
    with pytest.raises(InputError, match="there is no row to draw"):
        Measurement([], [], []).plot()


@pytest.mark.parametrize(
    ("start_s", "stop_s", "words"),
    [
        (100.0, 200.0, "m has no row from 100 s up to 200 s. It runs from 10 to 12 s."),
        (12.0, 11.0, "m has no row from 12 s up to 11 s. It runs from 10 to 12 s."),
        (10.0, None, "m has no row from 10 s up to nan s. It runs from 10 to 12 s."),
        ("ten", 12.0, "m: start_s or stop_s holds 'ten', which is not a number."),
    ],
)
def test_a_part_beyond_a_record_was_an_empty_record_without_a_word(start_s, stop_s, words):
    record = Measurement([10.0, 11.0, 12.0], [0.0] * 3, [3.7] * 3, name="m")
    assert len(record.between(11.0, np.inf)) == 2
    with pytest.raises(DataError) as caught:
        record.between(start_s, stop_s)
    assert str(caught.value) == words


def test_a_record_and_a_spectrum_changed_with_the_arrays_that_they_were_made_of():
    time_s, voltage_v, frequency_hz = np.arange(3.0), np.full(3, 3.7), np.array([1.0, 10.0])
    one = Measurement(time_s, np.zeros(3), voltage_v)
    spectrum = Spectrum("cell", frequency_hz, [0.03, 0.02])
    digests = one.digest, spectrum.digest
    voltage_v += 0.1  # for the next record of a loop
    frequency_hz *= 2.0
    assert (one.digest, spectrum.digest) == digests


@pytest.mark.parametrize("of", ["record", "table"])
@pytest.mark.parametrize(
    ("called", "words"),
    [
        (
            lambda cell, data: aesi.simulate(cell, data, soc0=0.8),
            "simulate(cell, data.time_s, data.current_a)",
        ),
        (
            lambda cell, data: aesi.simulate(cell, data, 0.8),
            "simulate(cell, data.time_s, data.current_a)",
        ),
        (
            lambda cell, data: aesi.cross_check(cell, data, soc0=0.8),
            "cross_check(cell, data.time_s, data.current_a, soc0)",
        ),
        (
            lambda cell, data: aesi.HybridModel(cell).predict(data),
            "HybridModel.predict(data.time_s, data.current_a)",
        ),
        (
            lambda cell, data: aesi.Measurement(data),
            "Measurement(data.time_s, data.current_a, data.voltage_v)",
        ),
    ],
)
def test_a_record_or_a_table_given_for_columns_ended_in_a_type_error(called, words, of):
    cell = aesi.Cell.from_bpx(BPX)
    record = Measurement([0.0, 1.0], [0.0, 0.0], [3.9, 3.9])
    kind = {"record": "Measurement", "table": "DataFrame"}[of]
    with pytest.raises(
        InputError, match=rf"takes columns, not an object of type {kind}; .*{re.escape(words)}\.$"
    ):
        called(cell, record if of == "record" else record.to_frame())


def test_the_advice_for_dates_did_not_hold_for_a_column_of_a_table():
    dates = pd.Series(pd.date_range("2024", periods=3, freq="s", tz="UTC"), index=[5, 6, 7])
    for given in (dates, pd.DatetimeIndex(dates), dates.dt.tz_localize(None).to_numpy()):
        with pytest.raises(DataError, match="holds dates or durations") as refused:
            Measurement(given, [0.0] * 3, [3.7] * 3)
        advised = str(refused.value).split(", as ")[1].removesuffix(" does in seconds.")
        time_s = eval(advised, {"dates": given, "np": np})
        assert list(Measurement(time_s, [0.0] * 3, [3.7] * 3).time_s) == [0.0, 1.0, 2.0]


def test_other_missing_arguments_are_pythons_own():
    with pytest.raises(TypeError, match=r"simulate\(\) missing 1 required positional argument: 'current_a'"):
        aesi.simulate(aesi.Cell.from_bpx(BPX), [0.0, 1.0])
