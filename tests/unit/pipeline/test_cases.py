"""Cases of the tracer from experiment files."""

import json
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from small_experiment import BPX, SOC0, experiment, write_record

import aesi
from aesi.calibration import Conditions
from aesi.data import read_measurement
from aesi.errors import CellError, ConfigError, DataError, InputError
from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.calibrate import Request, calibrate_files
from aesi.pipeline.discovery import discover as tracing
from aesi.pipeline.discovery.cases import case_of_experiment, case_of_files
from aesi.pipeline.discovery.discover import run_case
from aesi.pipeline.experiment.config import read_experiment
from aesi.pipeline.experiment.load import load
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import Spectrum

EXPERIMENTS = Path(__file__).resolve().parents[3] / "experiments"


def test_the_measured_case_is_judged_where_its_fit_ends(shared_data, monkeypatch):
    monkeypatch.setenv("AESI_DATA", str(shared_data / "measured"))
    case = case_of_experiment(read_experiment(EXPERIMENTS / "measured_nmc.yaml", []))
    assert [m.name for m in case.measurements] == ["C20", "C2", "1C", "drive_cycle"]
    assert case.measurements[0].time_s[-1] > 70_000
    assert case.measurements[-1].time_s[-1] == 4000
    assert case.tests[0].time_s[-1] == 8000


@pytest.mark.parametrize(
    ("experiment", "overrides", "hold"),
    [
        ("measured_nmc", [], "backward"),  # by its data.hold
        ("measured_nmc", ["discover.hold=linear"], "linear"),
        ("measured_hg2_cold", [], None),
        ("measured_hg2_cold", ["data.hold=linear"], "linear"),
    ],
)
def test_the_current_runs_between_rows_as_the_experiment_says_or_else_as_records_show(
    shared_data, monkeypatch, experiment, overrides, hold
):
    monkeypatch.setenv("AESI_DATA", str(shared_data / "measured"))
    case = case_of_experiment(read_experiment(EXPERIMENTS / f"{experiment}.yaml", overrides))
    assert {m.hold for m in (*case.records, *case.tests)} == {hold}


def test_a_discovery_starts_from_a_cell_at_its_state_of_health(tmp_path):
    record = write_record(tmp_path)
    whole, aged = (case_of_files(BPX, [record], soh=soh).declared().cell for soh in (None, 0.9))
    assert aged.capacity_ah == pytest.approx(0.9 * whole.capacity_ah)
    with pytest.raises(CellError, match="a state of health of 90"):
        case_of_files(BPX, [record], soh=90.0)


def test_a_record_that_is_fitted_cannot_judge(tmp_path):
    record = write_record(tmp_path)
    copy = tmp_path / "copy.csv"
    copy.write_bytes(record.read_bytes())
    with pytest.raises(DataError, match="both among the data and the tests; what is fitted cannot judge"):
        case_of_files(BPX, [record], [copy])
    with pytest.raises(DataError, match="is there twice among the data; give it once"):
        case_of_files(BPX, [record, record])


def test_a_discovery_was_judged_by_a_record_of_its_cell_file_without_a_word(tmp_path):
    data, test = write_record(tmp_path), write_record(tmp_path, "test.csv", seed=1)
    calibrated = replace(aesi.Cell.from_bpx(BPX), capacity_shares=(("test", 0.98),))
    cell = tmp_path / "cell.json"
    cell.write_text(json.dumps(calibrated.to_bpx()))
    told = "test: the cell's file was fitted to a record of this name, so that no model has it held out"
    for files, seen in (
        (([data], [test]), ("test",)),
        (([test],), ("test",)),  # whose end is kept back
        (([test], [data]), ()),
        (([data],), ()),
    ):
        case = case_of_files(cell, *files)
        assert case.seen == seen
        assert any(note.startswith(told) for note in case.notes) == bool(seen)
    assert case_of_files(cell, [test], holdout=0.0).seen == ()


