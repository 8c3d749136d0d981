"""The command line: exit codes, one sentence an error, and what each command leaves."""

import errno
import json
import os
import re
import subprocess
import sys
from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import aesi
from aesi.errors import InputError
from aesi.pipeline.product.hybrid import HybridModel
from flows import cli
from flows.commands.options import day, priors
from flows.commands.record_options import dates_by_record

LG_M50 = str(Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json")
SIMULATE = ("simulate", "--cell", LG_M50, "--current", "i.csv", "--out", "o.csv")
DISCOVER = ("discover", "--cell", LG_M50, "--data", "a.csv", "--test", "t.csv", "--out", "found")
CALIBRATE = ("calibrate", "--cell", LG_M50, "--data", "d.csv", "--out", "n.json")


def test_the_version_is_printed(call):
    assert call("--version")[:2] == (0, "aesi 0.1.0\n")


@pytest.mark.parametrize(
    "arguments",
    [["fly"], ["run"], ["run", "a", "b"], ["simulate"], ["simulate", "--cell"], ["--nope"]],
)
def test_usage_errors_are_exit_code_2(call, arguments):
    code, out, err = call(*arguments)
    assert code == 2
    assert out == ""
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "none.yaml"], "there is no such experiment file"),
        (["effects", "self_heatin"], "did you mean 'self_heating'?"),
        (["bench", "nothing"], "there is no benchmark 'nothing'"),
        (["discover"], "give --cell and --data and --out, or an experiment file."),
        (["discover", "--data", "a.csv"], "give --cell and --out."),
        (["discover", "--data", "a.csv", "--cell", LG_M50], "give --out."),
        (
            ["simulate", "--cell", LG_M50, "--current", "a.csv", "--out", "o.csv", "--model", "found/model"],
            "--model: 'found/model' is not one of 'espm', 'dfn'; a saved model is given with --cell.",
        ),
        (
            ["simulate", "--temperature", "20"],
            "simulate has no option --temperature; did you mean --column temperature_degc=...? See ",
        ),
        (["discover", "--temp=20"], "did you mean --column temperature_degc=...?"),
        (["calibrate", "--temp", "a.csv=20"], "did you mean --temperature?"),
        (["impedance", "--temperature", "20"], "did you mean --temperature-degc?"),
        (["run", "none.yaml", "--workers", "3"], "run has no option --workers. See "),
        (["simulate", "--data", "a.csv"], "simulate has no option --data; did you mean --current? See "),
        (["discover", "--current", "a.csv"], "discover has no option --current; did you mean --data? See "),
        (["calibrate", "--measured", "a.csv"], "calibrate has no option --measured. See "),
        (["compare", "--runs", "a"], "compare has no option --runs; did you mean runs without --? See "),
        (["predict", "--cell", "none", "--current", LG_M50, "--out", "o.csv"], "read"),
        (["simulate", "--cell", "no.json", "--current", "no.csv", "--out", "o.csv"], "no.csv"),
        (["tables", "nothing"], "no experiment 'nothing' is tracked"),
        (["discover", "e.yaml", "--max-effects", "1"], "there, or --set discover.max_effects=VALUE"),
        (
            ["discover", "e.yaml", "--unit", "current_a=mA"],
            "--unit is not read beside an experiment file; give data.units there",
        ),
        (["discover", "e.yaml", "--only", "leakage_current"], "give --only beside --cell and --data instead"),
        (
            ["discover", "--cell", "c.json", "--data", "d.csv", "--out", "found", "--set", "seed=1"],
            "--set changes a key of an experiment file, and none is given",
        ),
        (["predict", "--model", "m", "--current", "d.csv", "--out", "o.xlsx"], "what is written is a CSV"),
        (
            [
                "predict",
                "--model",
                "m",
                "--current",
                "d.csv",
                "--out",
                "o.csv",
                "--soc0",
                "0.8",
                "--soc0-sd",
                "2",
            ],
            "--soc0-sd 2: how far a state of charge may be off is a share of the capacity, from 0 (exact)",
        ),
        (["calibrate", "--cell", LG_M50, "--data", "d.csv", "--out", "o.csv"], "what is written is BPX"),
        (["batch", "cells", "--out", "found", "--address", "tcp://here:1"], "give --runner dask beside it"),
        (["ui", "--storage", "sqlite:///s.db"], "give --optuna beside it"),
        (["ui", "--optuna", "--uri", "sqlite:///s.db"], "leave it out beside --optuna"),
        (["ui", "--optuna", "--prefect"], "start one at a time"),
        (
            ["data", "convert", "a.csv", "--out", "b.csv", "--unit", "time_s=h", "--unit", "time_s=min"],
            "--unit is there twice for time_s",
        ),
        (
            ["impedance", "--cell", LG_M50, "--soc", "0.5", "--frequencies", "1:10", "--out", "z.csv"],
            "--frequencies 1:10: has to read LOW:HIGH:N",
        ),
        (
            ["impedance", "--cell", LG_M50, "--soc", "50", "--frequencies", "1:10:3", "--out", "z.csv"],
            "--soc 50: a state of charge is a share of the capacity",
        ),
        (["discover", "--holdout", "0.95"], "--holdout 0.95: it has to be less than or equal to 0.9.\n"),
        (["discover", "--max-effects", "x"], "--max-effects x: it has to be a valid integer.\n"),
        (["tables", "x", "--format", "xls"], "--format: 'xls' is not one of 'md', 'tex', 'csv'.\n"),
        ([*SIMULATE, "--soh", "95"], "--soh 95: a state of health of 95: it is the share"),
        ([*SIMULATE, "--soh", "new"], "--soh new: a state of health of 'new': give the share"),
        ([*SIMULATE, "--soc0", "0.9", "--soc0", "0.8"], "--soc0 is there twice; give it once"),
        (
            [*SIMULATE, "--soc0", "i.csv=0.9"],
            "--soc0 i.csv=0.9: it has to be a valid number; one record is given, and its state of charge is a number "
            "from 0 (empty) to 1 (full), without FILE=.\n",
        ),
        (
            ["impedance", "--cell", LG_M50, "--soc", "half", "--frequencies", "1:10:3", "--out", "z.csv"],
            "--soc half: it has to be a valid number; a state of charge is a share of the capacity",
        ),
        (
            [*DISCOVER, "--soc0", "0.9", "--soc0", "0.8"],
            "--soc0 is there twice for all records (0.9, 0.8); give",
        ),
        ([*DISCOVER, "--soc0", "a=0.9", "--soc0", "a.csv=0.8"], "--soc0 is there twice for a; give it once"),
        ([*DISCOVER, "--soc0", "full"], "--soc0 full: has to read NUMBER or FILE=NUMBER."),
        ([*DISCOVER, "--soc0", "b.csv=0.9"], "--soc0 b.csv=...: there is no such record among a, t."),
        ([*DISCOVER, "--soc0", "t.csv=90"], "--soc0 t = 90: a state of charge is a share of the capacity"),
        (["data", "convert", "a.csv", "--out", "b.csv", "--out", "c.csv"], "--out is there twice"),
        ([*SIMULATE, "--effect", "series_resistance:"], "'' has to read parameter=number"),
        (
            [*SIMULATE, "--effect", "series_resistance:resistance_ohm=1e-3,resistance_ohm=2e-3"],
            "resistance_ohm is there twice; give it once",
        ),
        ([*SIMULATE[:-1], "-"], "--out -: name a place to write to; the standard output is /dev/stdout"),
        (
            [*SIMULATE[:-1], "o.csv.zip"],
            "--out o.csv.zip: what is written is a CSV; give a name that ends in",
        ),
        (["data", "get", "lg_m50t_w8", "--out", "-"], "--out -: name a place"),
        ([*CALIBRATE, "--data", "./d.csv"], "--data d.csv is there twice; give it once"),
        ([*CALIBRATE, "--impedance", "z.csv"], "There is no file z.csv"),
        ([*CALIBRATE, "--temperature", "e.csv=10"], "--temperature e.csv=...: there is no such record"),
        ([*CALIBRATE, "--prior", "contact.resistance=nan:0.1"], "VALUE has to be a finite number, and SD,"),
        ([*CALIBRATE, "--prior", "contact.resistance=0.1:0"], "its standard deviation, one above 0"),
        ([*CALIBRATE, "--cut-offs", "2.5-4.2"], "--cut-offs 2.5-4.2: has to read LOWER:UPPER, in V"),
        ([*CALIBRATE, "--cut-offs", "2.5:inf"], "--cut-offs 2.5:inf: has to read LOWER:UPPER, in V"),
        ([*CALIBRATE, "--body", "18.4"], "--body 18.4: has to read DIAMETERxHEIGHT of a cylinder or AxBxC"),
        ([*CALIBRATE, "--body", "18.4xlong"], "in mm, such as 18.4x65.0."),
        (["run", "."], ". is a folder; give an experiment file"),
        (
            ["run", "e.yaml", "--set", "seed=1", "--set", "seed=2"],
            "--set is there twice for seed; give it once",
        ),
        (
            ["worker", "e.yaml", "--set", "a.b=1", "--set", "a.b=2"],
            "--set is there twice for a.b; give it once",
        ),
        (["discover", "e.yaml", "--set", "seed=1", "--set", "seed =2"], "--set is there twice for seed"),
        (
            ["bench", "cells", "--set", "only=a", "--set", "only=b"],
            "--set is there twice for only; give it once",
        ),
        (["bench", "cells", "--compare", "none.json"], "--compare none.json: there is no such file."),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(call, tracked, arguments, words):
    code, _, err = call(*arguments)
    assert code == 2
    assert words in err
    assert err.startswith("aesi: ")
    assert err.count("\n") == 1


