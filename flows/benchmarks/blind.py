"""The blind cases of `aesi.bench.blind`, spread over Dask workers where asked, and tracked.

Each case is a nested run in the experiment `blind`; its parent holds the rates and the confusion matrix.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from hashlib import sha256
from typing import Any

from aesi.bench.blind import chosen, judged, summary
from aesi.data.blind import CaseSpec
from aesi.pipeline.experiment.sections import TrackingConfig

SHOWN = ("cell", "label", "target_mv", "verdict", "effects", "indistinguishable", "error")


def run(
    cells: str = "experiments/cells",
    cases: int | None = None,
    only: str | None = None,
    small: bool = False,
    seed: int = 0,
    every: int = 1,
    workers: int = 1,
    address: str | None = None,
) -> Iterator[dict[str, Any]]:
    """One dict a case as it is judged, and a last one with `summary`: true.

    cells : folder of the two declared cell files.  cases, only, small, seed, every : which cases, see `chosen`.
    workers : processes on this machine.  address : of a Dask scheduler, whose workers must see `cells`.
    """
    from flows.base import environment
    from flows.base.console import Console
    from flows.tracking.store import Store
    from flows.tracking.tracker import Subject, Tracker

    environment.prepare()
    specs = chosen(cases, only, small, seed, every)
    digest = sha256(repr(specs).encode()).hexdigest()[:16]
    quiet = TrackingConfig(system_metrics=False, log_model=False)
    tracker = Tracker(Store(), Subject("blind", seed, digest, quiet), Console().say)
    tracker.parameters({"seed": seed, "cases": len(specs)})
    rows = []
    try:
        for row in _judged(specs, cells, workers, address):
            rows.append(row)
            _track(tracker, row)
            yield row
        rows.sort(key=lambda row: str(row["case"]))
        last = {"seed": seed, **summary(rows)}
        tracker.metrics({k: v for k, v in last.items() if isinstance(v, float)})
        tracker.json("confusion.json", last["confusion"])
    except BaseException:
        tracker.end("FAILED", wait_s=5)
        raise
    tracker.end("FINISHED")
    yield last


def _judged(specs: list[CaseSpec], cells: str, workers: int, address: str | None) -> Iterator[dict[str, Any]]:
    if workers == 1 and address is None:
        yield from (judged(spec, cells) for spec in specs)
        return
    from distributed import as_completed

    from flows.evaluation.dask_pool import connect

    client, cluster = connect(address, workers)
    try:
        futures = client.map(judged, specs, cells=cells, pure=False)
        for future in as_completed(futures, loop=client.loop):
            yield future.result()
    finally:
        client.close(timeout=5)
        if cluster is not None:
            cluster.close(timeout=10)


def _track(tracker: Any, row: dict[str, Any]) -> None:
    parameters = {k: v if isinstance(v, str) else json.dumps(v) for k, v in row.items() if k in SHOWN}
    metrics = {k: float(v) for k, v in row.items() if isinstance(v, bool | float) and k not in SHOWN}
    tracker.nested(f"case:{row['case']}", row["case"], "case", parameters, metrics, seconds=row["ours_s"])
