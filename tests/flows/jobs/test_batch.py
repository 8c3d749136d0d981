"""A batch: what is done is taken again, every cell is tracked, and one that failed says why."""

import json
import sys
from importlib import import_module
from pathlib import Path

import pytest

from aesi.calibration.uncertainty.health import HEALTH_WORDS
from aesi.errors import AesiError, InputError
from aesi.numerics.files.source_digest import source_digest
from aesi.pipeline.batch.job import Settings
from aesi.pipeline.batch.plan import read_plan

CELL = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
STATES = ("before", "recalibrated", "after")


def done(folder, job, ohm):
    """A check-up as an earlier run of the batch left it."""
    row = {"name": job.name, "specimen": job.specimen, "at": job.at, "status": "done", "verdict": "none"}
    row |= {
        "effects": "",
        "finding": "none: these data show nothing",
        "seconds": 3.0,
        "report": "report.html",
    }
    row |= {f"{state}_test_mv": 2.0 for state in STATES}
    row |= {f"{key}{end}": ohm for key in HEALTH_WORDS for end in ("", "_low", "_high")}
    folder.mkdir(parents=True)
    for name in ("discovery.json", "report.html"):
        (folder / name).write_text("")
    key = job.key(Settings().key)
    (folder / "row.json").write_text(json.dumps({"key": key, "code": source_digest(), "row": row}))


def test_a_batch_that_goes_on_after_an_upgrade_says_what_is_done_again(tracked, capsys):
    from flows.jobs.batch import batch

    (tracked / "a.csv").write_text("a")
    (tracked / "plan.csv").write_text("name,data\na,a.csv\n")
    (job,) = read_plan(tracked / "plan.csv", CELL)
    done(tracked / "out" / "a", job, 3.0)
    kept = tracked / "out" / "a" / "row.json"
    kept.write_text(kept.read_text().replace(source_digest(), "0"))
    batch(tracked / "plan.csv", tracked / "out", CELL, workers=1)
    said = capsys.readouterr()
    assert "a was done by another version of this program" in said.out + said.err


def test_a_record_beside_the_subfolders_was_left_out_without_a_word(tracked, capsys):
    from flows.jobs.batch import batch

    cells = tracked / "cells"
    (cells / "a").mkdir(parents=True)
    for file in (cells / "a" / "drive.csv", cells / "loose.csv", cells / "notes.md"):
        file.write_text("a")
    (job,) = read_plan(cells, CELL)
    done(tracked / "out" / "a", job, 3.0)
    batch(cells, tracked / "out", CELL, workers=1)
    said = capsys.readouterr()
    assert "in no subfolder, and so of no cell: loose.csv; passed over." in said.out + said.err


@pytest.mark.parametrize("runner", ["local", "dask"])
def test_a_batch_is_tracked_with_the_trend_of_its_specimens(tracked, runner):
    from flows.jobs.batch import batch
    from flows.tracking.store import JOB, Store
    from flows.tracking.view import NOTE, VIEW_TAG

    for name in ("a.csv", "b.csv"):
        (tracked / name).write_text(name)
    plan = tracked / "plan.csv"
    plan.write_text("name,data,specimen,at\nfresh,a.csv,cell 1,0\naged,b.csv,cell 1,100\nother,a.csv,,\n")
    out = tracked / "out"
    for job, ohm in zip(read_plan(plan, CELL), (3.0, 5.0), strict=False):
        done(out / job.name, job, ohm)
    rows = batch(plan, out, CELL, workers=1, runner=runner)
    assert [row["status"] for row in rows] == ["done", "done", "failed"]
    trend = json.loads((out / "summary.json").read_text())["trends"]["cell 1"]
    assert [(each["at"], each["resistance_mohm"]) for each in trend] == [(0.0, 3.0), (100.0, 5.0)]
    store = Store()
    runs = {run.info.run_name: run for run in store.runs(store.find_experiment("batch"), "")}
    assert runs["aged"].data.metrics["resistance_mohm"] == 5.0
    errors = {f"{state}/test_rmse_mv": 2.0 for state in STATES}  # as a discovery names them
    assert runs["aged"].data.metrics.items() >= errors.items()
    assert runs["aged"].data.tags["batch"] == "plan.csv"
    assert runs["plan.csv"].data.tags[NOTE].startswith("3 cells: 1 failed, 2 none.")
    about = store.client.get_experiment(store.find_experiment("batch")).tags
    assert "its cells" in about[NOTE]
    view = json.loads(about[VIEW_TAG])
    assert view["searchFilter"] == "tags.`aesi.kind` = 'cell'"
    assert view["orderByKey"] == "tags.`mlflow.runName`"  # else cells are folded into their batch
    assert "metrics.`after/test_rmse_mv`" in view["selectedColumns"]
    assert runs["other"].info.status == "FAILED"
    parent = runs["plan.csv"]
    assert parent.data.metrics["failed"] == 1.0
    assert parent.info.status == "FINISHED"
    assert parent.data.tags[JOB] == "batch"