def test_a_bad_environment_variable_was_blamed_on_an_option_that_nobody_gave(call, monkeypatch):
    monkeypatch.setenv("AESI_PREFECT", "foo")
    code, _, err = call("run", "x.yaml")
    assert code == 2
    assert err == "aesi: the environment variable AESI_PREFECT = foo: it has to be true or false.\n"


@pytest.mark.parametrize("name", ["deep.yaml", "deep.json"])
def test_a_file_nested_without_end_is_one_sentence(call, tmp_path, current, name):
    path = tmp_path / name
    path.write_text("[" * 5000 + "]" * 5000)
    simulate = ("simulate", "--cell", path, "--current", current, "--soc0", 0.5, "--out", tmp_path / "o.csv")
    code, _, err = call(*(("run", path) if name == "deep.yaml" else simulate))
    assert code == 2
    assert err.startswith("aesi: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("command", "read", "out"),
    [
        ("simulate", "--current", "current"),
        ("simulate", "--cell", "cell"),
        ("calibrate", "--cell", "cell"),
        ("calibrate", "--data", "current"),
        ("export", "--cell", "cell"),
    ],
)
def test_a_file_that_is_read_is_never_written_over(call, cell, current, tmp_path, command, read, out):
    mine = {"cell": tmp_path / "mine.json", "current": tmp_path / "mine.csv"}
    mine["cell"].write_bytes(Path(cell).read_bytes())
    mine["current"].write_bytes(Path(current).read_bytes())
    before = mine[out].read_bytes()
    given = {"--cell": mine["cell"]}
    given |= {"export": {"--to": "bpx"}, "simulate": {"--current": mine["current"]}}.get(
        command, {"--data": mine["current"]}
    )
    assert given[read] == mine[out]
    code, _, err = call(command, *(word for pair in given.items() for word in pair), "--out", mine[out])
    assert code == 2
    assert "is a file that is read, and would be lost; give another name" in err
    assert mine[out].read_bytes() == before


