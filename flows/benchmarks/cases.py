"""Benchmarks that judge case by case: spread over processes or Dask workers, each case a nested run."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aesi import bench
from aesi.bench import CaseRow
from aesi.bench.limit import NOT_RUN
from aesi.data.catalogue import locate
from aesi.errors import DataError
from aesi.numerics.files.source_digest import source_digest
from aesi.numerics.files.whole import write_whole
from aesi.pipeline.experiment.sections import TrackingConfig
from aesi.pipeline.product.contents import contents
from aesi.pipeline.written import SUMMARY
from flows.base import fingerprint
from flows.base.console import Console
from flows.evaluation.spread import in_processes, on_dask

if TYPE_CHECKING:
    from flows.tracking.tracker import Tracker

NO_FIGURES = ("seed", "cases", "summary")
"""Keys of the last line that are parameters of the run, or tell the line apart."""


@dataclass(frozen=True)
class Cases:
    """What is judged and how.

    name : of the experiment in the tracking store.  judge : a specification -> its row, a function that a process
    elsewhere can import (or a partial of one).  summary : rows -> the last line.  lost : a specification -> its row
    where the system ended the process that judged it.
    parameters : keys of a row that are tracked as parameters of its run; its other numbers are metrics.
    """

    name: str
    seed: int
    specs: Sequence[Any]
    judge: Callable[[Any], CaseRow]
    summary: Callable[[list[CaseRow]], CaseRow]
    lost: Callable[[Any], CaseRow]
    parameters: tuple[str, ...]


def tracked(cases: Cases, workers: int = 1, address: str | None = None) -> Iterator[CaseRow]:
    """One row a case as it is judged, and a last one with `summary`: true; runs of the same name that were killed are
    closed first.

    workers : processes on this machine.  address : of a Dask scheduler, whose workers see the same files.
    """
    from flows.base import environment
    from flows.jobs.run_session import tracked_job
    from flows.tracking.tracker import Subject

    environment.prepare_process()
    digest = sha256(repr(cases.specs).encode()).hexdigest()[:16]
    quiet = TrackingConfig(system_metrics=False, log_model=False)
    subject = Subject(cases.name, cases.seed, digest, "benchmark", quiet)
    title = f"{cases.name}, seed {cases.seed}"
    rows = []
    with tracked_job(subject, title, Console()) as tracker:
        if tracker is not None:
            tracker.parameters({"seed": cases.seed, "cases": len(cases.specs)})
        for row in _rows(cases, workers, address):
            rows.append(row)
            if tracker is not None:
                _track(tracker, row, cases.parameters)
            yield row
        rows.sort(key=lambda row: str(row["case"]))
        last = {"seed": cases.seed, **cases.summary(rows)}
        if tracker is not None:
            tracker.metrics(_other_numbers(last, NO_FIGURES))
            if "confusion" in last:
                tracker.json("confusion.json", last["confusion"])
            tracker.json(SUMMARY, last)
    yield last


def judged_once(
    case: Any,
    judge: Callable[[Any], CaseRow],
    keep: str | None,
    files: Callable[[Any], Iterable[Path]],
) -> CaseRow:
    """The row of a case: the one in the folder `keep`, if it is of the same program, case, arguments and files, else a
    new one, which is then kept there.

    case : its `repr` has to tell it from all others; `case.name` names its file.  judge : a function of a case, or a
    partial of one.  keep : None judges every time.  files : case -> files and folders whose content its row depends on.
    A case whose data are not available here is not kept.
    """
    if keep is None:
        return judge(case)
    path = Path(keep) / f"{case.name}.json"
    asked = repr(judge.keywords) if isinstance(judge, partial) else ""
    key = fingerprint.key(repr(case), asked, *contents(files(case)))
    of_this = {"program": _program(), "key": key}
    known = _read(path)
    if {name: known.get(name) for name in of_this} == of_this:
        return dict(known["row"])
    if known:
        Console().say(f"{case.name}: {path} is of another program, other settings or files; judged again.")
    row = judge(case)
    if row.get("verdict") != NOT_RUN:
        write_whole(path, json.dumps(of_this | {"row": row}))
    return row


def in_order(rows: Iterable[CaseRow], specs: Sequence[Any]) -> list[CaseRow]:
    """The rows in the order of the specifications that they were judged from, whichever came first."""
    place = {spec.name: k for k, spec in enumerate(specs)}
    return sorted(rows, key=lambda row: place[row["case"]])


def available_files(files: Iterable[tuple[str, str]]) -> Iterator[Path]:
    """The paths of those of the files that are on this machine or can be fetched.

    files : (data set, name of the file) of each.
    """
    for data, name in files:
        with suppress(DataError):
            yield locate(data, name)


def kept_rows(folder: str) -> list[CaseRow]:
    """The rows that `judged_once` of this program has kept in a folder, by the name of their case."""
    rows, other = [], []
    for path in sorted(Path(folder).rglob("*.json")):
        known = _read(path)
        if known.get("program") == _program():
            rows.append(known["row"])
        else:
            other.append(path.stem)
    if other:
        Console().say(f"{folder}: of another program, and left out: {'; '.join(other)}.")
    return rows


def _program() -> str:
    """The package, its benchmarks, and the search that they run."""
    flows = Path(__file__).resolve().parents[1]
    return source_digest(Path(bench.__file__).parent, flows / "benchmarks", flows / "search")


def _read(path: Path) -> dict[str, Any]:
    """What the file of a row holds: row, program and key; nothing where there is no file that can be read."""
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}


def _rows(cases: Cases, workers: int, address: str | None) -> Iterator[CaseRow]:
    """The rows of the cases as they come, in any order."""
    if address is not None:
        return on_dask(cases.judge, cases.specs, workers, address, cases.lost)
    if workers == 1:
        return map(cases.judge, cases.specs)
    return in_processes(cases.judge, cases.specs, workers, cases.lost)


def _track(tracker: Tracker, row: CaseRow, parameters: tuple[str, ...]) -> None:
    values = {k: v if isinstance(v, str) else json.dumps(v) for k, v in row.items() if k in parameters}
    metrics = _other_numbers(row, parameters)
    tracker.nested(f"case:{row['case']}", row["case"], "case", values, metrics, seconds=row["ours_s"])


def _other_numbers(row: CaseRow, without: tuple[str, ...]) -> dict[str, float]:
    """The numbers of a row, what is true among them as 1, but those of the given keys."""
    return {k: float(v) for k, v in row.items() if isinstance(v, int | float) and k not in without}
