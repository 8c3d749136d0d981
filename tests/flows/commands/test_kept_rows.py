"""`aesi bench --set keep=FOLDER`: a row stands for its case while program, question and files are the same."""

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from aesi.bench.hybrid.splits import chosen_splits
from flows.benchmarks import cases, left_out, real, splits
from flows.benchmarks.cases import judged_once, kept_rows


@dataclass(frozen=True)
class Asked:
    name: str
    size: float = 1.0


@pytest.fixture
def judged():
    return []


@pytest.fixture
def judge(tmp_path, judged):
    """Judges a case as the benchmarks do: `limit_s` of the judge, a cell file that the row depends on."""
    cell = tmp_path / "cell.json"
    cell.write_text("{}")

    def row_of(case, limit_s):
        judged.append(case.name)
        return {"case": case.name, "verdict": "found" if case.size < 9.0 else "not run"}

    def once(case, limit_s=60.0):
        keep = str(tmp_path / "kept")
        return judged_once(case, partial(row_of, limit_s=limit_s), keep, lambda case: [cell])

    return once


def test_a_row_of_an_older_program_stood_for_the_present_one(judge, judged, tmp_path, monkeypatch, capsys):
    """An interrupted benchmark went on after a change of the code with the rows from before it."""
    assert judge(Asked("a")) == judge(Asked("a"))
    assert judged == ["a"]
    monkeypatch.setattr(cases, "_program", lambda: "changed")
    assert kept_rows(str(tmp_path / "kept")) == []
    assert "of another program, and left out: a." in capsys.readouterr().err
    judge(Asked("a"))
    assert judged == ["a", "a"]
    assert "judged again" in capsys.readouterr().err
    assert kept_rows(str(tmp_path / "kept")) == [{"case": "a", "verdict": "found"}]


def test_a_row_is_of_what_was_asked_and_of_the_files_that_it_rests_on(judge, judged, tmp_path):
    judge(Asked("set/a"))
    for other in (partial(judge, Asked("set/a", 2.0)), partial(judge, Asked("set/a", 2.0), limit_s=5.0)):
        other()
        other()
    assert len(judged) == 3
    (tmp_path / "cell.json").write_text('{"made": "again"}')
    judge(Asked("set/a", 2.0), limit_s=5.0)
    assert len(judged) == 4


def test_what_could_not_be_run_is_not_kept(judge, judged, tmp_path):
    judge(Asked("a", 10.0))
    judge(Asked("a", 10.0))
    assert len(judged) == 2
    assert kept_rows(str(tmp_path / "kept")) == []


def test_a_row_without_its_program_is_judged_again(judge, judged, tmp_path):
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "a.json").write_text(json.dumps({"case": "a", "verdict": "none"}))
    assert judge(Asked("a"))["verdict"] == "found"


@pytest.mark.parametrize(
    ("files", "one"),
    [
        (partial(real._files, real.chosen(only="witness")[0]), "panasonic_ncr18650pf/25degC_eis.csv"),
        (partial(real._files, real.chosen(only="beside-nothing-about")[0]), "about_energy_nmc/C2.csv"),
        (partial(left_out._files, left_out.plan("lg_m50t")[0]), "lg_m50t_w8/n0_udds.csv"),
    ],
)
def test_a_row_of_other_measured_data_stood_for_these(tmp_path, monkeypatch, files, one):
    """Two folders, named by AESI_DATA, were judged as one."""
    found = []
    for folder in ("first", "second"):
        monkeypatch.setattr("aesi.data.catalogue.get", lambda name, folder=folder: tmp_path / folder / name)
        place = tmp_path / folder / one
        place.parent.mkdir(parents=True)
        place.write_text(folder)
        found.append([path for path in files(cells="experiments/cells") if path == place])
    assert found == [[tmp_path / "first" / one], [tmp_path / "second" / one]]


def test_a_split_rests_on_the_records_of_its_set(tmp_path, monkeypatch):
    monkeypatch.setattr("aesi.data.catalogue.get", lambda name: tmp_path)
    for name in ("drive_cycle.csv", "cell.bpx.json"):
        (tmp_path / name).write_text("{}")
    split = chosen_splits(["nmc"], 1)[0]
    folder = Path(__file__).resolve().parents[3] / "experiments"
    run = splits.SplitRun(split, 0, str(folder), split.overrides)
    assert {tmp_path / "drive_cycle.csv", tmp_path / "cell.bpx.json"} <= set(splits._files(run))