def test_the_file_beside_an_export_is_never_the_one_that_is_read(call, cell, tmp_path):
    mine = tmp_path / "mine.bpx.json"
    mine.write_bytes(Path(cell).read_bytes())
    code, _, err = call("export", "--cell", mine, "--to", "pybamm", "--out", tmp_path / "mine.py")
    assert code == 2
    assert "mine.bpx.json, which is written beside it, is a file that is read, and would be lost" in err
    assert mine.read_bytes() == Path(cell).read_bytes()
    assert not (tmp_path / "mine.py").exists()


def test_what_a_file_holds_in_its_own_section_was_said_not_to_be_in_it(call, tmp_path):
    cell = Path(LG_M50).with_name("panasonic_ncr18650pf.bpx.json")
    code, _, err = call("export", "--cell", cell, "--to", "bpx", "--out", tmp_path / "mine.json")
    assert code == 0
    assert "Lost to other tools: double layers: in the section User-defined, which they do not read." in err


def test_the_file_beside_an_export_replaced_one_that_nobody_named(call, cell, tmp_path):
    export = ("export", "--cell", cell, "--to", "pybamm", "--out", tmp_path / "mine.py")
    mine = tmp_path / "mine.bpx.json"
    mine.write_text("of another day")
    code, _, err = call(*export)
    assert code == 2
    assert f"{mine}, which is written beside mine.py, is there and holds something else" in err
    assert mine.read_text() == "of another day"
    assert not (tmp_path / "mine.py").exists()
    mine.unlink()
    assert call(*export)[0] == call(*export)[0] == 0  # its own files are written anew
    (tmp_path / "mine.py").unlink()
    assert call(*export)[0] == 0  # as after --to bpx: the file is the one that would be written


@pytest.mark.parametrize(
    ("command", "out"),
    [
        (("export", "--to", "bpx", "--cell"), "found/model/cell.bpx.json"),
        (("discover", "--data", "drive.csv", "--cell"), "found"),
    ],
)
def test_a_model_that_is_read_was_written_over(call, cell, tmp_path, command, out):
    from aesi.pipeline.product.declared import declared_model

    model = declared_model(Path(cell)).save(tmp_path / "found" / "model")
    before = {file.name: file.read_bytes() for file in model.iterdir()}
    code, _, err = call(*command, model, "--out", tmp_path / out)
    assert code == 2
    assert "would be lost" in err
    assert {file.name: file.read_bytes() for file in model.iterdir()} == before


@pytest.mark.parametrize(
    "command", [("candidate", "0123abcd"), ("discover", "--cell", LG_M50, "--data", "drive.csv")]
)
def test_the_results_of_a_run_were_written_over_by_another_command(call, tmp_path, command):
    run = tmp_path / "runs" / "smoke" / "0123abcd"
    (run / "model").mkdir(parents=True)
    (run / "summary.json").write_text("{}")
    code, _, err = call(*command, "--out", run)
    assert code == 2
    assert f"--out {run} holds the results of a run (summary.json), whose model would be lost" in err


