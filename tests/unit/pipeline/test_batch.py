"""The plan of a batch, what a job leaves, and what the summary makes of it."""

import json
import re
from dataclasses import replace
from datetime import date
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pandas as pd
import pytest

import aesi
from aesi.calibration.uncertainty.health import HEALTH_WORDS, health_of
from aesi.errors import InputError
from aesi.numerics.files.source_digest import source_digest
from aesi.physics.effects import CATALOGUE
from aesi.physics.folded import folded
from aesi.pipeline.batch.job import Settings, of_other_code, run_job
from aesi.pipeline.batch.plan import Job, read_plan, without_records
from aesi.pipeline.batch.summary import trends, write_summary

CELL = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"


def touched(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("x")
    return path


def test_a_folder_is_one_cell_a_subfolder(tmp_path):
    touched(tmp_path / "a" / "1.csv")
    touched(tmp_path / "a" / "2.csv.gz")
    own = touched(tmp_path / "b" / "b.bpx.json")
    touched(tmp_path / "b" / "1.mpt")
    touched(tmp_path / "notes" / "readme.md")
    touched(tmp_path / ".aesi" / "kept.csv")
    jobs = read_plan(tmp_path, CELL)
    assert [(job.name, job.cell, len(job.data)) for job in jobs] == [("a", CELL, 2), ("b", own, 1)]
    assert without_records(tmp_path) == ("notes",)
    assert "--cell" in read_plan(tmp_path)[0].unusable


def test_records_of_some_kinds_were_passed_over_and_what_systems_lay_beside_them_read(tmp_path):
    for name in ("1.bdf", "2.TSV", "3.xlsx", "._3.csv", "~$3.xlsx", "own.bpx.json", "._own.bpx.json"):
        touched(tmp_path / "a" / name)
    (job,) = read_plan(tmp_path)
    assert [path.name for path in job.data] == ["1.bdf", "2.TSV", "3.xlsx"]
    assert job.cell.name == "own.bpx.json"


def test_a_table_names_cells_tests_and_check_ups(tmp_path):
    for name in ("s.csv", "d.csv", "t.csv"):
        touched(tmp_path / name)
    table = tmp_path / "plan.csv"
    table.write_text(
        "name,data,test,soc0,specimen,at\nc0,s.csv;d.csv,t.csv,0.9,cell 1,0\nc1,d.csv,,,cell 1,200\n"
    )
    first, second = read_plan(table, CELL)
    assert first == Job(
        "c0", CELL, (tmp_path / "s.csv", tmp_path / "d.csv"), (tmp_path / "t.csv",), 0.9, "cell 1", 0.0
    )
    assert (second.tests, second.soc0, second.at) == ((), None, 200.0)


def test_a_trend_over_different_cell_files_was_taken_for_ageing(tmp_path):
    touched(tmp_path / "s.csv")
    table = tmp_path / "plan.csv"
    for name, text in (("new.json", "new"), ("copy.json", "new"), ("aged.json", "aged")):
        (tmp_path / name).write_text(text)
    rows = "name,data,cell,specimen,at\nc0,s.csv,new.json,cell 1,0\nc1,s.csv,{},{},200\n"
    table.write_text(rows.format("aged.json", "cell 1"))
    with pytest.raises(
        InputError, match=r"'c0' and 'c1' of 'cell 1' start from different cells, .*aged\.json"
    ):
        read_plan(table)
    for cell, specimen in (("copy.json", "cell 1"), ("aged.json", "cell 2")):
        table.write_text(rows.format(cell, specimen))
        assert len(read_plan(table)) == 2


def test_a_state_of_health_is_a_cell_s_own_or_that_of_all(tmp_path):
    touched(tmp_path / "s.csv")
    table = tmp_path / "plan.csv"
    table.write_text("name,data,soh\nold,s.csv,0.8\nnew,s.csv,\nof a day,s.csv,2018-11-13\n")
    old, new, dated = read_plan(table, CELL, 0.95)
    assert (old.soh, new.soh, dated.soh) == (0.8, 0.95, date(2018, 11, 13))
    assert old.key("") != read_plan(table, CELL, 0.95)[1].key("")
    assert [job.soh for job in read_plan(table, CELL)] == [0.8, None, date(2018, 11, 13)]
    with pytest.raises(InputError, match="a state of health of 95"):
        read_plan(table, CELL, 95.0)  # at once, not cell by cell


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("name\na\n", "columns name and data"),
        ("name,data,mass\na,s.csv,3\n", "columns name and data"),
        ("name,data\na,nowhere.csv\n", "line 2: there is no file"),
        ("name,data\na,s.csv\na,s.csv\n", "named 'a'"),
        ("name,data\na,s.csv\nA,s.csv\n", "named 'A' and 'a', which differ in capitals alone"),
        ("name,name,data\na,b,s.csv\n", "has 2 columns named 'name'; leave one"),
        ("name,data,at\na,s.csv,old\n", "is no number"),
        ("name,data,soc0\na,s.csv,90\n", "line 2: soc0 = 90: a state of charge is a share"),
        ("name,data,soh\na,s.csv,new\n", "line 2: soh: a state of health of 'new': give the share"),
        ("name,data,soh\na,s.csv,80\n", "line 2: soh: a state of health of 80: it is the share"),
        ("name,data,specimen,at\na,s.csv,one,\n", "line 2: a check-up has a specimen and an at"),
        ("name,data,at\na,s.csv,3\n", "line 2: a check-up has a specimen and an at"),
        (
            "name,data,specimen,at\na,s.csv,one,3\nb,s.csv,one,3.0\n",
            "two check-ups of 'one' are at 3; several",
        ),
        ("name,data\n,s.csv\n", "have to be given"),
        ("name,data\n../a,s.csv\n", "without slashes"),
        ("name,data\n..,s.csv\n", "starts with no dot"),
        ("name,data\nsummary.csv,s.csv\n", "'summary.csv' .* is the name of a file beside these"),
        ("name,data\nSummary.json,s.csv\n", "'Summary.json' .* is the name of a file beside these"),
        ("name,data\nindex.html,s.csv\n", "'index.html' .* is the name of a file beside these"),
        ("name;data\na;s.csv\n", "is separated by semicolons; separate its cells by commas"),
        ("name\tdata\na\ts.csv\n", "is separated by tabs; separate its cells by commas"),
    ],
)
def test_a_table_that_cannot_be_used_is_one_sentence(tmp_path, content, words):
    touched(tmp_path / "s.csv")
    table = tmp_path / "plan.csv"
    table.write_text(content)
    with pytest.raises(InputError, match=words):
        read_plan(table, CELL)


