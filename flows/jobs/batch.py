"""`aesi batch`: one discovery a cell, over processes here or a Dask cluster; what is done is not done again."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from aesi.errors import InputError
from aesi.numerics.files.source_digest import source_digest
from aesi.pipeline.batch.job import Settings, lost_job, of_other_code, run_job
from aesi.pipeline.batch.plan import Job, of_no_cell, read_plan, without_records
from aesi.pipeline.batch.summary import write_summary
from aesi.pipeline.experiment.sections import TrackingConfig
from aesi.pipeline.written import SUMMARY_PAGE, SUMMARY_TABLE
from aesi.tracer.report.outcome import STATES
from flows.base import environment
from flows.base.console import Console, duration
from flows.base.folder_lock import alone_in
from flows.base.interrupt import kept_on_interrupt
from flows.evaluation.dask_pool import check_scheduler
from flows.evaluation.spread import in_processes, on_dask
from flows.jobs.run_session import tracked_job

if TYPE_CHECKING:
    from aesi.physics.cell import Soh
    from flows.tracking.tracker import Tracker

Runner = Literal["local", "dask"]
ERRORS = {f"{state}_test_mv": f"{state}/test_rmse_mv" for state in STATES}
"""Column of a batch's summary -> the metric by which a discovery tracks the same."""


def batch(
    source: Path,
    out: Path,
    cell: Path | None = None,
    settings: Settings | None = None,
    workers: int = 2,
    runner: Runner = "local",
    address: str | None = None,
    soh: Soh | None = None,
) -> list[dict[str, Any]]:
    """Run the jobs of a folder or table; the rows of the summary, which is written anew after each.

    soh : state of health of every cell that the plan gives none.
    Raises InputError for a plan that cannot be read, where another process writes to `out` now, and where all jobs
    fail; a job that fails is a row with its reason.
    """
    environment.prepare_process()
    console = Console()
    started = time.monotonic()
    settings = settings or Settings()
    jobs = read_plan(source, cell, soh)
    if runner == "dask":
        check_scheduler(address)
    _say_plan(console, jobs, source, out, workers)
    rows: dict[str, dict[str, Any]] = {}
    kept = f"What is done is kept in {out}; the same command goes on from there."
    asked = {
        "source": source.name,
        "cell": "" if cell is None else cell.name,
        "soh": soh,
    } | settings.parameters
    with alone_in(out), kept_on_interrupt(kept), _tracked(jobs, settings, asked, console) as tracker:
        for row in _rows(jobs, out, settings, workers, runner, address):
            rows[row["name"]] = row
            told = row["finding"] if row["status"] == "done" else f"failed: {row['reason']}"
            console.say(f"{len(rows)}/{len(jobs)} {row['name']}: {told}")
            title = f"{source.name}: what the models of these cells lack"
            page = write_summary(out, _ordered(jobs, rows), title)
            _track(tracker, row, source.name)
        _track_summary(tracker, rows, out)
        failed = sum(row["status"] == "failed" for row in rows.values())
        console.say(f"Finished in {duration(time.monotonic() - started)}; {failed} failed. Summary: {page}")
        if failed == len(rows):
            raise InputError(f"no cell of {source} could be used; {out / SUMMARY_TABLE} says why.")
    return _ordered(jobs, rows)


def _say_plan(console: Console, jobs: Sequence[Job], source: Path, out: Path, workers: int) -> None:
    """Print the jobs that will run, those that are skipped, and those that run again."""
    cells = "1 cell" if len(jobs) == 1 else f"{len(jobs)} cells, {workers} at a time,"
    console.say(f"{cells} from {source}; results in {out}")
    if empty := without_records(source):
        console.say(f"no record in {', '.join(empty)}; passed over.")
    if loose := of_no_cell(source):
        console.say(f"in no subfolder, and so of no cell: {', '.join(loose)}; passed over.")
    if other := of_other_code(jobs, out):
        were = "was" if len(other) == 1 else "were"
        console.say(
            f"{', '.join(other)} {were} done by another version of this program, whose figures are not compared with "
            "this one's: done again."
        )