def test_a_batch_with_a_cell_called_model_was_taken_for_a_run_when_it_went_on(tmp_path):
    from flows.commands.outputs import check_folder

    (tmp_path / "model").mkdir()
    for name in ("summary.csv", "summary.json", "index.html"):
        (tmp_path / name).write_text("")
    check_folder(tmp_path)


@pytest.mark.parametrize(
    ("command", "made", "words"),
    [
        ("simulate", "folder", "is a folder; name the file to write"),
        ("calibrate", "folder", "is a folder; name the file to write"),
        ("discover", "file", "is a file; name a folder"),
        ("discover", "file/below", "file: Not a directory); name another place"),
        ("simulate", "closed/run.csv", "closed: Permission denied); name another place"),
        ("calibrate", "closed/new/cell.json", "closed: Permission denied); name another place"),
        ("discover", "closed", "closed: Permission denied); name another place"),
        ("calibrate", "there.json", "there.json is there and may not be written over"),
    ],
)
def test_what_cannot_be_written_is_told_before_anything_is_computed(
    call, cell, current, tmp_path, monkeypatch, command, made, words
):
    for name in ("folder", "closed"):
        (tmp_path / name).mkdir()
    for name in ("file", "there.json"):
        (tmp_path / name).write_text("kept")
    opened, closed = os.open, tmp_path / "closed"

    def refusing(path, *how, **more):
        if (
            closed in Path(path).parents
        ):  # whatever its mode says: a superuser and a server's disk do not go by it
            raise PermissionError(13, "Permission denied", str(path))
        return opened(path, *how, **more)

    monkeypatch.setattr(os, "open", refusing)
    there = tmp_path / "there.json"
    monkeypatch.setattr(os, "access", lambda path, mode: not (mode & os.W_OK and Path(path) == there))
    before = sorted(tmp_path.rglob("*"))
    read = "--current" if command == "simulate" else "--data"
    code, _, err = call(command, "--cell", cell, read, current, "--out", tmp_path / made)
    assert code == 2
    assert words in err
    assert err.startswith("aesi: ")  # not even the line that it is reading
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "file").read_text() == there.read_text() == "kept"


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (
            ("compare", "mine", "--out"),
            "drive.csv: what is written is a page; give a name that ends in .html",
        ),
        (("tables", "mine", "--figures"), "--figures drive.csv is a file; name a folder"),
    ],
)
def test_a_page_over_a_record_and_figures_into_it_were_not_refused(call, tracked, command, words):
    (tracked / "drive.csv").write_text("kept")
    code, _, err = call(*command, "drive.csv")
    assert code == 2
    assert words in err
    assert (tracked / "drive.csv").read_text() == "kept"


def test_a_folder_given_for_a_record_was_told_as_a_file_that_would_be_lost(call, tmp_path):
    (tmp_path / "records").mkdir()
    for name in ("old.csv", "new.csv"):
        code, _, err = call("data", "convert", tmp_path / "records", "--out", tmp_path / "records" / name)
        assert code == 2
        assert err == f"aesi: {tmp_path}/records is a folder; give one file of it.\n"
        (tmp_path / "records" / "new.csv").write_text("kept")
    assert (tmp_path / "records" / "new.csv").read_text() == "kept"


@pytest.mark.parametrize("option", ["--cell", "--current"])
def test_a_folder_around_the_output_was_told_as_a_file_that_would_be_lost(
    call, cell, current, tmp_path, option
):
    (tmp_path / "o.csv").write_text("kept")
    given = {"--cell": cell, "--current": current} | {option: tmp_path}
    code, _, err = call(
        "simulate", *(word for pair in given.items() for word in pair), "--out", tmp_path / "o.csv"
    )
    assert code == 2
    assert "holds no model.json, so it is no model" in err or f"{tmp_path} is a folder" in err
    assert "would be lost" not in err


@pytest.mark.parametrize(
    "command",
    [
        ("simulate", "--current", "i.csv"),
        ("impedance", "--soc", "0.5", "--frequencies", "1:10:3"),
        ("impedance", "--soc", "0.5", "--frequencies", "1:10:3", "--effect", "double_layer"),
    ],
)
def test_an_effect_file_that_no_effect_names_was_ignored_without_a_word(call, cell, tmp_path, command):
    (tmp_path / "mine.py").write_text(
        '"""Nothing."""\nfrom aesi.physics import Effect\n'
        'EFFECT = Effect("nothing", "physics", __doc__, on_model=lambda m: m)\n'
    )
    code, _, err = call(*command, "--cell", cell, "--out", "o.csv", "--effect-file", tmp_path / "mine.py")
    assert code == 2
    assert "not simulated unless it is named; add --effect nothing, or leave the file out" in err


@pytest.mark.parametrize("out", ["cells", "cells/found"])
def test_results_of_a_batch_were_read_as_a_cell_the_next_time(call, tmp_path, out):
    (tmp_path / "cells" / "a").mkdir(parents=True)
    code, _, err = call("batch", "cells", "--cell", LG_M50, "--out", out)
    assert code == 2
    assert (
        err
        == f"aesi: --out {out} lies in cells, whose subfolders are read as cells; name a folder beside it.\n"
    )
    assert not (tmp_path / "cells" / "found").exists()