def test_a_line_that_cannot_be_used_ended_the_whole_batch(tmp_path):
    touched(tmp_path / "s.csv")
    table = tmp_path / "plan.csv"
    table.write_text(
        "name,data,soc0,specimen,at\ngood,s.csv,0.9,,\ngone,nowhere.csv,,,\nhigh,s.csv,90,,\nhalf,s.csv,,one,\n"
        "long,s.csv,,,,t.csv\n"
    )
    jobs = {job.name: job for job in read_plan(table, CELL)}
    assert not jobs["good"].unusable
    for name, words in (
        ("gone", "line 3: there is no file"),
        ("high", "line 4: soc0 = 90"),
        ("half", "line 5: a check-up has a specimen and an at"),
        ("long", "line 6: more cells than the header has"),
    ):
        row = run_job(jobs[name], tmp_path / "out", Settings())
        assert row["status"] == "failed"
        assert words in row["reason"]
    assert of_other_code(jobs.values(), tmp_path / "out") == []


def test_a_subfolder_without_a_cell_file_ended_the_whole_batch(tmp_path):
    for name in ("a/1.csv", "a/a.bpx.json", "b/1.csv"):
        touched(tmp_path / name)
    good, bad = read_plan(tmp_path)
    assert not good.unusable
    assert "holds no BPX file" in bad.unusable


def test_a_cell_file_that_is_not_there_is_told_once_not_job_by_job(tmp_path):
    touched(tmp_path / "a" / "1.csv")
    with pytest.raises(InputError, match=r"There is no cell file nowhere\.json"):
        read_plan(tmp_path, Path("nowhere.json"))


def test_a_job_that_cannot_be_done_is_a_row_with_its_reason(tmp_path):
    row = run_job(Job("bad", CELL, (touched(tmp_path / "bad.csv"),)), tmp_path / "out", Settings())
    assert row["status"] == "failed"
    assert "bad.csv" in row["reason"]