@contextmanager
def _tracked(
    jobs: Sequence[Job], settings: Settings, asked: dict[str, Any], console: Console
) -> Iterator[Tracker | None]:
    """A run of the batch; None where the store is away.  asked : source and options, by name."""
    from flows.tracking.experiment_log import CODE
    from flows.tracking.provenance import versions
    from flows.tracking.tracker import Subject
    from flows.tracking.view import BATCH_COLUMNS, CELLS, HOW_TO_READ_BATCHES, experiment_tags

    of_jobs = {job.name: _identity(job, settings) for job in jobs}
    key = sha256(repr(sorted(of_jobs.items())).encode()).hexdigest()[:16]
    quiet = TrackingConfig(system_metrics=False, log_model=False)
    subject = Subject("batch", settings.seed, key, "batch", quiet)
    with tracked_job(subject, asked["source"], console) as tracker:
        if tracker is not None:
            tracker.about(experiment_tags(HOW_TO_READ_BATCHES, BATCH_COLUMNS, CELLS))
            content = {"plan_digest": key, "cells": len(jobs), "versions": versions()}
            tracker.parameters(asked | content, {CODE: source_digest()})
        yield tracker


def _identity(job: Job, settings: Settings) -> str:
    """Key that tells a job from others; for a job that cannot be done, the reason, which its row also gives."""
    try:
        return job.unusable or job.key(settings.key)
    except OSError as error:
        return str(error)


def _track(tracker: Tracker | None, row: dict[str, Any], source: str) -> None:
    """One cell or check-up: its errors and state of health as metrics, the finding as a parameter.

    source : name of the folder or table, by which cells of several batches are told apart.
    """
    if tracker is None:
        return
    numbers = {k: float(v) for k, v in row.items() if isinstance(v, int | float) and k != "seconds"}
    metrics = {ERRORS.get(name, name): value for name, value in numbers.items()}
    told = {k: str(v) for k, v in row.items() if isinstance(v, str) and v}
    failed = row.get("reason") if row["status"] == "failed" else None
    label, seconds = f"cell:{row['name']}", row.get("seconds", 0.0)
    tags = {"batch": source}
    tracker.nested(label, row["name"], "cell", told, metrics, failed=failed, seconds=seconds, tags=tags)


def _track_summary(tracker: Tracker | None, rows: dict[str, dict[str, Any]], out: Path) -> None:
    if tracker is None:
        return
    from flows.tracking.view import NOTE

    done = [row for row in rows.values() if row["status"] == "done"]
    tracker.metrics({"done": float(len(done)), "failed": float(len(rows) - len(done))})
    tracker.parameters({}, {NOTE: _note(list(rows.values()))})
    for name in (SUMMARY_TABLE, SUMMARY_PAGE):
        tracker.files(out / name)


def _note(rows: Sequence[dict[str, Any]]) -> str:
    """What came of a batch, in a sentence: how many cells ended with each verdict, and how many failed."""
    ends = Counter(row["verdict"] if row["status"] == "done" else row["status"] for row in rows)
    counts = ", ".join(f"{count} {end}" for end, count in sorted(ends.items()))
    cells = "1 cell" if len(rows) == 1 else f"{len(rows)} cells"
    return f"{cells}: {counts}. The page of all, {SUMMARY_PAGE}, and {SUMMARY_TABLE} are among the artifacts."


def _ordered(jobs: Sequence[Job], rows: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    return [rows[job.name] for job in jobs if job.name in rows]


def _rows(
    jobs: Sequence[Job], out: Path, settings: Settings, workers: int, runner: Runner, address: str | None
) -> Iterator[dict[str, Any]]:
    """Rows as they are done."""
    if runner == "dask":
        run = partial(run_job, out=out.resolve(), settings=settings)
        return on_dask(run, [job.resolved() for job in jobs], workers, address, lost_job)
    return in_processes(partial(run_job, out=out, settings=settings), jobs, workers, lost_job)
