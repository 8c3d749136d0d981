"""One job of a batch: a discovery, and for a check-up the state of health; a row of the summary."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aesi.advice import with_columns
from aesi.calibration import Conditions
from aesi.data.reading import Reading
from aesi.errors import AesiError
from aesi.numerics.files.source_digest import source_digest
from aesi.numerics.files.whole import write_whole
from aesi.pipeline.batch.plan import Job
from aesi.pipeline.calibrate import Request, calibrate_files
from aesi.pipeline.discovery.cases import case_of_files
from aesi.pipeline.discovery.discover import run_case, write_discovery
from aesi.pipeline.report.words.discoveries import short_finding
from aesi.pipeline.written import CALIBRATED, EARLIER, FINDING, MODEL, REPORT, ROW, calibration_files
from aesi.tracer.report.outcome import STATES


@dataclass(frozen=True)
class Settings:
    """Settings that all jobs of a batch share."""

    holdout: float = 0.3
    max_effects: int = 3
    seed: int = 0
    reading: Reading | None = None

    @property
    def key(self) -> str:
        """The settings and the program that does the jobs, as text: rows of two versions are not mixed."""
        return f"{self!r}|{source_digest()}"

    @property
    def parameters(self) -> dict[str, Any]:
        """The settings by name; of those on reading files the ones that were given."""
        shared: dict[str, Any] = {"holdout": self.holdout, "max_effects": self.max_effects, "seed": self.seed}
        reading = {} if self.reading is None else vars(self.reading)
        return shared | {name: value for name, value in reading.items() if value not in (None, {})}


def run_job(job: Job, out: Path, settings: Settings) -> dict[str, Any]:
    """Run one job below `out/<name>`, or take what it gave before from there; a row of the summary.

    A job that cannot be done is a row with its reason, so that one bad file does not stop a hundred cells. What an
    earlier run left in its folder is moved into `earlier`, where nobody takes it for a result of these files.
    """
    folder = out / job.name
    if job.unusable:
        return _failed(job, folder, job.unusable)
    try:
        key = job.key(settings.key)
        finished = _finished_row(folder, key)
        if finished is not None:
            # Whose check-up it is, and when, may have been corrected in the plan since.
            return finished | _job_columns(job, "done")
        row = _row(job, folder, settings)
        write_whole(
            folder / ROW, json.dumps({"key": key, "code": source_digest(), "row": row}, indent=1) + "\n"
        )
    except AesiError as error:
        return _failed(job, folder, with_columns(str(error)))
    except OSError as error:
        return _failed(job, folder, f"{error.filename or 'a file'}: {error.strerror or error}.")
    return row


def _failed(job: Job, folder: Path, reason: str) -> dict[str, Any]:
    """The row of a job that cannot be done, after what lies in its folder from an earlier run was moved."""
    results = (ROW, FINDING, REPORT, MODEL, *(file.name for file in calibration_files(folder / CALIBRATED)))
    there = [name for name in results if (folder / name).exists()]
    if there:
        kept = folder / EARLIER
        try:
            shutil.rmtree(kept, ignore_errors=True)
            kept.mkdir()
            for name in there:
                (folder / name).rename(kept / name)
        except OSError as error:
            place = f"{error.filename or folder}: {error.strerror or error}"
            reason = f"{reason} What an earlier run found is still in {folder} ({place})."
        else:
            reason = f"{reason} What an earlier run found was moved to {kept}."
    return _job_columns(job, "failed") | {"reason": reason}


def lost_job(job: Job) -> dict[str, Any]:
    """The row of a job whose process the system ended."""
    reason = (
        "the system ended the process that worked on it, perhaps for want of memory; the same command tries it again, "
        "with fewer --workers there is more for each."
    )
    return _job_columns(job, "failed") | {"reason": reason}


def _job_columns(job: Job, status: str) -> dict[str, Any]:
    """The columns of a row that say which job it is of, and how that ended."""
    return {"name": job.name, "specimen": job.specimen, "at": job.at, "status": status}


def of_other_code(jobs: Iterable[Job], out: Path) -> list[str]:
    """The names of those jobs that another version of the program did before; they are done again."""
    kept = {job.name: _stored_row(out / job.name) for job in jobs if not job.unusable}
    return [name for name, one in kept.items() if one and one.get("code") != source_digest()]


def _finished_row(folder: Path, key: str) -> dict[str, Any] | None:
    """The row of a job that was done before, with the same files, settings and code. None where its finding or its
    page is gone: the row would stand alone then."""
    kept = _stored_row(folder)
    whole = kept.get("key") == key and all((folder / name).is_file() for name in (FINDING, REPORT))
    return kept["row"] if whole else None


def _stored_row(folder: Path) -> dict[str, Any]:
    """The row that a job left in its folder; empty where there is none that can be read."""
    try:
        kept = json.loads((folder / ROW).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return kept if isinstance(kept, dict) and isinstance(kept.get("row"), dict) else {}


def _row(job: Job, folder: Path, settings: Settings) -> dict[str, Any]:
    """The row of a job, done now: its discovery, and for a check-up its calibration, are written to the folder."""
    started = time.monotonic()
    case = case_of_files(
        job.cell,
        job.data,
        job.tests,
        reading=settings.reading,
        soc0=job.soc0,
        holdout=None if job.tests else settings.holdout,
        max_effects=settings.max_effects,
        seed=settings.seed,
        soh=job.soh,
    )
    content = write_discovery(folder, case, run_case(case, folder))
    row = _job_columns(job, "done") | {
        "verdict": content["verdict"],
        "effects": ", ".join(content["effects"]),
        "finding": short_finding(content),
        **{f"{state}_test_mv": content[state]["test"].get("rmse_mv") for state in STATES},
        "report": f"{job.name}/{REPORT}",
    }
    if job.specimen:
        calibrated = folder / CALIBRATED
        report = calibrate_files(
            job.cell, case.measurements, calibrated, Request(Conditions(soc0=job.soc0, same_cell=True))
        )
        for name, estimate in report["health"].items():
            row |= {name: estimate["value"], f"{name}_low": estimate["low"], f"{name}_high": estimate["high"]}
    return row | {"seconds": round(time.monotonic() - started, 1)}
