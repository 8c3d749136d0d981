"""What options say of single files reaches the record that is meant, and no other."""

from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

from aesi.data.reading import Reading
from aesi.errors import InputError
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.sections import CellConfig, DataConfig, DiscoverConfig
from flows.cli import app
from flows.commands import record_options
from flows.commands.cell import BESIDE_AN_EXPERIMENT, KEYS_OF_DISCOVERY


@pytest.fixture
def files(tmp_path):
    """Two tests of one cell whose names differ behind a point, and two of one name in folders of their own."""
    paths = [
        tmp_path / name for name in ("W8_0.5C.csv", "W8_0.2C.csv", "10degC/drive.csv", "25degC/drive.csv")
    ]
    for k, path in enumerate(paths):
        path.parent.mkdir(exist_ok=True)
        time = np.arange(100.0 + k)
        current = np.where(time < 50, 1.0, 0.0)
        rows = "\n".join(f"{t},{i},{3.7 - 0.05 * i}" for t, i in zip(time, current, strict=True))
        path.write_text(f"time_s,current_a,voltage_v\n{rows}\n")
    return paths


def test_a_record_is_read_up_to_a_time_of_its_own_not_of_its_namesake(files):
    until = record_options.numbers_by_record("--until", ["W8_0.2C.csv=60", f"{files[3]}=80"], files)
    records = record_options.measurements(files, Reading(), None, until)
    assert {record.name: len(record) for record in records} == {
        "W8_0.5C": 100,
        "W8_0.2C": 61,
        "10degC drive": 102,
        "25degC drive": 81,
    }


def test_two_long_files_of_one_test_were_averaged_over_rows_of_their_own_and_no_longer_known_as_one(
    files, monkeypatch
):
    """As in Python, all rows are read; a fit thins them itself."""

    def averaged(record, most):
        raise AssertionError(f"{record.name} was averaged")

    monkeypatch.setattr("aesi.data.read.decimate", averaged)
    assert [len(record) for record in record_options.measurements(files, Reading())] == [100, 101, 102, 103]


@pytest.mark.parametrize("said", ["W8_0.5C", "W8_0.5C.csv", "{folder}/W8_0.5C.csv"])
def test_a_file_is_meant_by_its_path_its_name_or_its_record_s(files, said):
    given = record_options.numbers_by_record(
        "--temperature", [f"{said.format(folder=files[0].parent)}=10"], files
    )
    assert given == {"W8_0.5C": 10.0}


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        (["drive=10"], "2 --data files are called so; give the path of one"),
        (
            ["10degC drive=10", "20degC/drive.csv=20"],
            "no such record among W8_0.5C, W8_0.2C, 10degC drive",
        ),
        (["W8_0.5C=10", "W8_0.5C.csv=20"], "is there twice for W8_0.5C"),
        (["W8_0.5C"], "has to read FILE=NUMBER"),
        (["W8_0.5C=nan"], "--temperature W8_0.5C=nan: has to read FILE=NUMBER"),
    ],
)
def test_a_file_that_is_not_clear_is_asked_about(files, pairs, words):
    with pytest.raises(InputError, match=words):
        record_options.numbers_by_record("--temperature", pairs, files)


def test_a_day_is_that_of_its_file(files):
    assert list(record_options.dates_by_record(["W8_0.2C.csv=2019-05-31"], [Path(f) for f in files])) == [
        "W8_0.2C"
    ]


def test_every_option_that_is_refused_beside_an_experiment_file_has_its_key_named_or_none():
    command = get_command(app).commands["discover"]
    refused = {option.name for option in command.params} - {*BESIDE_AN_EXPERIMENT, "help"}
    assert refused - set(KEYS_OF_DISCOVERY) == {"only", "without", "cycle", "step"}
    sections = {"cell": CellConfig, "data": DataConfig, "discover": DiscoverConfig, "": ExperimentConfig}
    for key in KEYS_OF_DISCOVERY.values():
        section, _, name = key.rpartition(".")
        assert name in sections[section].model_fields, key