def test_a_batch_advised_an_option_for_one_cell_that_holds_for_all(tmp_path):
    """Given for the one in mA, it is the other that cannot be used."""
    time_s = np.arange(600.0)
    current_a = np.repeat(np.random.default_rng(0).normal(3.0, 4.0, 20), 30)
    columns = {"time_s": time_s, "current_a": 1e3 * current_a, "voltage_v": 3.7 - 0.02 * current_a}
    pd.DataFrame(columns).to_csv(tmp_path / "milli.csv", index=False)
    row = run_job(Job("milli", CELL, (tmp_path / "milli.csv",)), tmp_path / "out", Settings())
    assert "--unit current_a=mA (in a batch these options hold for all cells" in row["reason"]
    assert row["reason"].endswith("what is no record belongs in another folder).")


def left(folder, content):
    """What an earlier run of a batch left of a job."""
    for name in ("discovery.json", "report.html"):
        touched(folder / name)
    (folder / "row.json").write_text(json.dumps(content))


def test_what_an_earlier_run_found_is_no_result_of_a_job_that_fails(tmp_path):
    out = tmp_path / "out"
    for name in ("row.json", "discovery.json", "report.html", "model/model.json", "hypotheses.jsonl"):
        touched(out / "c" / name)
    row = run_job(Job("c", CELL, (touched(tmp_path / "data.csv"),)), out, Settings())
    assert row["status"] == "failed"
    assert row["reason"].endswith(f" What an earlier run found was moved to {out / 'c' / 'earlier'}.")
    assert sorted(path.name for path in (out / "c").iterdir()) == ["earlier", "hypotheses.jsonl"]
    assert (out / "c" / "earlier" / "model" / "model.json").read_text() == "x"
    again = run_job(Job("c", CELL, (tmp_path / "data.csv",)), out, Settings())
    assert "earlier" not in again["reason"]
    assert (out / "c" / "earlier" / "discovery.json").exists()


def test_what_is_done_is_taken_again_until_a_file_or_a_setting_changes(tmp_path):
    data = touched(tmp_path / "a.csv")
    job, settings = Job("a", CELL, (data,)), Settings()
    kept = {"name": "a", "specimen": "", "at": None, "status": "done", "verdict": "none"}
    left(tmp_path / "out" / "a", {"key": job.key(settings.key), "row": kept})
    assert run_job(job, tmp_path / "out", settings) == kept
    assert run_job(job, tmp_path / "out", Settings(seed=1))["status"] == "failed"
    data.write_text("y")
    assert run_job(job, tmp_path / "out", settings)["status"] == "failed"


def test_a_row_of_another_version_or_without_its_finding_was_taken_as_done(tmp_path, monkeypatch):
    job, settings, out = Job("a", CELL, (touched(tmp_path / "a.csv"),)), Settings(), tmp_path / "out"
    kept = {"name": "a", "specimen": "", "at": None, "status": "done", "verdict": "none"}
    assert of_other_code([job], out) == []
    left(
        out / "a", {"key": job.key(settings.key), "row": kept}
    )  # as by a version that did not say which it is
    assert of_other_code([job], out) == ["a"]
    left(out / "a", {"key": job.key(settings.key), "code": source_digest(), "row": kept})
    assert of_other_code([job], out) == []
    assert run_job(job, out, settings) == kept
    with monkeypatch.context() as later:
        later.setattr("aesi.pipeline.batch.job.source_digest", lambda: "another")
        assert of_other_code([job], out) == ["a"]
        assert run_job(job, out, settings)["status"] == "failed"
    left(out / "a", {"key": job.key(settings.key), "code": source_digest(), "row": kept})
    (out / "a" / "report.html").unlink()
    assert run_job(job, out, settings)["status"] == "failed"


def test_health_shows_what_was_lost():
    cell = aesi.Cell.from_bpx(CELL)
    aged = folded(
        cell,
        [
            CATALOGUE["lithium_inventory_loss"].activate(loss=0.1),
            CATALOGUE["series_resistance"].activate(resistance_ohm=5e-3),
        ],
    ).cell
    fresh, old = health_of(cell), health_of(aged)
    assert old.inventory_ah == pytest.approx(fresh.inventory_ah - 0.1 * cell.capacity_ah, rel=1e-6)
    assert old.resistance_mohm - fresh.resistance_mohm == pytest.approx(5.0)
    assert old.negative_ah == pytest.approx(fresh.negative_ah)
    assert old.positive_ah == pytest.approx(fresh.positive_ah)
    assert old.capacity_ah < fresh.capacity_ah


