"""Throughput of two Dask workers over one, on the same candidates, on this machine.

A cluster of processes on loopback; each worker has built the problem before the clock starts, because that is
done once a study. Two ratios: `ratio` of wall seconds, which needs as many idle cores as workers, and
`ratio_by_processor`, the processor seconds of the one worker over those of the busier of several, which a busy
machine does not disturb: it shows what is lost to repeated work and to unequal shares, but not what cores that
share a cache and a memory bus lose. `load` is the machine's one-minute load before the start.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from pydantic import PositiveInt

from aesi.pipeline.experiment.config import ExperimentConfig, read_experiment
from aesi.records import Failed
from aesi.sparse import Genome, Problem

HEAVIER = (
    "library.p_c=[0, 2]",
    "library.d=[1, 3]",
    "search.resamples=100",
    "data.dt_s=1.0",
    "search.timeout_s=600",
)
WAIT_S = 600.0
"""For workers that do not come."""


def run(
    experiment: str = "experiments/smoke.yaml",
    candidates: PositiveInt = 24,
    workers: PositiveInt = 2,
    overrides: Sequence[str] = HEAVIER,
) -> Iterator[dict[str, Any]]:
    """One line: seconds of one worker and of several, and both ratios.

    overrides : laid over the experiment, so that a candidate takes about a second.
    """
    from aesi.pipeline.experiment.fit import build_problem
    from aesi.pipeline.experiment.load import load
    from flows.base import environment

    environment.prepare_process()
    config = read_experiment(experiment, overrides)
    problem = build_problem(load(config), config)
    genomes = _genomes(problem, candidates)
    load_before = os.getloadavg()[0]
    one_s, one_cpu = _measured(config, genomes, 1)
    several_s, several_cpu = _measured(config, genomes, workers)
    yield {
        "runner": "dask",
        "rows": len(problem.target),
        "terms": len(problem.library),
        "candidates": candidates,
        "workers": workers,
        "one_s": one_s,
        "ours_s": several_s,
        "ratio": one_s / several_s,
        "ratio_by_processor": max(one_cpu) / max(several_cpu),
        "load": load_before,
    }


def _genomes(problem: Problem, candidates: int) -> list[Genome]:
    """Candidates of like cost: the whole library under thresholds that differ."""
    return [Genome.whole(problem.library, 1e-2, float(t), 0.41) for t in np.geomspace(1e-3, 0.1, candidates)]


def _measured(config: ExperimentConfig, genomes: Sequence[Genome], workers: int) -> tuple[float, list[float]]:
    """Wall seconds of all candidates, and the processor seconds of each worker."""
    from flows.evaluation.dask_pool import DaskPool

    limits = config.search.timeout_s, config.search.memory_mb
    pool = DaskPool(config.model_dump_json(), str(config.base), None, workers, *limits)
    try:
        _all(pool, [genomes[0]] * (2 * workers))  # each worker builds the problem
        before = pool.processor_s()
        started = time.monotonic()
        _all(pool, genomes)
        wall = time.monotonic() - started
        after = pool.processor_s()
    finally:
        pool.close()
    return wall, [after[name] - before[name] for name in after]


def _all(pool: Any, genomes: Sequence[Genome]) -> None:
    waiting, done = list(enumerate(genomes)), 0
    deadline = time.monotonic() + WAIT_S
    while done < len(genomes):
        while waiting and pool.idle:
            pool.start(*waiting.pop(0))
        for _, outcome in pool.collect(1.0):
            done += 1
            if isinstance(outcome, Failed) and outcome.reason.startswith("its worker"):
                raise RuntimeError(outcome.reason)
        if time.monotonic() > deadline:
            raise RuntimeError(f"{len(genomes) - done} candidates are not done after {WAIT_S:g} s")