def test_a_discovery_was_judged_by_what_its_model_had_been_fitted_to_without_a_word(tmp_path):
    data, test = write_record(tmp_path), write_record(tmp_path, "test.csv", seed=1)
    first = case_of_files(BPX, [data], good=[test])
    folder = HybridModel(first.declared().cell).with_fitted(first.records).save(tmp_path / "model")
    case = case_of_files(folder, [data])
    thinned = case.with_each(
        lambda record: record.take(slice(None, None, 2))
    )  # as a long one is for a search
    for one in (case, thinned):
        assert one.seen == ("drive",)
        (told,) = (note for note in one.notes if "the saved model was fitted to" in note)
        assert told.startswith("drive: the saved model was fitted to this very record")


def test_a_test_that_was_given_twice_counted_twice(tmp_path):
    record, test = write_record(tmp_path), write_record(tmp_path, "test.csv", seed=1)
    with pytest.raises(DataError, match=r"test is there twice among the tests; .* give it once"):
        case_of_files(BPX, [record], [test, test])
    copy = tmp_path / "copy.csv"
    copy.write_bytes(test.read_bytes())
    with pytest.raises(DataError, match="test and copy hold the same rows and are both among the tests"):
        case_of_files(BPX, [record], [test, copy])


def test_good_records_stand_beside_what_is_looked_at(tmp_path, shared_data, monkeypatch):
    record = write_record(tmp_path)
    with pytest.raises(DataError, match="is there twice among the data; give it once"):
        case_of_files(BPX, [record], good=[record])
    monkeypatch.setenv("AESI_DATA", str(shared_data / "measured"))
    overrides = [
        "discover.fit=[drive_cycle]",
        "discover.good=[C2, 1C]",
        "discover.test=[]",
        "discover.until_s=null",
    ]
    case = case_of_experiment(read_experiment(EXPERIMENTS / "measured_nmc.yaml", overrides))
    assert [m.name for m in case.good] == ["C2", "1C"]
    assert [m.name for m in case.records] == ["drive_cycle", "C2", "1C"]


def test_effects_of_the_cell_and_files_with_effects_were_passed_over_in_silence(shared_data, monkeypatch):
    monkeypatch.setenv("AESI_DATA", str(shared_data / "measured"))
    with pytest.raises(ConfigError, match="so that series_resistance would not be in it; leave it out"):
        case_of_experiment(
            read_experiment(EXPERIMENTS / "measured_nmc.yaml", ["cell.effects={series_resistance: {}}"])
        )
    overrides = [
        "discover.fit=[C2]",
        "discover.fit_until_s={}",
        "discover.test=[]",
        "discover.until_s=null",
        "cell.effect_files=[mine.py]",
    ]
    with pytest.raises(InputError, match=f"there is no effect file {EXPERIMENTS / 'mine.py'}"):
        case_of_experiment(read_experiment(EXPERIMENTS / "measured_nmc.yaml", overrides))


def test_a_search_for_what_the_declared_model_has_is_refused(tmp_path):
    """It was a verdict `none`, of a search that had tried nothing."""
    record, model = write_record(tmp_path), tmp_path / "model"
    has = tuple(CATALOGUE[name].activate() for name in ("self_heating", "series_resistance"))
    HybridModel(Cell.from_bpx(BPX), has).save(model)
    with pytest.raises(InputError, match="the declared model has self_heating already, so that none is left"):
        case_of_files(model, [record], only=["self_heating"])
    with pytest.raises(InputError, match="every effect is left out, so that none is left to try"):
        case_of_files(BPX, [record], without=[*CATALOGUE])
    assert case_of_files(model, [record], only=["self_heating"], max_effects=0).kept_back > 0.0
    both = case_of_files(model, [record], only=["film_growth,self_heating"])
    assert "tried alone: film_growth; nothing is said about other effects." in both.restrictions
    # A parameter that was corrected once may still be off.
    assert "series_resistance" in case_of_files(model, [record], only=["series_resistance"]).tried()


