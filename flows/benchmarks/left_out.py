"""Each measured record left out in turn (`aesi.bench.left_out`), spread over processes or Dask workers, tracked."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import PositiveFloat, PositiveInt

from aesi.bench.left_out import LIMIT_S, LeftOutCase, judged, lost, plan, summary, table
from flows.benchmarks.cases import Cases, available_files, in_order, judged_once, tracked
from flows.benchmarks.page import write_between

PARAMETERS = ("cell", "record", "verdict", "effects", "error")
BEGIN, END = "<!-- table of aesi bench left_out -->", "<!-- end of left_out -->"


def run(
    cells: str = "experiments/cells",
    only: str | None = None,
    development: bool = False,
    limit_s: PositiveFloat | None = LIMIT_S,
    workers: PositiveInt = 1,
    address: str | None = None,
    write: str | None = None,
    keep: str | None = None,
) -> Iterator[dict[str, Any]]:
    """One dict a record as it is judged, and a last one with `summary`: true.

    cells : folder of the declared cell files.  only : substring of the case, which is set/record.  development : the
    sets of development instead.  limit_s : processor seconds a case.  workers, address : processes here, or a Dask
    scheduler.  write : a page whose part between the two marks becomes the table.  keep : a folder for what each case
    gave; a case that is in it is not judged again by the same program, as it was asked, so that an interrupted run goes
    on.
    """
    rows, specs = [], plan(only, development)
    judge = partial(
        judged_once,
        judge=partial(judged, cells=cells, limit_s=limit_s),
        keep=keep,
        files=partial(_files, cells=cells),
    )
    for row in tracked(Cases("left_out", 0, specs, judge, summary, lost, PARAMETERS), workers, address):
        rows.append(row)
        yield row
    if write is not None:
        write_between(write, BEGIN, END, table(in_order(rows[:-1], specs)))


def _files(case: LeftOutCase, cells: str) -> Iterator[Path]:
    """The file of a case's cell, and the records of its set."""
    one = case.set
    if one.cell is not None:
        yield Path(cells) / one.cell
    names = (*([] if one.cell else ["cell.bpx.json"]), *one.slow, *one.drives)
    yield from available_files((one.data, name) for name in names)
