"""Findings on measured cells (`aesi.bench.real`), spread over processes or Dask workers, tracked, with a report.

Each case is a nested run in the experiment `real`; its parent holds the rates and the confusion matrix.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import PositiveFloat, PositiveInt

from aesi.bench.real import chosen, judged, lost, summary, table, write_report
from aesi.bench.real.case import RealCase
from aesi.bench.real.judge import LIMIT_S
from flows.benchmarks.cases import Cases, available_files, in_order, judged_once, tracked
from flows.benchmarks.page import write_between

PARAMETERS = ("group", "cell", "record", "put_in", "answer", "verdict", "effects", "source", "error")
BEGIN, END = "<!-- table of aesi bench real -->", "<!-- end of real -->"
ARCHIVE_MARKS = "<!-- table of aesi bench real, archive -->", "<!-- end of real, archive -->"


def run(
    cells: str = "experiments/cells",
    cases: PositiveInt | None = None,
    only: str | None = None,
    development: bool | None = None,
    every: PositiveInt = 1,
    archive: bool = False,
    limit_s: PositiveFloat | None = LIMIT_S,
    workers: PositiveInt = 1,
    address: str | None = None,
    report: str | None = None,
    write: str | None = None,
    keep: str | None = None,
) -> Iterator[dict[str, Any]]:
    """One dict a case as it is judged, and a last one with `summary`: true.

    cells : folder of the declared cell files.  cases, only, development, every, archive : which cases, see `chosen`.
    limit_s : processor seconds a case.  workers, address : processes here, or a Dask scheduler.
    report : an HTML file to write.  write : a page whose part between the two marks becomes the table.  keep : a folder
    for what each case gave; a case that is in it is not judged again by the same program, as it was asked, so that an
    interrupted run goes on.
    """
    specs = chosen(cases, only, development, every, archive)
    judge = partial(
        judged_once,
        judge=partial(judged, cells=cells, limit_s=limit_s),
        keep=keep,
        files=partial(_files, cells=cells),
    )
    rows = []
    for row in tracked(Cases("real", 0, specs, judge, summary, lost, PARAMETERS), workers, address):
        if row.get("summary"):
            if report:
                write_report(Path(report), rows, row)
            yield row
        else:
            rows.append(row)
            yield {key: value for key, value in row.items() if key != "residual"}
    if write is not None:
        marks = ARCHIVE_MARKS if archive else (BEGIN, END)
        write_between(write, *marks, table(in_order(rows, specs)))


def _files(case: RealCase, cells: str) -> Iterator[Path]:
    """The file of a case's cell, its records and spectra."""
    place, colon, file = case.cell.partition(":")
    if not colon:
        yield Path(cells) / case.cell
    takes = [case.take, *case.good, *([] if case.against is None else [case.against])]
    yield from available_files(
        [
            *([(place, file)] if colon else []),
            *((take.set, take.file) for take in takes),
            *([] if case.spectra is None else [(case.take.set, case.spectra)]),
        ]
    )
