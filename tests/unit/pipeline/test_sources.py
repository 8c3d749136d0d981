"""Records of an experiment: what is refused of a file names the key of the experiment that says it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_experiment import BPX, PERIOD_S, SOC0, experiment, fitted, write_record

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.read import read
from aesi.data.reading import Reading
from aesi.data.virtual import VirtualExperiment
from aesi.errors import DataError, SimulationError
from aesi.physics import Cell, simulate
from aesi.physics.initial_state import OTHER_STATE
from aesi.pipeline.experiment import sources
from aesi.pipeline.experiment.config import parse_experiment
from aesi.pipeline.experiment.load import load
from aesi.pipeline.experiment.sources import _record, discovery_records, sources_of
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import Measurement


def written(folder: Path, header: str, sign: float = 1.0) -> Path:
    time = np.arange(200.0)
    current = np.where((time // 10) % 2 == 0, 5.0, -2.0)
    rows = "\n".join(f"{t},{sign * i},{3.7 - 0.01 * i}" for t, i in zip(time, current, strict=True))
    path = folder / "drive.csv"
    path.write_text(f"{header}\n{rows}\n")
    return path


@pytest.mark.parametrize(
    ("header", "sign", "key"),
    [
        ("time_s,current_a,voltage_v", -1.0, "in an experiment file: data.sign"),
        ("time_s,I[A],voltage_v", 1.0, "in an experiment file: data.sign, data.columns"),
    ],
)
def test_an_option_that_a_run_does_not_have_was_recommended(tmp_path, header, sign, key):
    with pytest.raises(DataError) as caught:
        _record(written(tmp_path, header, sign), Reading())
    assert key in str(caught.value)


def test_what_needs_no_option_is_told_as_it_is(tmp_path):
    path = tmp_path / "empty.csv"
    path.touch()
    with pytest.raises(DataError, match=r"at least two rows\.$"):
        _record(path, Reading())


def days(folder: Path, inner: str = "") -> list[str]:
    """Records of one name, a folder a day, none like another."""
    paths = []
    for day in range(3):
        place = folder / f"day{day}" / inner
        place.mkdir(parents=True)
        paths.append(written(place, "time_s,current_a,voltage_v"))
        paths[-1].write_text("\n".join(paths[-1].read_text().splitlines()[: 150 + 10 * day]) + "\n")
    return [str(path) for path in paths]


@pytest.mark.parametrize(
    ("inner", "called"),
    [("", ["day0 drive", "day1 drive", "day2 drive"]), ("run", [f"day{day} run drive" for day in range(3)])],
)
def test_records_of_one_name_in_several_folders_were_taken_for_one(tmp_path, inner, called):
    first, second, test = days(tmp_path, inner)
    content = {"name": "days", "data": {"kind": "files", "train": [first, second], "test": [test]}}
    sources = sources_of(parse_experiment(content), Path("unread.bpx.json"))
    assert [record.name for record in sources.records.values()] == called
    assert list(sources.records) == [first, second, test]


def test_a_discovery_takes_records_of_one_name_apart_and_knows_one_of_two_parts(tmp_path):
    first, second, _ = days(tmp_path)
    asked = {"fit": [first, second], "test": [first]}
    config = parse_experiment({"name": "days", "data": {"kind": "files"}, "discover": asked})
    fit, test, _ = discovery_records(config, config.discover, Path("unread.bpx.json"))
    assert [record.name for record in fit] == ["day0 drive", "day1 drive"]
    assert [record.name for record in test] == ["day0 drive"]


def test_the_rows_of_a_record_were_cut_for_commands_alone(tmp_path):
    """A run takes the rows that a command takes; what a discovery keeps from its fits comes on top."""
    path = written(tmp_path, "time_s,current_a,voltage_v")
    taken = read(path, Reading(start_s=20.0, stop_s=120.0))
    data = {"kind": "files", "train": [str(path)], "from_s": {str(path): 20}, "to_s": {str(path): 120}}
    asked = {"fit": [str(path)], "fit_until_s": {str(path): 60}, "good": [str(path)]}
    config = parse_experiment({"name": "cut", "data": data, "discover": asked})
    records = sources_of(config, Path("unread.bpx.json")).records
    np.testing.assert_array_equal(records[str(path)].time_s, taken.time_s)
    (fit,), _, (good,) = discovery_records(config, config.discover, Path("unread.bpx.json"))
    assert (fit.time_s[0], fit.time_s[-1]) == (20.0, 60.0)
    np.testing.assert_array_equal(good.current_a, taken.current_a)


def test_the_end_of_test_records_was_not_read_for_virtual_ones(monkeypatch):
    time_s = np.arange(100.0)
    train, test = (Measurement(time_s, 0.0 * time_s, 3.7 + 0.0 * time_s, name=name) for name in "ab")
    made = VirtualExperiment((train,), (), (test,), {"a": 0.5, "b": 0.5})
    monkeypatch.setattr(sources, "virtual_experiment", lambda config, cell: made)
    content = {"name": "cut", "data": {"kind": "virtual"}, "discover": {"until_s": 60}}
    config = parse_experiment(content)
    (fit,), (held_out,), _ = discovery_records(config, config.discover, Path("unread.bpx.json"))
    assert (fit.time_s[-1], held_out.time_s[-1]) == (99.0, 60.0)


def test_records_of_one_name_in_one_folder_keep_their_suffix(tmp_path):
    from aesi.data.reading import record_names

    paths = [tmp_path / "drive.csv", tmp_path / "drive.parquet", tmp_path / "rest.csv"]
    assert record_names(paths) == ["drive.csv", "drive.parquet", "rest"]


def test_the_record_behind_a_link_was_called_by_the_name_of_its_target(tmp_path):
    from aesi.data.reading import record_names

    target, link = tmp_path / "SHA256E-s1--5f.csv", tmp_path / "us06.csv"
    target.touch()
    link.symlink_to(target)
    assert record_names([link]) == ["us06"]


def test_a_copy_of_a_training_record_was_taken_to_validate(tmp_path):
    first, second, test = days(tmp_path)
    copy = tmp_path / "copy.csv"
    copy.write_bytes(Path(first).read_bytes())
    data = {"kind": "files", "train": [first, second], "valid": [str(copy)], "test": [test]}
    config = parse_experiment({"name": "days", "data": data})
    with pytest.raises(DataError, match="day0 drive and copy hold the same rows and are both among the data"):
        sources_of(config, Path("unread.bpx.json"))


def test_a_record_on_which_a_model_runs_empty_was_not_named_and_the_remedy_was_another_commands(tmp_path):
    config = experiment(write_record(tmp_path), cell={"bpx": str(BPX), "soc0": 0.05, "start": "declared"})
    with pytest.raises(
        SimulationError, match=r"^drive.csv: .* or end the file before that, or give it as a test, "
    ):
        load(config)


def test_one_state_of_charge_was_believed_for_every_record_of_a_run(tmp_path):
    """As in `aesi discover` and `aesi calibrate`: a record whose voltage contradicts it starts where that says."""
    import pandas as pd

    whole = write_record(tmp_path)
    later = tmp_path / "later.csv"
    rows = pd.read_csv(whole).iloc[3 * PERIOD_S :]  # three fifths on, where a rest begins
    rows.to_csv(later, index=False)
    early = tmp_path / "early.csv"
    pd.read_csv(whole).iloc[: 3 * PERIOD_S].to_csv(early, index=False)
    data = {"kind": "files", "train": [str(early)], "test": [str(later)]}
    loaded = load(experiment(early, data=data))
    drawn = np.trapezoid(pd.read_csv(whole)["current_a"][: 3 * PERIOD_S + 1]) / SECONDS_PER_HOUR
    capacity_ah = Cell.from_bpx(BPX).capacity_ah
    assert loaded.soc0[str(early)] == SOC0
    assert loaded.soc0[str(later)] == pytest.approx(SOC0 - drawn / capacity_ah, abs=0.02)
    assert abs(loaded.soc0[str(later)] - SOC0) > OTHER_STATE
    assert any("later" in note and "not the 0.8 that was given" in note for note in loaded.notes)


def test_rows_that_were_filled_in_between_those_of_a_record_were_fitted_and_judged_as_if_measured(tmp_path):
    import pandas as pd

    rows = pd.read_csv(write_record(tmp_path))
    apart = tmp_path / "apart.csv"
    rows.iloc[::10].to_csv(apart, index=False)
    with pytest.raises(
        DataError, match=r"apart: its rows are 10 s apart and data.dt_s is 1 s.*data.dt_s: 10,"
    ):
        load(experiment(apart))
    data = {"kind": "files", "record": str(apart), "dt_s": 10.0}
    repeats = {"period_s": PERIOD_S, "train": [1, 3, 5], "test": [2, 4]}
    assert not [
        note
        for note in load(experiment(apart, data=data | {"repeats": repeats})).notes
        if "do not lie every" in note
    ]
    stamps_s = np.arange(0.0, rows["time_s"].iloc[-1], 1.25)
    near = {name: np.interp(stamps_s, rows["time_s"], rows[name]) for name in rows} | {"time_s": stamps_s}
    pd.DataFrame(near).to_csv(apart, index=False)
    (told,) = (note for note in load(experiment(apart)).notes if "do not lie every" in note)
    # Joined with those of other records, it was a sentence on one of them: "a, b: its rows".
    assert told.startswith("apart: the rows do not lie every 1 s.")
    assert "are of voltages filled in between rows" in told
    (told,) = (
        note
        for note in load(experiment(apart, data=data | {"dt_s": 5.0, "repeats": repeats})).notes
        if "do not lie every" in note
    )
    assert "are of averages over a step" in told


def test_a_unit_that_was_declared_wrongly_was_told_in_options_that_a_run_does_not_have(tmp_path):
    config = experiment(write_record(tmp_path))
    data = config.data.model_copy(update={"units": {"time_s": "min"}})
    words = (
        r"declared: .* time_s was converted from min as declared.* \(in an experiment file: data\.units\)\.$"
    )
    with pytest.raises(DataError, match=words):
        load(config.model_copy(update={"data": data}))


@pytest.mark.parametrize(("column_degc", "told"), [(0.0, True), (25.0, False)])
def test_a_run_took_a_dead_temperature_without_a_word(tmp_path, column_degc, told):
    import pandas as pd

    path = write_record(tmp_path)
    table = pd.read_csv(path)
    run = simulate(Cell.from_bpx(BPX), table["time_s"], table["current_a"], SOC0, temperature_degc=25.0)
    table.assign(voltage_v=run.voltage_v, temperature_degc=column_degc).to_csv(path, index=False)
    said = [
        note for note in load(experiment(path)).notes if "its voltage contradicts its temperature" in note
    ]
    assert bool(said) == told
    for note in said:
        assert note.startswith("drive: its voltage contradicts its temperature. The error of ")
        assert note.endswith("(in an experiment file: data.columns, data.units).")


def test_a_test_record_that_the_cell_file_was_fitted_to_was_called_held_out(tmp_path):
    one, other = (write_record(tmp_path, f"{name}.csv", seed) for seed, name in enumerate(("one", "other")))
    calibrated = replace(Cell.from_bpx(BPX), capacity_shares=(("one", 0.98),))
    (tmp_path / "cell.json").write_text(json.dumps(calibrated.to_bpx()))

    def said(train, test):
        data = {"kind": "files", "train": [str(train)], "test": [str(test)]}
        cell = {"bpx": str(tmp_path / "cell.json"), "soc0": SOC0, "start": "declared"}
        notes = load(experiment(one, data=data, cell=cell, models=["ESPM"])).notes
        return [note for note in notes if "was fitted to a record of this name" in note]

    assert said(one, other) == []
    (note,) = said(other, one)
    assert note.startswith("one: the cell's file was fitted to a record of this name, so that no model has")


def test_a_test_record_that_a_saved_model_was_fitted_to_was_called_held_out(tmp_path):
    one, other = (write_record(tmp_path, f"{name}.csv", seed) for seed, name in enumerate(("one", "other")))
    renamed = one.rename(tmp_path / "renamed.csv")
    HybridModel(Cell.from_bpx(BPX), fitted_to=(("one", read(renamed, Reading()).digest),)).save(
        tmp_path / "model"
    )

    def of(train, test):
        data = {"kind": "files", "train": [str(train)], "test": [str(test)]}
        cell = {"bpx": str(tmp_path / "model"), "soc0": SOC0, "start": "declared"}
        return load(experiment(train, data=data, cell=cell, models=["ESPM"]))

    told = "renamed: the saved model was fitted to this very record, or to a part of it"
    unseen, seen = of(renamed, other), of(other, renamed)
    assert (unseen.seen, seen.seen) == ((), ("renamed",))
    assert not any("was fitted to" in note for note in unseen.notes)
    assert sum(note.startswith(told) for note in seen.notes) == 1
    assert [name for name, _ in seen.fitted_to] == ["one", "other"]


def test_the_correction_of_a_saved_model_was_dropped_by_a_run_without_a_word(tmp_path):
    path = write_record(tmp_path)
    correction = next(one.model for one in fitted(path)[2] if one.model.name == "AESI I")
    told = "the saved model's learnt correction is left out"
    for number, model in enumerate((None, correction)):
        folder = HybridModel(Cell.from_bpx(BPX), correction=model, dt_s=1.0).save(
            tmp_path / f"model_{number}"
        )
        notes = load(experiment(path, cell={"bpx": str(folder), "soc0": SOC0, "start": "declared"})).notes
        assert sum(told in note for note in notes) == number