def test_what_was_not_tried_is_said_so_that_no_verdict_is_read_as_one_about_it(tmp_path):
    record = write_record(tmp_path)
    assert case_of_files(BPX, [record]).restrictions == ()
    assert case_of_files(BPX, [record], max_effects=1).restrictions == (
        "at most 1 effect is added, as asked; what more effects explain together is not looked for.",
    )
    alone = case_of_files(BPX, [record], only=["film_growth, clock_skew"], without=["series_resistance"])
    assert alone.restrictions == (
        "tried alone: film_growth, clock_skew; nothing is said about other effects.",
        "not tried: series_resistance.",
    )
    (none, at) = case_of_files(BPX, [record], max_effects=0).notes
    assert none.startswith("no effect is tried")
    assert at.endswith(
        "no temperature column; taken at 25 degC, as the cell's file declares; for another one add a column "
        "temperature_degc, or give --column temperature_degc=40."
    )


def test_a_holdout_beside_test_records_was_passed_over_in_silence(tmp_path):
    record, test = write_record(tmp_path), tmp_path / "test.csv"
    test.write_text(record.read_text().replace("3.7", "3.71"))
    case = case_of_files(BPX, [record], [test], holdout=0.4)
    (note,) = case.restrictions
    assert note.startswith("test records are given, so that the holdout of 0.4 is not used")
    assert case.kept_back == 0.0
    assert case_of_files(BPX, [record], [test]).restrictions == ()
    assert case_of_files(BPX, [record], [test], holdout=0.0).restrictions == ()
    assert case_of_files(BPX, [record]).kept_back == 0.3


def test_a_calibration_takes_a_record_once_and_at_a_temperature_of_a_cell(tmp_path):
    record = read_measurement(write_record(tmp_path))
    with pytest.raises(DataError, match="twice among the data"):
        calibrate_files(BPX, [record, record], tmp_path / "new.json")
    with pytest.raises(DataError, match="give records of at least 300 s"):
        calibrate_files(BPX, [record.between(0.0, 100.0)], tmp_path / "new.json")
    five_minutes = record.between(0.0, 301.0)
    nearly = replace(five_minutes, time_s=0.9998 * five_minutes.time_s)
    with pytest.raises(DataError, match=r"lasts 299.94 s, .* at least 300 s"):  # said to last 300
        calibrate_files(BPX, [nearly], tmp_path / "new.json")
    kelvin = Request(Conditions(temperatures_degc={record.name: 298.15}))
    with pytest.raises(InputError, match=f"the temperature of {record.name} = 298.15 degC is outside"):
        calibrate_files(BPX, [record], tmp_path / "new.json", kelvin)


def test_a_posterior_of_too_few_samples_was_refused_after_the_fit(tmp_path, monkeypatch):
    pytest.importorskip("emcee")
    monkeypatch.setattr("aesi.pipeline.calibrate.calibrate", lambda *_, **__: pytest.fail("it was fitted"))
    record = read_measurement(write_record(tmp_path))
    with pytest.raises(InputError, match="--posterior 2: at least 4"):
        calibrate_files(BPX, [record], tmp_path / "new.json", Request(posterior=2))


def test_spectra_that_cannot_be_used_were_told_after_the_fit(tmp_path, monkeypatch):
    monkeypatch.setattr("aesi.pipeline.calibrate.calibrate", lambda *_, **__: pytest.fail("it was fitted"))
    record = read_measurement(write_record(tmp_path))
    percent = Spectrum("z", np.array([1.0]), np.array([1e-3 - 1e-4j]), soc=50.0)
    with pytest.raises(DataError, match="z: its state of charge of 50"):
        calibrate_files(BPX, [record], tmp_path / "new.json", Request(impedance=(percent,)))


def test_runs_of_a_cell_file_that_was_edited_were_taken_for_seeds_of_one_setting(tmp_path):
    own = tmp_path / "mine.bpx.json"
    own.write_bytes(BPX.read_bytes())
    config = experiment(write_record(tmp_path), cell={"bpx": str(own), "soc0": SOC0, "start": "declared"})
    before = load(config).setting
    assert load(config.model_copy(update={"seed": 1})).setting == before
    own.write_text(
        own.read_text().replace('"Nominal cell capacity [A.h]": 30.0', '"Nominal cell capacity [A.h]": 29.0')
    )
    assert load(config).setting != before