@pytest.mark.parametrize(
    ("why", "home"),
    [(errno.EACCES, "."), (errno.EPERM, "."), (errno.EROFS, "."), (errno.ENOTDIR, "file/home")],
)
def test_a_workspace_that_may_not_be_written_to_says_where_else_it_can_be(
    call, monkeypatch, tmp_path, why, home
):
    (tmp_path / "file").write_text("kept")

    def refused(*_):
        raise OSError(why, os.strerror(why), str(tmp_path / home / ".aesi"))

    monkeypatch.setenv("AESI_HOME", str(tmp_path / home))
    monkeypatch.setattr("aesi.physics.effects.known_effects", refused)
    code, _, err = call("effects", "self_heating")
    assert code == 1
    assert err.endswith("or in the one that AESI_HOME names.\n")


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        (
            "--prior",
            "foo=1:0.1",
            "no such parameter in this fit. There are negative.capacity, positive.capacity,",
        ),
        ("--posterior", "2", "--posterior 2: at least 4 samples"),
        ("--cut-offs", "4.2:2.5", "the lower cut-off (4.2 V) has to be"),
        ("--cut-offs", "2500:4200", "the upper cut-off is 4200 V; one of them is in another unit"),
        ("--body", "0.0184x0.065", "a body of (0.0184, 0.065) mm: give diameter and height of a cylinder"),
        ("--mass", "0.047", "the mass is in g"),
        ("--title", " ", "--title is empty; give the cell a name, or leave it out"),
    ],
)
def test_what_no_fit_can_be_asked_for_was_told_after_it_was_announced(
    call, cell, tmp_path, option, value, words
):
    if option == "--posterior":
        pytest.importorskip("emcee")
    code, _, err = call(
        "calibrate", "--cell", cell, "--data", "none.csv", "--out", tmp_path / "n.json", option, value
    )
    assert code == 2
    assert words in err
    assert "Fitting" not in err


def test_a_temperature_in_kelvin_is_asked_about(call, cell, tmp_path):
    code, _, err = call(
        "impedance",
        *("--cell", cell, "--soc", 0.5, "--frequencies", "0.1:10:5"),
        *("--temperature-degc", 298.15, "--out", tmp_path / "z.csv"),
    )
    assert code == 2
    assert "in kelvin? 298.15 K is 25 degC" in err
    assert not (tmp_path / "z.csv").exists()


def test_the_range_of_an_impedance_was_that_of_its_real_part_without_a_word(call, cell, tmp_path):
    out = tmp_path / "z.csv"
    code, _, err = call(
        "impedance", "--cell", cell, "--soc", 0.5, "--frequencies", "1e-5:100:9", "--out", out
    )
    assert code == 0, err
    table = pd.read_csv(out)
    size = 1e3 * np.hypot(table.z_real_ohm, table.z_imag_ohm)
    assert f"9 frequencies, |Z| {size.min():.4g} to {size.max():.4g} mOhm" in err


def test_days_of_records_are_read_by_record():
    file = Path("folder/pulses.csv.gz")
    assert dates_by_record([f"{file}=2017-03-11"], [file]) == {"pulses": date(2017, 3, 11)}
    with pytest.raises(InputError, match="has to read FILE=YYYY-MM-DD"):
        dates_by_record(["pulses.csv=yesterday"], [file])
    assert day("--as-of", "2017-03-11") == date(2017, 3, 11)
    with pytest.raises(InputError, match="has to read YYYY-MM-DD"):
        day("--as-of", "yesterday")


def test_what_is_known_of_parameters_is_read_by_name():
    assert priors(["contact.resistance=0.0134:0.001"]) == {"contact.resistance": (0.0134, 0.001)}
    for text in ("contact.resistance=0.0134", "0.0134:0.001", "contact.resistance=a:b"):
        with pytest.raises(InputError, match=f"--prior {text}: has to read NAME=VALUE:SD"):
            priors([text])
    for text in ("a=1:inf", "a=nan:1", "a=1:-1"):
        with pytest.raises(InputError, match=f"--prior {text}: VALUE has to be a finite number, and SD"):
            priors([text])
    with pytest.raises(InputError, match="--prior is there twice for a; give it once"):
        priors(["a=1:1", "a=2:1"])


def test_a_bug_is_exit_code_1_without_a_traceback(call, monkeypatch):
    def broken(*_):
        raise RuntimeError("odd\nand more")

    monkeypatch.setattr("flows.jobs.worker.read_experiment", broken)
    code, _, err = call("worker", "x.yaml")
    assert code == 1
    assert err == "aesi: unexpected RuntimeError: odd (AESI_DEBUG=1 shows where).\n"


