"""Which design of the search simulates unseen repeats best? Settings compared on virtual cells, one line each.

The cells are those of `virtual_drives`: a drive that repeats every 1,800 s at 1 Hz, cells that differ at random
from what is declared, training on repeats 1, 3 and 5, free run on 2 and 4. Every setting sees the same cells; a
search of `candidates` genomes picks by the losses of that setting, for the two ensembles and, with the same
budget and ranges, for SINDy-C. The reduction of the squared error counts from zero up, so that one cell on which
a model is useless weighs no more than one on which it is of no use; `tenth` is the tenth percentile over cells. A
cell on which no candidate of a setting survives counts as one without a reduction (`failed`), so that every setting is
judged by the same cells.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench.virtual_drives import INPUTS, virtual_splits
from aesi.errors import FitError
from aesi.numerics.metrics import mser
from aesi.physics import Cell
from aesi.records import ErrorModel, Split
from aesi.sparse import ENSEMBLES, FitnessWeights, Options, Problem, evaluate
from aesi.sparse.baselines.sindy_c import tuned_sindy_c
from aesi.sparse.search.evolution import fittest
from aesi.sparse.search.genome_space import GenomeSpace

BASE = Options(inputs=INPUTS, p_c=3, d=2, mixed=False, block=100, fold=200)
"""Options of the problem, as in the experiment on the measured drive."""

SETTINGS: dict[str, dict[str, Any]] = {
    "fold 100": {"fold": 100},
    "fold 200": {},
    "fold 400": {"fold": 400},
    "an eighth": {"fold": None},
    "fold 1800": {"fold": 1800},
    "block 50": {"block": 50},
    "block 200": {"block": 200},
    "horizon 1800": {"horizon": 1800},
    "rows count alike": {"balance": False},
}
"""Name -> what differs from BASE."""

WEIGHTS = FitnessWeights(0.45, 0.45, 0.10)
"""Those of the experiment on the measured drive, and its ranges and population below."""
SPACE = GenomeSpace(1, lambda1=(0.1, 1e3), lambda2=(1e-3, 0.3), p_c=(0, 3), d=(1, 2))
POPULATION = 20
USEFUL_PCT = 45.0
"""A reduction of the squared error below this is counted."""


def run(
    cell: str = "experiments/cells/nmc_30ah.bpx.json",
    cells: PositiveInt = 4,
    candidates: PositiveInt = 40,
    settings: Sequence[str] = tuple(SETTINGS),
    seed: NonNegativeInt = 0,
    sindy: bool = True,
    **_: Any,
) -> Iterator[dict[str, Any]]:
    """One line a setting: reduction of the squared error in free run on unseen repeats, over all cells."""
    splits = list(virtual_splits(Cell.from_bpx(Path(cell)), "repeats", cells, seed))
    for name in settings:
        options = replace(BASE, **SETTINGS[name])
        started = process_time()
        reached = [
            _reached(split, replace(options, seed=k), candidates, sindy) for k, split in enumerate(splits)
        ]
        spent = process_time() - started
        line = {"setting": name, "cells": cells, "candidates": candidates, "cpu_s": round(spent, 1)}
        yield line | _summary(reached)


def _reached(split: Split, options: Options, candidates: int, sindy: bool) -> dict[str, float]:
    """Model -> reduction in per cent on the test repeats; none where no candidate survives."""
    problem = Problem.build(split, options)
    space = replace(SPACE, size=len(problem.library))
    rng = np.random.default_rng(options.seed)
    judge = partial(evaluate, problem, weights=WEIGHTS)
    try:
        chosen = fittest(space, judge, candidates, POPULATION, rng)
    except FitError:
        return {}
    models: list[ErrorModel] = [*chosen.ensembles]
    if sindy:
        with suppress(FitError):  # none of its candidates survives
            models.append(tuned_sindy_c(problem, options.seed, candidates, POPULATION, space))
    return {model.name: _reduction(model, split) for model in models}


def _reduction(model: ErrorModel, split: Split) -> float:
    truth = np.concatenate([record.error_v[1:] for record in split.test])
    predicted = np.concatenate([model.free_run(record).error_v[1:] for record in split.test])
    return float(mser(truth, predicted))


def _summary(reached: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    line: dict[str, Any] = {"failed": sum(not cell for cell in reached)}
    for name in (*ENSEMBLES, "SINDy-C"):
        if not any(name in cell for cell in reached):
            continue
        values = np.array([cell.get(name, 0.0) for cell in reached])
        key = name.lower().replace(" ", "_").replace("-", "_")
        line |= {
            f"{key}_mean_pct": round(float(np.maximum(values, 0.0).mean()), 2),
            f"{key}_median_pct": round(float(np.median(values)), 2),
            f"{key}_tenth_pct": round(float(np.quantile(values, 0.1)), 2),
            f"{key}_below_{USEFUL_PCT:.0f}": int((values < USEFUL_PCT).sum()),
        }
    return line