def test_an_experiment_has_a_cell_at_its_state_of_health(tmp_path):
    cell = {"bpx": str(BPX), "soc0": SOC0, "start": "declared"}
    record = write_record(tmp_path)
    whole, aged = (load(experiment(record, cell=c)).cell for c in (cell, cell | {"soh": 0.9}))
    assert aged.capacity_ah == pytest.approx(0.9 * whole.capacity_ah)


def test_an_experiment_has_a_cell_of_the_day_of_its_test(tmp_path, dated_file):
    dated = dated_file(BPX, 0.9, 20180111)
    case = case_of_files(dated, [write_record(tmp_path)], soh=date(2018, 1, 6))
    assert "the cell as of 2018-01-06: 0.950 of its file's capacity" in " ".join(case.notes)
    cell = {"bpx": str(dated), "soc0": SOC0, "start": "declared"}
    record = write_record(tmp_path)
    whole, aged = (load(experiment(record, cell=c)) for c in (cell, cell | {"soh": date(2018, 1, 6)}))
    assert aged.cell.capacity_ah == pytest.approx(0.95 * whole.cell.capacity_ah)
    assert "the cell as of 2018-01-06: 0.950 of its file's capacity" in " ".join(aged.notes)


def test_python_was_not_told_what_share_a_day_stands_for(tmp_path, dated_file, monkeypatch):
    kept = []
    monkeypatch.setattr("aesi.pipeline.api.run_case", lambda case, *rest: kept.append(case))
    aesi.discover(dated_file(BPX, 0.9, 20180111), write_record(tmp_path), soh=date(2018, 1, 6))
    assert "the cell as of 2018-01-06: 0.950 of its file's capacity" in " ".join(kept[0].notes)
    assert kept[0].declared().soh == pytest.approx(0.95)


def test_a_discovery_of_an_experiment_advised_options_that_it_does_not_have(tmp_path, monkeypatch):
    @dataclass(frozen=True)
    class Found:
        warnings: tuple[str, ...]
        notes: tuple[str, ...] = ("drive starts under 1 A; give --soc0 if it is known.",)

    found = Found(("drive: its sensor is at fault (--column temperature_degc= leaves it out).",))
    monkeypatch.setattr(tracing, "discover", lambda *args, **options: found)
    record = write_record(tmp_path)
    settings = experiment(record, discover={"fit": [str(record)]})
    of_experiment = run_case(case_of_experiment(settings))
    (told,), (start,) = of_experiment.warnings, of_experiment.notes
    assert told.endswith("leaves it out) (in an experiment file: data.columns).")
    assert start.endswith("if it is known (in an experiment file: cell.soc0).")
    assert run_case(case_of_files(BPX, [record])) == found


def test_a_record_of_another_cell_was_searched_where_an_experiment_names_it(tmp_path):
    """Three hours at C/3 of a cell of 2.9 Ah, with the file of one of 30 Ah, as the options refuse it."""
    time_s = np.arange(0.0, 10_800.0, 60.0)
    current_a = np.where(time_s < 600.0, 0.0, 0.9)
    volts = 4.1 - 0.3 * np.cumsum(current_a) * 60.0 / 3600.0 - 0.03 * current_a
    rows = np.column_stack([time_s, current_a, volts])
    np.savetxt(tmp_path / "small.csv", rows, delimiter=",", header="time_s,current_a,voltage_v", comments="")
    text = f"name: a\ndata: {{kind: files}}\ncell: {BPX}\ndiscover: {{fit: [small.csv]}}\n"
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(
        DataError, match=r"the cell file is another cell's.* \(in an experiment file: cell\.soh\)"
    ):
        case_of_experiment(read_experiment(tmp_path / "a.yaml"))