def test_simulate_writes_voltage_and_states(call, cell, current, tmp_path):
    code, _, err = call(
        "simulate", "--cell", cell, "--current", current, "--out", tmp_path / "o/run.csv", "--soc0", 0.6
    )
    assert code == 0, err
    assert "run.csv: 600 rows over 599 s, 3." in err  # a time in another unit is seen at once
    table = pd.read_csv(tmp_path / "o/run.csv")
    assert {"time_s", "current_a", "voltage_v", "c_sp", "c_sn", "c_e0", "c_eL", "soc"} <= set(table)
    assert len(table) == 600
    assert table["soc"][0] == pytest.approx(0.6, abs=1e-3)


def test_a_record_that_the_model_cannot_follow_left_the_command_line_with_nothing(
    call, cell, current, tmp_path
):
    simulate = ("simulate", "--cell", cell, "--current", tmp_path / "i.csv", "--out", tmp_path / "o.csv")
    hard = 40.0 * pd.read_csv(current).current_a.abs()
    pd.read_csv(current).assign(current_a=hard).to_csv(tmp_path / "i.csv", index=False)
    code, _, err = call(*simulate, "--soc0", 0.6)
    assert code == 1
    assert "let it run on: aesi simulate --run-on" in err
    code, _, err = call(*simulate, "--soc0", 0.6, "--run-on")
    assert code == 0, err
    table = pd.read_csv(tmp_path / "o.csv")
    ran_out_s = table.time_s[table.depleted.to_numpy().argmax()]
    assert 0.0 < ran_out_s < table.time_s.iloc[-1]
    words = (
        f"runs empty or full in this model at {ran_out_s:g} s. From then on kinetics are held at the limit"
    )
    assert f"{words}, open-circuit potentials are extrapolated by 10 V per unit of stoichiometry" in err
    whole = table.voltage_v[table.depleted == 0.0]
    assert f"{whole.min():.3f} to {whole.max():.3f} V until it ran out at {ran_out_s:g} s, " in err


def test_a_prediction_that_runs_empty_advised_an_option_that_the_command_lacks(call, cell, current, tmp_path):
    folder = HybridModel(aesi.Cell.from_bpx(cell)).save(tmp_path / "model")
    hard = 40.0 * pd.read_csv(current).current_a.abs()
    pd.read_csv(current).assign(current_a=hard).to_csv(tmp_path / "i.csv", index=False)
    predict = ("predict", "--model", folder, "--current", tmp_path / "i.csv", "--out", tmp_path / "o.csv")
    code, _, err = call(*predict, "--soc0", 0.6)
    assert code == 1
    assert "run-on" not in err
    assert "on_depletion" not in err
    assert "or end the record before that (--to-s on the command line)." in err
    first_s = min(float(at) for at in re.findall(r"at ([\d.]+) s", err))
    code, _, err = call(*predict, "--soc0", 0.6, "--to-s", first_s - 1.0)
    assert code == 0, err


def test_the_temperature_of_a_simulated_file_was_not_read_again(call, cell, current, tmp_path):
    warm, own, plain, again = (tmp_path / f"{name}.csv" for name in ("warm", "own", "plain", "again"))
    pd.read_csv(current).assign(temperature_degc=40.0).to_csv(tmp_path / "i.csv", index=False)
    simulate = ("simulate", "--cell", cell, "--soc0", 0.8)
    assert call(*simulate, "--current", tmp_path / "i.csv", "--out", warm)[0] == 0
    assert call(*simulate, "--current", current, "--out", own, "--self-heating")[0] == 0
    assert call(*simulate, "--current", current, "--out", plain)[0] == 0
    assert np.all(pd.read_csv(warm).temperature_degc == 40.0)
    table = pd.read_csv(own)
    assert np.allclose(table.temperature_degc, table.temperature_k - 273.15)
    assert "temperature_degc" not in pd.read_csv(plain)  # it is that of the cell's file
    assert call(*simulate, "--current", warm, "--out", again)[0] == 0
    assert np.allclose(pd.read_csv(again).voltage_v, pd.read_csv(warm).voltage_v)


