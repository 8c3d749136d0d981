"""`aesi bench --set keep=FOLDER`: a row stands for its case while program, question and files are the same."""

import json
from dataclasses import dataclass
from functools import partial

import pytest

from flows.benchmarks import cases
from flows.benchmarks.cases import judged_once, kept


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
    assert kept(str(tmp_path / "kept")) == []
    assert "of another program, and left out: a." in capsys.readouterr().err
    judge(Asked("a"))
    assert judged == ["a", "a"]
    assert "judged again" in capsys.readouterr().err
    assert kept(str(tmp_path / "kept")) == [{"case": "a", "verdict": "found"}]


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
    assert kept(str(tmp_path / "kept")) == []


def test_a_row_without_its_program_is_judged_again(judge, judged, tmp_path):
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "a.json").write_text(json.dumps({"case": "a", "verdict": "none"}))
    assert judge(Asked("a"))["verdict"] == "found"
