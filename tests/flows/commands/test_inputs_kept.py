"""What a command reads is never written over: by no command, by no file that it writes, from no option."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from lead_effect import OWN

from aesi.pipeline.written import batch_files, calibration_files, discovery_files, discovery_marks
from flows.commands.outputs import check_own


@pytest.fixture
def kept(tmp_path):
    """Writes a file of the user's own below the workspace; `kept()` says whether all are as they were."""
    texts = {}

    def go(*names):
        for name in names:
            texts[tmp_path / name] = f"mine: {name}\n"
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(texts[tmp_path / name])
        return all(path.read_text() == text for path, text in texts.items())

    return go


@pytest.fixture
def saved(cell, tmp_path):
    """Saves the cell as a model, with an effect of the user's own in own.py."""
    from aesi.physics.effects import load_effect
    from aesi.pipeline.product.declared import declared_model

    def go(folder, own=None):
        effects = ()
        if own is not None:
            (tmp_path / own).write_text(OWN)
            effects = (load_effect(tmp_path / own).activate(),)
        return replace(declared_model(cell), effects=effects).save(tmp_path / folder)

    return go


@pytest.mark.parametrize(
    "words",
    [
        "simulate --current i.csv --soc0 0.9 --effect lead --effect-file own.py --out own.py",
        "impedance --soc 0.5 --frequencies 1:10:3 --effect lead --effect-file own.py --out own.py",
        "impedance --soc 0.5 --frequencies f.csv --out f.csv",
        "calibrate --data i.csv --impedance z.json --out z.json",
        "calibrate --data i.csv --fit-impedance z.json --out z.json",
        "calibrate --data new.report.md --out new.json",
        "calibrate --data i.csv --impedance new.report.html --out new.json",
        "calibrate --data i.csv --fit-impedance new.report.json --out new.json",
        "discover --data d/report.html --out d",
        "discover --data i.csv --test d/discovery.json --out d",
        "discover --data i.csv --good d/hypotheses.jsonl --out d",
        "discover --data i.csv --effect-file d/report.html --out d",
        "discover --data d/model/model.json --out d",
        "data convert i.csv --out i.csv",
    ],
)
def test_what_an_option_reads_was_written_over(call, cell, kept, words):
    command, *rest = words.split()
    named = [word for word in rest if "." in word and not word[0].isdigit()]
    kept(*named)
    given = [command, *rest] if command == "data" else [command, "--cell", cell, *rest]
    code, _, err = call(*given)
    assert code == 2
    assert "is a file that is read, and would be lost" in err
    assert kept()


def test_the_cell_of_a_calibration_was_written_over_by_its_report(call, cell, kept, tmp_path):
    kept("i.csv")
    mine = tmp_path / "new.report.json"
    shutil.copy(cell, mine)
    code, _, err = call("calibrate", "--cell", mine, "--data", "i.csv", "--out", "new.json")
    assert code == 2
    assert "new.report.json, which is written beside it, is a file that is read, and would be lost" in err
    assert mine.read_bytes() == Path(cell).read_bytes()


@pytest.mark.parametrize(
    "words",
    [
        "simulate --cell m --current current.csv --soc0 0.9 --out m/lead.py",
        "predict --model m --current current.csv --soc0 0.9 --out m/lead.py",
        "export --cell m --to pybamm --out m/lead.py",
    ],
)
def test_the_effect_that_a_saved_model_names_was_written_over(call, saved, current, words):
    copied = saved("m", own="own.py") / "lead.py"
    before = copied.read_text()
    code, _, err = call(*words.split())
    assert code == 2
    assert "lead.py is a file that is read, and would be lost" in err
    assert copied.read_text() == before


def test_a_new_file_in_the_folder_of_a_model_is_no_file_of_it(call, saved, current, tmp_path):
    model = saved("m")
    (model / "run.csv").write_text("of another day")
    assert (
        call("simulate", "--cell", "m", "--current", current, "--soc0", "0.9", "--out", "m/run.csv")[0] == 0
    )
    assert (model / "run.csv").read_text().startswith("time_s")


