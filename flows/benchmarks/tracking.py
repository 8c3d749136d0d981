"""What tracking adds to a candidate: processor seconds with and without, on an empty SQLite store.

A candidate of the paper's size (88,200 rows, 100 resamples) on a small library, the cheapest a search of that
size has, so tracking weighs most. Rounds with and without it alternate; every thread of the process counts,
that of the outbox too. Each candidate carries an artifact of `artifact_kb`, ten metrics and fourteen parameters, as
those of a search do. `waits_s` is what the search itself waits for: the rest happens beside it.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveFloat, PositiveInt

from aesi.bench.hybrid.ensemble import SYNTHETIC_INPUTS, lowest_terms, synthetic_record
from aesi.pipeline.experiment.sections import TrackingConfig
from aesi.pipeline.written import COEFFICIENTS
from aesi.records import Split
from aesi.sparse import Genome, Options, Problem, evaluate
from aesi.sparse.terms.inputs import with_inputs
from flows.base import environment

METRICS = 10
"""How many metrics, and how many parameters, are logged: as many as of a candidate."""
PARAMETERS = 14
DELIVERY_S = 120.0
"""Wait for the store at the end."""


def run(
    terms: PositiveInt = 60,
    n: PositiveInt = 88_200,
    resamples: PositiveInt = 100,
    candidates: PositiveInt = 10,
    rounds: PositiveInt = 5,
    artifact_kb: PositiveFloat = 50.0,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One line: processor seconds a candidate, untracked and tracked, and the overhead in per cent."""
    problem = _problem(terms, n, resamples, seed)
    genomes = [
        Genome.whole(problem.library, 1e-3, float(t), 0.41) for t in np.geomspace(1e-2, 1.0, candidates)
    ]
    evaluate(problem, genomes[0])  # compiled code is loaded before anything is timed
    artifact = _artifact(artifact_kb, seed)
    with _workspace(), _tracker() as tracker:
        _round(problem, genomes[:1], tracker, artifact, "warm")
        untracked, tracked = [], []
        for number in range(rounds):
            untracked.append(_round(problem, genomes))
            tracked.append(_round(problem, genomes, tracker, artifact, f"{number}"))
    without, with_ = median(cpu for cpu, _ in untracked), median(cpu for cpu, _ in tracked)
    yield {
        "store": "SQLite",
        "rows": n,
        "terms": terms,
        "resamples": resamples,
        "candidates": candidates,
        "rounds": rounds,
        "artifact_kb": round(len(json.dumps(artifact)) / 1e3, 1),
        "untracked_s": without,
        "tracked_s": with_,
        "overhead_pct": 100.0 * (with_ - without) / without,
        "waits_s": median(waited for _, waited in tracked),
    }


def _round(
    problem: Problem,
    genomes: Sequence[Genome],
    tracker: Any = None,
    artifact: dict[str, float] | None = None,
    label: str = "",
) -> tuple[float, float]:
    """Processor seconds a candidate, and wall seconds a candidate that the caller waits for the tracker."""
    started, waited = time.process_time(), 0.0
    for number, genome in enumerate(genomes):
        evaluate(problem, genome)
        if tracker is not None:
            asked = time.perf_counter()
            tracker.nested(
                label=f"candidate:{label}:{number}",
                name=f"candidate {number:03d}",
                kind="candidate",
                params={f"parameter_{k}": k / 7 for k in range(PARAMETERS)},
                metrics={f"metric_{k}": k / 7 for k in range(METRICS)},
                files={COEFFICIENTS: artifact},
            )
            waited += time.perf_counter() - asked
    if tracker is not None:
        tracker.flush(DELIVERY_S)
    return (time.process_time() - started) / len(genomes), waited / len(genomes)


def _problem(terms: int, n: int, resamples: int, seed: int) -> Problem:
    record = with_inputs(synthetic_record(n + 1, seed), SYNTHETIC_INPUTS)
    return Problem.build(Split((record,), (), ()), Options(resamples=resamples), lowest_terms(terms))


def _artifact(kilobytes: float, seed: int) -> dict[str, float]:
    """Coefficients by term that take about so many bytes as JSON."""
    rng = np.random.default_rng(seed)
    pair = len(json.dumps({"T2(c_sp) T1(I)": -0.12345678901234567}))
    return {
        f"T{k % 5}(c_sp) T{k}(I)": float(v)
        for k, v in enumerate(rng.normal(size=int(1e3 * kilobytes / pair)))
    }


@contextmanager
def _workspace() -> Iterator[None]:
    """A workspace for the time of the benchmark, so that nothing of it is left in the user's store."""
    before = os.environ.get("AESI_HOME")
    with tempfile.TemporaryDirectory(prefix="aesi-bench-") as folder:
        os.environ["AESI_HOME"] = folder
        environment.prepare_process()
        try:
            yield
        finally:
            os.environ.pop("AESI_HOME") if before is None else os.environ.update(AESI_HOME=before)


@contextmanager
def _tracker() -> Iterator[Any]:
    from flows.tracking.store import Store
    from flows.tracking.tracker import Subject, Tracker

    settings = TrackingConfig(system_metrics=False, log_model=False)
    store = Store(f"sqlite:///{Path(os.environ['AESI_HOME']) / 'mlflow.db'}")
    tracker = Tracker(store, Subject("benchmark", 0, "benchmark", "benchmark", settings), lambda text: None)
    try:
        yield tracker
    finally:
        tracker.end("FINISHED")
