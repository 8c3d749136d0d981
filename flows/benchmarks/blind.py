"""The blind cases of `aesi.bench.blind`, spread over processes or Dask workers where asked, and tracked.

Each case is a nested run in the experiment `blind`; its parent holds the rates and the confusion matrix.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from aesi.bench.blind import LIMIT_S, chosen, judged, summary
from flows.benchmarks.cases import Cases, tracked

SHOWN = (
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


def run(
    cells: str = "experiments/cells",
    cases: int | None = None,
    only: str | None = None,
    small: bool = False,
    seed: int = 0,
    every: int = 1,
    limit_s: float | None = LIMIT_S,
    workers: int = 1,
    address: str | None = None,
) -> Iterator[dict[str, Any]]:
    """One dict a case as it is judged, and a last one with `summary`: true.

    cells : folder of the declared cell files.  cases, only, small, seed, every : which cases, see `chosen`.
    limit_s : processor seconds a case.  workers : processes on this machine.  address : of a Dask scheduler, whose
    workers must see `cells`.
    """
    specs = chosen(cases, only, small, seed, every)
    judge = partial(judged, cells=cells, limit_s=limit_s)
    yield from tracked(Cases("blind", seed, specs, judge, summary, SHOWN), workers, address)