@pytest.mark.parametrize("out", [None, "found"])
def test_the_model_that_an_experiment_names_was_written_over(call, saved, tmp_path, out):
    model = saved(Path(out or "runs/mine/discovery") / "model")
    before = {file.name: file.read_bytes() for file in model.iterdir()}
    (tmp_path / "mine.yaml").write_text(
        f"name: mine\ndata: {{kind: files}}\ncell: {{bpx: {model}}}\ndiscover: {{fit: [drive.csv]}}\n"
    )
    code, _, err = call("discover", "mine.yaml", *([] if out is None else ["--out", out]))
    assert code == 2
    assert "is a file that is read, and would be lost" in err
    assert {file.name: file.read_bytes() for file in model.iterdir()} == before


@pytest.mark.parametrize(
    ("table", "row"),
    [
        ("found/summary.csv", "a,../i.csv"),
        ("cells.csv", "a,found/a/report.html"),
        ("cells.csv", "a,found/b/row.json\nb,i.csv"),
        ("cells.csv", "a,found/a/calibrated.bpx.report.md"),
    ],
)
def test_a_table_and_the_records_of_a_batch_were_written_over(call, cell, kept, tmp_path, table, row):
    kept("i.csv", *(name for line in row.split("\n") for name in line.split(",")[1:] if "found" in name))
    (tmp_path / table).parent.mkdir(exist_ok=True)
    (tmp_path / table).write_text(f"name,data\n{row}\n")
    code, _, err = call("batch", table, "--cell", cell, "--out", "found")
    assert code == 2
    assert "which is written there, is a file that is read, and would be lost" in err
    assert kept()
    assert (tmp_path / table).read_text() == f"name,data\n{row}\n"


def test_the_history_that_a_benchmark_is_compared_with_was_written_over(call, tmp_path):
    history = Path(__file__).resolve().parents[3] / "docs" / "benchmarks.json"
    mine = tmp_path / "history.json"
    shutil.copy(history, mine)
    code, _, err = call("bench", "blind", "--set", f"report={mine}", "--compare", mine)
    assert code == 2
    assert f"--set report {mine} is a file that is read, and would be lost" in err
    assert mine.read_bytes() == history.read_bytes()


def test_the_files_of_a_batch_are_those_of_its_cells_and_its_own(tmp_path):
    (tmp_path / "a" / "model").mkdir(parents=True)
    for name in ("model.json", "arrays.npz", "mine.csv"):
        (tmp_path / "a" / "model" / name).write_text("x")
    files = batch_files(tmp_path, ["a"])
    assert {*discovery_files(tmp_path / "a"), *calibration_files(tmp_path / "a" / "calibrated.bpx.json")} < {
        *files
    }
    assert {path.name for path in files if path.parent.name == "model"} == {"model.json", "arrays.npz"}


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("discover --cell CELL --data i.csv --out d", "d/report.html"),
        ("discover --cell CELL --data i.csv --out d", "d/model/mine.json"),
        ("discover mine.yaml --out d", "d/report.html"),
        ("discover mine.yaml", "runs/mine/discovery/report.html"),
        ("candidate 0123abcd --out d", "d/model/model.json"),
        ("batch cells --cell CELL --out d", "d/index.html"),
        ("batch cells --cell CELL --out d", "d/summary.csv"),
        ("batch cells --cell CELL --out d", "d/a/report.html"),
        ("batch cells --cell CELL --out d", "d/a/calibrated.bpx.json"),
        ("calibrate --cell CELL --data i.csv --out new.json", "new.report.html"),
        ("compare mine", "compare.html"),
        ("compare mine --out report.html", "report.html"),
    ],
)
def test_a_file_that_no_earlier_run_had_written_was_replaced(call, cell, kept, tmp_path, words, name):
    kept(name, "cells/a/i.csv")
    (tmp_path / "mine.yaml").write_text(
        f"name: mine\ndata: {{kind: files}}\ncell: {{bpx: {cell}}}\ndiscover: {{fit: [i.csv]}}\n"
    )
    code, _, err = call(*(str(cell) if word == "CELL" else word for word in words.split()))
    assert code == 2
    assert f"{name} is there, was not written by this command, and would be lost" in err.replace("\n", " ")
    assert kept()


def test_what_an_earlier_run_left_may_be_replaced_and_gone_on_with(tmp_path):
    for folder, mark in (("whole", "discovery.json"), ("stopped", "hypotheses.jsonl")):
        out = tmp_path / folder
        out.mkdir()
        for name in ("report.html", mark):
            (out / name).write_text("")
        check_own(out, discovery_files(out), discovery_marks(out))