def test_a_profile_with_other_headers_is_told_only_of_columns_that_it_has(call, cell, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("Time [s],I [A]\n0,0\n1,1\n")
    code, _, err = call("simulate", "--cell", cell, "--current", path, "--out", tmp_path / "o.csv")
    assert code == 2
    assert err.endswith("It has: 'Time [s]', 'I [A]'.\n")


def test_what_the_reader_did_to_a_profile_is_said(call, cell, current, tmp_path):
    arguments = ("simulate", "--cell", cell, "--current", current, "--out", tmp_path / "o.csv", "--soc0", 0.6)
    code, _, err = call(*arguments, "--sign", "charge-positive")
    assert code == 0, err
    assert f"{current.name}: The current was declared positive on charge; its sign was turned." in err


def test_an_effect_of_the_catalogue_can_be_added(call, cell, current, tmp_path):
    arguments = ("simulate", "--cell", cell, "--current", current, "--soc0", 0.6, "--out")
    call(*arguments, tmp_path / "a.csv")
    code, _, err = call(*arguments, tmp_path / "b.csv", "--effect", "series_resistance:resistance_ohm=1e-3")
    assert code == 0, err
    a, b = (pd.read_csv(tmp_path / name) for name in ("a.csv", "b.csv"))
    assert np.allclose(a["voltage_v"] - b["voltage_v"], 1e-3 * a["current_a"], atol=1e-6)


def test_a_state_of_health_makes_the_same_charge_a_larger_share(call, cell, current, tmp_path):
    arguments = ("simulate", "--cell", cell, "--current", current, "--soc0", 0.6, "--out")
    call(*arguments, tmp_path / "a.csv")
    code, _, err = call(*arguments, tmp_path / "b.csv", "--soh", 0.8)
    assert code == 0, err
    a, b = (pd.read_csv(tmp_path / name)["soc"].to_numpy() for name in ("a.csv", "b.csv"))
    assert np.allclose(0.8 * (b - b[0]), a - a[0], atol=1e-6)
    code, _, err = call(*arguments, tmp_path / "c.csv", "--soh", 80)
    assert code == 2
    assert "a state of health of 80" in err


def test_a_state_of_health_is_that_of_the_day_of_a_test(call, cell, dated_file, current, tmp_path):
    arguments = (
        "simulate",
        "--cell",
        dated_file(cell, 0.8, 20180131),
        "--current",
        current,
        "--soc0",
        0.6,
        "--out",
    )
    for name, soh in (("share", 0.9), ("day", "2018-01-16")):
        code, _, err = call(*arguments, tmp_path / name, "--soh", soh)
        assert code == 0, err
    assert "the cell as of 2018-01-16: 0.900 of its file's capacity" in err
    assert (tmp_path / "day").read_text() == (tmp_path / "share").read_text()
    code, _, err = call(*arguments, tmp_path / "c.csv", "--soh", "2018-02-01")
    assert code == 2
    assert "knows its cell from 2018-01-01 to 2018-01-31" in err


def test_without_a_voltage_the_start_has_to_be_given(call, cell, current, tmp_path):
    code, _, err = call("simulate", "--cell", cell, "--current", current, "--out", tmp_path / "o.csv")
    assert code == 2
    assert "give --soc0" in err


def test_the_discretisation_of_the_model_was_listed_as_a_fault_of_an_instrument(call):
    _, out, _ = call("effects")
    kinds = dict(line.split()[:2] for line in out.splitlines())
    assert kinds["numerical_error"] == "numerics"
    assert kinds["voltage_sensor_offset"] == "instrument"


def test_effects_lists_and_shows(call):
    code, out, _ = call("effects")
    assert code == 0
    assert {"self_heating", "ocv_hysteresis", "clock_skew"} <= {line.split()[0] for line in out.splitlines()}
    code, out, _ = call("effects", "series_resistance")
    assert "resistance_ohm [ohm]" in out
    assert "Source: " in out
    # said once, not "Holds: Leaves out"
    assert "\nLeaves out its dependence on temperature. Holds where the drop follows" in out


def test_data_lists_sets(call):
    code, out, _ = call("data", "list")
    assert code == 0
    assert "about_energy_nmc" in out


def test_lists_of_files_may_follow_one_option():
    given = ["calibrate", "--data", "a", "b", "--out", "x", "--test=c", "--test", "d", "e"]
    assert cli.repeated(given) == [
        *["calibrate", "--data", "a", "--data", "b", "--out", "x", "--test=c", "--test", "d", "--test", "e"]
    ]
    good = ["discover", "--good", "a", "b"]
    assert cli.repeated(good) == ["discover", "--good", "a", "--good", "b"]
    spectra = ["calibrate", "--impedance", "a", "b"]
    assert cli.repeated(spectra) == ["calibrate", "--impedance", "a", "--impedance", "b"]
    assert cli.repeated(["run", "--data", "a", "b"]) == ["run", "--data", "a", "b"]


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("discover --data=a b c --out d", "discover --data=a --data b --data c --out d"),
        ("discover --data= a", "discover --data= --data a"),
        ("discover --set a=1 e.yaml", "discover --set a=1 e.yaml"),
        ("discover --seed 0 e.yaml --out d", "discover --seed 0 e.yaml --out d"),
        ("discover --data a -- b", "discover --data a -- b"),
        ("calibrate --until a=5 b=6", "calibrate --until a=5 --until b=6"),
        ("simulate --effect=a:r=1 b --effect-file a.py b.py",
         "simulate --effect=a:r=1 --effect b --effect-file a.py --effect-file b.py"),
    ],
)  # fmt: skip
def test_several_values_after_an_equals_sign_were_taken_for_something_else(given, meant):
    assert cli.repeated(given.split()) == meant.split()


