"""The blind cases of `aesi.bench.blind`, spread over processes or Dask workers where asked, and tracked.

Each case is a nested run in the experiment `blind`; its parent holds the rates and the confusion matrix.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from pydantic import NonNegativeInt, PositiveFloat, PositiveInt

from aesi.bench.blind import LIMIT_S, chosen, judged, lost, summary, table
from flows.benchmarks.cases import Cases, in_order, tracked
from flows.benchmarks.page import write_between

PARAMETERS = (
    "cell",
    "model",
    "records",
    "label",
    "verdict",
    "effects",
    "indistinguishable",
    "false_names",
    "error",
)
BEGIN, END = "<!-- table of aesi bench blind -->", "<!-- end of blind -->"


def run(
    cells: str = "experiments/cells",
    cases: PositiveInt | None = None,
    only: str | None = None,
    small: bool = False,
    seed: NonNegativeInt = 0,
    every: PositiveInt = 1,
    after: NonNegativeInt = 0,
    limit_s: PositiveFloat | None = LIMIT_S,
    workers: PositiveInt = 1,
    address: str | None = None,
    write: str | None = None,
) -> Iterator[dict[str, Any]]:
    """One dict a case as it is judged, and a last one with `summary`: true.

    cells : folder of the declared cell files.  cases, only, small, seed, every, after : which cases, see `chosen`.
    limit_s : processor seconds a case.  workers : processes on this machine.  address : of a Dask scheduler, whose
    workers must see `cells`.  write : a page whose part between the two marks becomes the table.
    """
    specs = chosen(cases, only, small, seed, every, after)
    judge = partial(judged, cells=cells, limit_s=limit_s)
    rows = []
    for row in tracked(Cases("blind", seed, specs, judge, summary, lost, PARAMETERS), workers, address):
        rows.append(row)
        yield row
    if write is not None:
        write_between(write, BEGIN, END, table(in_order(rows[:-1], specs)))