KILLED = """
import os, signal
from aesi.pipeline.batch.job import run_job as work

def run_job(job, out, settings):
    if job.name == "large":
        os.kill(os.getpid(), signal.SIGKILL)
    return work(job, out, settings)
"""


def test_a_process_that_the_system_killed_ended_the_whole_batch(tracked, monkeypatch):
    from flows.jobs import batch

    (tracked / "killed.py").write_text(KILLED)
    monkeypatch.syspath_prepend(tracked)
    monkeypatch.setattr(batch, "run_job", import_module("killed").run_job)
    names = ("first", "large", "third", "fourth")
    for name in names:
        (tracked / f"{name}.csv").write_text(name)
    plan = tracked / "plan.csv"
    plan.write_text("name,data\n" + "".join(f"{name},{name}.csv\n" for name in names))
    for job in read_plan(plan, CELL):
        if job.name != "large":
            done(tracked / "out" / job.name, job, 3.0)
    rows = batch.batch(plan, tracked / "out", CELL, workers=2)
    assert {row["name"]: row["status"] for row in rows} == dict.fromkeys(names, "done") | {"large": "failed"}
    assert "the system ended the process that worked on it" in rows[1]["reason"]
    assert "large" in (tracked / "out" / "summary.csv").read_text()


@pytest.mark.skipif(sys.platform != "linux", reason="a file that is there and cannot be read, whoever asks")
def test_one_record_that_cannot_be_read_ended_the_whole_batch(tracked):
    from flows.jobs.batch import batch

    (tracked / "a.csv").write_text("a")
    plan = tracked / "plan.csv"
    plan.write_text("name,data\ngood,a.csv\nbad,/proc/self/mem\n")
    done(tracked / "out" / "good", read_plan(plan, CELL)[0], 3.0)
    good, bad = batch(plan, tracked / "out", CELL, workers=1)
    assert (good["status"], bad["status"]) == ("done", "failed")
    assert bad["reason"].endswith("Input/output error.")


def test_a_batch_for_a_scheduler_that_is_away_left_a_failed_run(workspace, monkeypatch, capsys):
    from flows.evaluation import dask_pool
    from flows.jobs.batch import batch

    monkeypatch.setattr(dask_pool, "CONNECT_S", 0.5)
    (workspace / "a.csv").write_text("a")
    (workspace / "plan.csv").write_text("name,data\na,a.csv\n")
    with pytest.raises(AesiError, match=r"scheduler tcp://127\.0\.0\.1:9 does not answer"):
        batch(workspace / "plan.csv", workspace / "out", CELL, runner="dask", address="tcp://127.0.0.1:9")
    assert capsys.readouterr().err == ""
    assert not (workspace / "out").exists()
    assert not (workspace / "mlflow.db").exists()


def test_a_batch_tracks_what_was_asked(tracked):
    from aesi.data.reading import Reading
    from flows.jobs.batch import batch
    from flows.tracking.store import Store

    plan, out = tracked / "plan.csv", tracked / "out"
    plan.write_text("name,data\na,a.csv\n")
    settings = Settings(0.3, 1, 3, Reading(units={"current_a": "mA"}))
    for content in ("a", "b"):
        (tracked / "a.csv").write_text(content)
        with pytest.raises(InputError, match=r"no cell of .*plan.csv could be used; .*summary.csv says why"):
            batch(plan, out, CELL, settings, workers=1, soh=0.98)
    store = Store()
    runs = [run for run in store.runs(store.find_experiment("batch"), "") if run.info.run_name == "plan.csv"]
    asked = {
        "cell": CELL.name,
        "soh": "0.98",
        "max_effects": "1",
        "seed": "3",
        "units": '{"current_a": "mA"}',
    }
    for run in runs:
        assert {name: run.data.params.get(name) for name in asked} == asked
    assert len({run.data.params["plan_digest"] for run in runs}) == 2
    assert {run.info.status for run in runs} == {"FAILED"}


def test_workers_elsewhere_find_the_files_of_a_relative_plan(tracked, monkeypatch):
    monkeypatch.chdir(tracked)
    for name in ("a.csv", "plan.csv"):
        Path(name).write_text("name,data\na,a.csv\n")
    (job,) = read_plan(Path("plan.csv"), CELL)
    assert job.data == (Path("a.csv"),)
    assert job.resolved().data == (tracked.resolve() / "a.csv",)
    assert job.resolved().key("") == job.key("")
