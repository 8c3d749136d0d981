"""One sentence for every reader: the options of a command, the keys of an experiment file, the arguments of Python."""

import inspect

import numpy as np
import pandas as pd
import pytest

import aesi
from aesi.advice import OF_CALL, OF_READING, OF_RECORD, told, with_arguments, with_columns, with_keys
from aesi.errors import AesiError, DataError
from aesi.pipeline.discovery.discover import Case

CELL = "experiments/cells/nmc_30ah.bpx.json"
TIME = np.arange(600.0)
CURRENT = np.repeat(np.random.default_rng(0).normal(10.0, 30.0, 20), 30)
VOLTAGE = 3.7 - 1e-3 * CURRENT


@pytest.fixture
def written(tmp_path):
    def write(name="lab.csv", **columns):
        path = tmp_path / name
        pd.DataFrame(columns).to_csv(path, index=False)
        return path

    return write


def refused(function, *arguments, **keywords):
    with pytest.raises(AesiError) as caught:
        function(*arguments, **keywords)
    return str(caught.value)


def test_a_state_of_charge_that_a_run_may_be_given_was_called_by_a_command_s_option():
    sentence = "drive starts under 1 A at 3.9 V: state of charge 0.7 +/- 0.1; give --soc0 if it is known."
    assert with_keys(sentence).endswith("if it is known (in an experiment file: cell.soc0).")


def test_a_state_of_charge_of_one_of_several_records_is_advised_as_such():
    sentence = "drive starts under 1 A: state of charge 0.7 +/- 0.1; give --soc0 FILE=SOC if it is known."
    assert with_keys(sentence).endswith("(in an experiment file: cell.soc0_of).")
    assert with_arguments(sentence).endswith("(in Python: begun_at of aesi.Measurement).")
    assert with_columns(sentence).endswith("(the column soc0 of the batch's table).")


def test_a_word_of_a_state_was_advised_as_the_column_of_the_state():
    sentence = (
        "column 'State' says 'X' beside a current of 2 A; say which way it flows: --state-word X=charge."
    )
    assert with_keys(sentence).endswith("--state-word X=charge (in an experiment file: data.state_words).")


def test_who_calls_python_was_advised_to_give_options_of_a_command(written):
    path = written(Zeit=TIME, Strom=CURRENT, Spannung=VOLTAGE)
    said = refused(aesi.read_measurement, path)
    assert "--column" in said
    assert said.endswith("(in Python: columns and sign of aesi.read_measurement).")


def test_every_call_that_reads_files_names_python_s_arguments(written):
    path = written(time_s=TIME, current_a=1e3 * CURRENT, voltage_v=VOLTAGE)
    tail = "(in Python: units of aesi.read_measurement)."
    for call in (aesi.discover, aesi.calibrate):
        assert refused(call, CELL, path).endswith(tail)
    record = aesi.Measurement(TIME, 1e3 * CURRENT, VOLTAGE)
    assert refused(aesi.discover, CELL, record).endswith(tail)


def test_the_kind_of_an_error_is_kept(written):
    path = written(time_s=TIME, current_a=CURRENT, voltage_v=1e3 * VOLTAGE)
    with pytest.raises(DataError, match="in Python: units"):
        aesi.read_measurement(path)


def test_notes_of_what_was_read_name_python_s_arguments_too(written):
    path = written(time_s=TIME, current_a=CURRENT, voltage_v=VOLTAGE, T_cell=25.0 + 0.0 * TIME)
    (note,) = aesi.read_measurement(path).notes
    assert "--column temperature_degc=" in note
    assert note.endswith("(in Python: columns of aesi.read_measurement).")


def test_the_words_of_a_state_could_not_be_declared_in_python(written):
    path = written(
        time_s=TIME, current_a=np.abs(CURRENT), voltage_v=VOLTAGE, S=np.where(CURRENT > 0, "E", "L")
    )
    said = refused(aesi.read_measurement, path, state="S")
    assert "state_words of aesi.read_measurement" in said
    read = aesi.read_measurement(path, state="S", state_words={"E": "discharge", "L": "charge"})
    assert read.current_a == pytest.approx(CURRENT)
    assert "names no words" in refused(aesi.read_measurement, path, state="S", state_words="E")


def test_commands_and_experiment_files_are_told_nothing_of_python():
    sentence = "give A, or declare it: --unit current_a=mA."
    assert told("command", sentence) == sentence
    assert told("experiment", sentence) == with_keys(sentence)
    assert (
        told("python", sentence)
        == "give A, or declare it: --unit current_a=mA (in Python: units of aesi.read_measurement)."
    )


def test_a_start_is_a_column_of_a_batch_s_table():
    told = "(the column soc0 of the batch's table)."
    assert (
        with_columns("it is none of this cell; give --soc0.")
        == f"it is none of this cell; give --soc0 {told}"
    )
    assert with_columns("there is no file a.csv.") == "there is no file a.csv."


def test_a_discovery_speaks_to_who_asked_for_it():
    cell = aesi.Cell.from_bpx(CELL)
    record = aesi.Measurement(TIME, CURRENT, VOLTAGE, name="drive", source="drive.csv")
    case = Case(aesi.HybridModel(cell), (record,), reader="python")
    assert any(note.endswith("(in Python: columns of aesi.read_measurement).") for note in case.assumed)


def test_a_sentence_is_extended_once():
    once = with_arguments("give --soc0, or read one side of it: --to-s 5.")
    assert (
        once
        == "give --soc0, or read one side of it: --to-s 5 (in Python: soc0; stop_s of aesi.read_measurement)."
    )
    assert with_arguments(once) == once
    by_itself = "end the record before that (--to-s on the command line)."
    assert with_arguments(by_itself) == by_itself
    assert with_arguments("`aesi bench x--y` --no-prefect") == "`aesi bench x--y` --no-prefect"


def test_the_arguments_that_are_named_exist():
    assert set(OF_READING.values()) <= set(inspect.signature(aesi.read_measurement).parameters)
    functions = (aesi.discover, aesi.calibrate, aesi.simulate, aesi.HybridModel.predict)
    taken = {name for function in functions for name in inspect.signature(function).parameters}
    assert set(OF_CALL.values()) <= taken
    assert all(hasattr(aesi.Measurement, name) for name in OF_RECORD.values())


def test_options_that_are_named_are_those_of_the_commands():
    from flows.commands.record_options import READING

    assert {f"--{name.replace('_', '-')}" for name in READING} == set(OF_READING)