def test_the_summary_has_every_cell_and_the_trend_in_order(tmp_path):
    def row(name, at, resistance):
        health = {f"{key}{end}": 5.0 for key in HEALTH_WORDS for end in ("", "_low", "_high")}
        done = {
            "status": "done",
            "verdict": "none",
            "effects": "",
            "finding": "none: these data show nothing",
        }
        return {"name": name, "specimen": "cell 1", "at": at, **done, **health, "resistance_mohm": resistance}

    failed = {"name": "x", "specimen": "", "at": None, "status": "failed", "reason": "x.csv is empty & <odd>"}
    rows = [row("late", 200.0, 3.0), row("early", 0.0, 1.0), failed]
    assert [each["resistance_mohm"] for each in trends(rows)["cell 1"]] == [1.0, 3.0]
    page = write_summary(tmp_path, rows, "plan").read_text(encoding="utf-8")
    assert "2 of 3 cells done" in page
    assert "x.csv is empty &amp; &lt;odd&gt;" in page
    assert "Resistance of contacts and films" in page
    assert "1 <small>[5, 5]</small>" in page
    assert len((tmp_path / "summary.csv").read_text().splitlines()) == 4


def test_the_links_to_cells_whose_names_have_signs_led_nowhere(tmp_path):
    name = "cell #3, 50%"
    row = {"name": name, "specimen": "", "at": None, "status": "done", "finding": "none", "inventory_ah": 7.0}
    row |= {"report": f"{name}/report.html", "effects": ""}
    page = write_summary(tmp_path, [row], "plan").read_text(encoding="utf-8")
    links = [unquote(link) for link in re.findall(r'<a href="([^"#?]*)"', page)]
    assert {f"{name}/report.html", f"{name}/calibrated.bpx.report.html"} <= set(links)


def test_a_record_that_judges_is_another_job_than_one_that_is_fitted(tmp_path):
    fitted, judged = touched(tmp_path / "a.csv"), touched(tmp_path / "b.csv")
    judged.write_text("y")
    both = Job("one", CELL, (fitted, judged))
    assert both.key("") != Job("one", CELL, (fitted,), (judged,)).key("")
    joined = tmp_path / "c.csv"
    joined.write_text("xy")
    assert both.key("") != Job("one", CELL, (joined,)).key("")


def test_a_check_up_that_is_dated_anew_keeps_its_finding_and_not_its_date(tmp_path):
    job = Job("one", CELL, (touched(tmp_path / "a.csv"),), specimen="cell 1", at=10.0)
    folder = tmp_path / "out" / "one"
    folder.mkdir(parents=True)
    row = {"name": "one", "specimen": "cell 1", "at": 10.0, "status": "done", "verdict": "none"}
    left(folder, {"key": job.key(Settings().key), "row": row})
    again = run_job(replace(job, specimen="cell 2", at=20.0), tmp_path / "out", Settings())
    assert again == row | {"specimen": "cell 2", "at": 20.0}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("name,data\nZelle ä,a.csv\n".encode("latin-1"), "is no text in UTF-8"),
        (b"name,data\nc0,a.csv,b.csv\n", "line 2: more cells than the header has"),
        (b"name,data,at\nc0,a.csv,nan\n", "line 2: at = 'nan' is no number"),
        (b"name,data,soc0\nc0,a.csv,full\n", "line 2: soc0 = 'full' is no number"),
    ],
)
def test_a_table_that_cannot_be_meant_is_one_sentence(tmp_path, content, words):
    touched(tmp_path / "a.csv")
    (tmp_path / "plan.csv").write_bytes(content)
    with pytest.raises(InputError, match=words):
        read_plan(tmp_path / "plan.csv", CELL)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("a",), r"^the one cell cannot be used: plan\.csv, line 2"),
        (("a", "b"), "none of the 2 cells can be used; the"),
    ],
)
def test_one_cell_was_refused_as_none_of_the_1_cells(tmp_path, monkeypatch, names, said):
    monkeypatch.chdir(tmp_path)
    plan = Path("plan.csv")
    plan.write_text("name,data\n" + "".join(f"{name},nowhere.csv\n" for name in names))
    with pytest.raises(InputError, match=said):
        read_plan(plan, CELL)
