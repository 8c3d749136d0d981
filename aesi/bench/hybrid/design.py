"""`aesi bench design`: which setting of the search yields the correction that predicts unseen cycles best?

The cells are those of the layout `repeats` in `virtual_drives`: a drive of five WLTC cycles of 1,800 s at 1 Hz, on
cells that differ from the declared cell at random. Cycles 1, 3 and 5 train; 2 and 4 are predicted in free run. Every
setting is tried on the same cells. The search evaluates `candidates` genomes and chooses by the losses of the setting;
SINDy-C gets the same budget and the same ranges. The figure is the reduction of the mean squared error on the test
cycles, per cent (MSER). In its mean over the cells, negative reductions count as zero, so that a cell on which a model
fails badly weighs no more than one on which it does not help; `tenth` is the tenth percentile over the cells. A cell on
which no candidate of a setting can be evaluated counts as a reduction of zero (`failed`), so that all settings are
compared on the same cells.
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

from aesi.bench import AtLeastOne, check_listed
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
"""Options of the search problem that all settings share. Like the weights and ranges below they are conventions, near
the defaults of an experiment on measured cells."""

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
"""Name of a setting -> its options that differ from BASE."""

WEIGHTS = FitnessWeights(0.45, 0.45, 0.10)
"""Weights of the fitness: out-of-bag loss, validation loss, sparsity."""
SPACE = GenomeSpace(1, lambda1=(0.1, 1e3), lambda2=(1e-3, 0.3), p_c=(0, 3), d=(1, 2))
POPULATION = 20
USEFUL_PCT = 45.0
"""Reduction of the squared error, per cent: the cells below it are counted. A convention."""


def run(
    cell: str = "experiments/cells/nmc_30ah.bpx.json",
    virtual: PositiveInt = 4,
    candidates: PositiveInt = 40,
    settings: AtLeastOne[str] = tuple(SETTINGS),
    seed: NonNegativeInt = 0,
    sindy: bool = True,
) -> Iterator[dict[str, Any]]:
    """One row per setting: the reduction of the mean squared error in free run on the test cycles, over all cells.

    cell : BPX file of the declared cell.  virtual : number of virtual cells.  candidates : genomes that each search
    evaluates.  settings : names in SETTINGS.  seed : of the virtual cells.  sindy : whether SINDy-C is included.
    Raises InputError for an unknown setting.
    """
    check_listed("settings", settings, SETTINGS)
    splits = list(virtual_splits(Cell.from_bpx(Path(cell)), "repeats", virtual, seed))
    for name in settings:
        options = replace(BASE, **SETTINGS[name])
        started = process_time()
        reductions = [
            _reductions(split, replace(options, seed=k), candidates, sindy) for k, split in enumerate(splits)
        ]
        spent = process_time() - started
        line = {"setting": name, "cells": virtual, "candidates": candidates, "cpu_s": round(spent, 1)}
        yield line | _summary(reductions)


def _reductions(split: Split, options: Options, candidates: int, sindy: bool) -> dict[str, float]:
    """Model -> reduction of the mean squared error on the test cycles of one cell, per cent; empty if no candidate can
    be evaluated."""
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
        with suppress(FitError):  # raised if none of its candidates can be evaluated
            models.append(tuned_sindy_c(problem, options.seed, candidates, POPULATION, space))
    return {model.name: _reduction(model, split) for model in models}


def _reduction(model: ErrorModel, split: Split) -> float:
    truth = np.concatenate([record.error_v[1:] for record in split.test])
    predicted = np.concatenate([model.free_run(record).error_v[1:] for record in split.test])
    return float(mser(truth, predicted))


def _summary(reductions: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    line: dict[str, Any] = {"failed": sum(not cell for cell in reductions)}
    for name in (*ENSEMBLES, "SINDy-C"):
        if not any(name in cell for cell in reductions):
            continue
        values = np.array([cell.get(name, 0.0) for cell in reductions])
        key = name.lower().replace(" ", "_").replace("-", "_")
        line |= {
            f"{key}_mean_pct": round(float(np.maximum(values, 0.0).mean()), 2),
            f"{key}_median_pct": round(float(np.median(values)), 2),
            f"{key}_tenth_pct": round(float(np.quantile(values, 0.1)), 2),
            f"{key}_below_{USEFUL_PCT:.0f}": int((values < USEFUL_PCT).sum()),
        }
    return line