def test_a_second_file_after_an_equals_sign_had_another_option_blamed(call):
    code, _, err = call("discover", "--cell", LG_M50, "--data=dis.csv", "cha.csv", "--out", "d")
    assert code == 2
    assert "dis.csv" in err
    assert "experiment file" not in err


def test_every_option_that_may_be_given_again_takes_several_values():
    from typer.main import get_command

    commands = get_command(cli.app).commands
    several = {
        option
        for name in cli.TAKE_LISTS
        for parameter in commands[name].params
        if parameter.multiple and parameter.param_type_name == "option"
        for option in parameter.opts
    }
    assert several - {"--set"} == {*cli.LISTS}


def test_bench_prints_json_lines(call, monkeypatch):
    monkeypatch.setattr("flows.benchmarks.run", lambda name, **options: iter([{"ours_s": 1.0, **options}]))
    code, out, _ = call("bench", "espm", "--json", "--set", "n=3")
    assert code == 0
    assert json.loads(out) == {"bench": "espm", "ours_s": 1.0, "n": 3}


def test_bench_names_its_options_where_one_is_not_there(call):
    code, _, err = call("bench", "blind", "--set", "colour=red")
    assert code == 2
    assert "--set colour" in err
    assert "workers" in err


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.sampled_from(
            ["run", "simulate", "predict", "effects", "tables", "--cell", "--out", "--set", "--soc0", "--"]
        )
        | st.text(max_size=8),
        max_size=5,
    )
)
def test_no_arguments_make_a_traceback(call, tracked, arguments):
    if arguments[:1] and arguments[0] in ("ui", "bench"):
        return
    code, _, err = call(*arguments)
    assert code in (0, 1, 2)
    assert "Traceback" not in err
    assert "aesi: unexpected" not in err


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["aesi", "dis"], "discover"),
        (["aesi", "effects", "self_h"], "self_heating"),
        (["aesi", "bench", "tra"], "tracking"),
        (["aesi", "data", "get", "lg_m"], "lg_m50t_w8"),
    ],
)
def test_the_shell_is_offered_names(words, offered):
    command = Path(sys.executable).with_name("aesi")
    asked = {
        "COMP_WORDS": " ".join(words),
        "COMP_CWORD": str(len(words) - 1),
        "_AESI_COMPLETE": "complete_bash",
    }
    done = subprocess.run(
        [command], env=os.environ | asked, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout.split() == [offered], done.stderr


def test_every_command_is_told_in_one_whole_line(call):
    _, out, _ = call("--help")
    assert "..." not in out.split("Commands:")[1]


def test_an_option_that_may_be_repeated_seemed_to_take_a_list(call):
    _, out, _ = call("calibrate", "--help")
    assert "--data <path>" in out
    assert "--prior <str>" in out
    assert "list[" not in out


@pytest.mark.parametrize(
    ("command", "takes"), [("simulate", True), ("predict", True), ("discover", False), ("calibrate", False)]
)
def test_how_the_current_runs_was_said_to_be_of_a_saved_model_where_rows_tell_it(call, command, takes):
    _, out, _ = call(command, "--help")
    told = " ".join(out.split()).split("--hold <linear|backward>")[1].split("A message says")[0]
    assert ("Default: that of a saved model" in told) == takes
    assert "more than 5 s apart" in told


@pytest.mark.parametrize("name", ["out.bdf", "out.bdf.csv", "OUT.BDF.gz"])
def test_columns_of_the_project_were_written_under_the_name_of_another_format(call, tmp_path, name):
    """A file `.bdf`, where current is positive on charge, held one that is positive on discharge."""
    path, out = tmp_path / "in.csv", tmp_path / name
    path.write_text(
        "time_s,current_a,voltage_v\n" + "".join(f"{k},{k % 3},{4 - 0.02 * (k % 3)}\n" for k in range(60))
    )
    code, _, err = call("data", "convert", path, "--out", out)
    assert code == 2
    assert "give a name without .bdf, or --to bdf" in err
    assert not out.exists()
    assert call("data", "convert", path, "--to", "bdf", "--out", out)[0] == 0


def test_a_short_record_in_milliseconds_was_converted_without_a_word(call, tmp_path):
    cell = aesi.Cell.from_bpx(LG_M50)
    time_s = np.arange(0.0, 1200.0)
    current = np.repeat(np.random.default_rng(0).normal(3.0, 4.0, 40), 30).clip(-5.0, 12.0)
    voltage = aesi.simulate(cell, time_s, current, soc0=0.9).voltage_v
    path, out = tmp_path / "short.csv", tmp_path / "out.csv"
    pd.DataFrame({"time_s": 1e3 * time_s, "current_a": current, "voltage_v": voltage}).to_csv(
        path, index=False
    )
    code, _, err = call("data", "convert", path, "--cell", LG_M50, "--out", out)
    assert code == 2
    assert "--unit time_s=ms" in err
    assert not out.exists()
    assert call("data", "convert", path, "--cell", LG_M50, "--unit", "time_s=ms", "--out", out)[0] == 0
