"""Are free-run bands as wide as they have to be? Virtual cells by the dozen, one design beside another.

Every cell is fitted with the same genome, and calibrated as an experiment calibrates: by models that did not see the
piece (halves of repeats and whole ones, or drives), and by the validation record where there is one. One line a layout
(and for all), horizon and design, with means over the cells. A single drive has few independent errors, so its coverage
scatters: `coverage_sd_pct` says by how much, `coverage_se_pct` what that leaves open of the mean over cells, which
share the schedules of their layout. `score_ratio` is against the best constant width in hindsight, which knows the
test. The truth is a function of the state here, alike in all repeats: a whole one that is left out errs more than a
test repeat, which lies between two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from time import process_time
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench.virtual_drives import SplitLayout, cuts_of, virtual_splits
from aesi.conformal import WHOLE_DRIVE
from aesi.conformal.scores import interval_score, worst_bin_coverage
from aesi.constants import MV_PER_V
from aesi.numerics.typing import Array
from aesi.physics import Cell
from aesi.pipeline.experiment.intervals.bands import WHOLE, OutOfSampleErrors, Unseen
from aesi.records import Failed, Split
from aesi.records.horizons import HORIZONS_S
from aesi.sparse import Genome, Options, Problem, evaluate
from aesi.sparse.search.fold_models import fold_models, with_leverage

ALPHA = 0.1
"""Bands for 90 %."""
OPTIONS = Options(p_c=3, d=2, mixed=False, resamples=50, block=100)
RIDGE, THRESHOLD = 10.0, 1e-3
"""Genes of the one genome that is fitted: conventions, in the midst of what a search tries."""
LAYOUTS: tuple[SplitLayout, ...] = ("repeats", "schedules", "beyond")


@dataclass(frozen=True, eq=False)
class _Errors:
    """Of one cell: what to calibrate on, how many stretches of it err independently, what came of the test records."""

    calibration: OutOfSampleErrors
    test: OutOfSampleErrors
    stretches: int


HalfWidths = dict[float, list[Array]]
"""Horizon in s -> (n,) V a test record."""


def one_width(errors: _Errors) -> HalfWidths:
    """The same width everywhere: the quantile of all left-out errors."""
    return {
        h: [np.full(len(e), np.nanquantile(np.abs(np.concatenate(left)), 1 - ALPHA)) for e in errors.test.soc]
        for h, left in errors.calibration.by_horizon.items()
    }


def without_leverage(errors: _Errors) -> HalfWidths:
    """The bands of the package, blind to how far a sample lies from the fitted rows."""
    nothing: list[Array | None] = [None] * len(errors.calibration.soc)
    return bands(replace(errors, calibration=replace(errors.calibration, excess=nothing)))


def without_spread(errors: _Errors) -> HalfWidths:
    """The bands of the package, blind to what the fitted rows leave open of the physics."""
    calibration, test = (
        replace(each, spread=[np.zeros(len(s)) for s in each.spread])
        for each in (errors.calibration, errors.test)
    )
    return bands(replace(errors, calibration=calibration, test=test))


def held_at_the_edge(errors: _Errors) -> HalfWidths:
    """The bands of the package, no wider where the model leaves its trained range."""
    nowhere = {h: [np.zeros(len(r)) for r in each] for h, each in errors.test.reach.items()}
    return bands(replace(errors, test=replace(errors.test, reach=nowhere)))


def best_width(errors: _Errors) -> HalfWidths:
    """The best constant width in hindsight: the quantile of the test errors themselves."""
    return one_width(replace(errors, calibration=errors.test))


def bands(errors: _Errors) -> HalfWidths:
    """The bands of the package."""
    found, test = errors.calibration.bands(ALPHA, errors.stretches), errors.test
    return {
        h: [found.at(h, p, x, r)[1] for p, x, r in zip(test.spread, test.excess, test.reach[h], strict=True)]
        for h in errors.calibration.by_horizon
    }


DESIGNS: dict[str, Callable[[_Errors], HalfWidths]] = {
    "one width": one_width,
    "scaled, without leverage": without_leverage,
    "scaled, without spread": without_spread,
    "scaled, without reach": held_at_the_edge,
    "scaled": bands,
    "best width in hindsight": best_width,
}


def run(
    cell: str = "experiments/cells/nmc_30ah.bpx.json",
    cells: PositiveInt = 40,
    layouts: Sequence[SplitLayout] = LAYOUTS,
    seed: NonNegativeInt = 0,
    **_: Any,
) -> Iterator[dict[str, Any]]:
    """cell : BPX file of the declared cell.  cells : virtual cells a layout.  layouts : see `SplitLayout`."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        everywhere: dict[tuple[str, float], list[Array]] = {}
        for layout in layouts:
            splits = virtual_splits(Cell.from_bpx(cell), layout, cells, seed)
            errors = [e for e in (_errors(split, cuts_of(layout)) for split in splits) if e is not None]
            for name, design in DESIGNS.items():
                started = process_time()
                widths = [design(each) for each in errors]
                fit_s = (process_time() - started) / len(errors)
                for horizon in (*HORIZONS_S, WHOLE_DRIVE):
                    figures = np.array(
                        [_judged(e.test, w, horizon) for e, w in zip(errors, widths, strict=True)]
                    )
                    everywhere.setdefault((name, horizon), []).append(figures)
                    yield _line(layout, name, horizon, seed, figures) | {"fit_s": round(fit_s, 4)}
        if len(layouts) > 1:
            for (name, horizon), parts in everywhere.items():
                yield _line("all", name, horizon, seed, np.concatenate(parts))


def _errors(split: Split, cuts: int) -> _Errors | None:
    """None where the genome fails on this cell.  cuts : into how many parts a drive is cut to be left out."""
    problem = Problem.build(split, replace(OPTIONS, cuts=cuts))
    chosen = evaluate(problem, Genome.whole(problem.library, RIDGE, THRESHOLD, 0.5, 1, 1))
    if isinstance(chosen, Failed):
        return None
    model = with_leverage(chosen.bagging, problem, chosen.genome.lambda1)
    pairs: list[Unseen] = [(model, record, WHOLE) for record in problem.split.valid]
    pairs += fold_models(problem, chosen)
    stretches = len(pairs)
    if cuts > 1:
        pairs += fold_models(problem, chosen, cut=problem.spans)
    tested: list[Unseen] = [(model, record, WHOLE) for record in problem.split.test]
    train = problem.split.train
    return _Errors(
        OutOfSampleErrors.of(pairs, train, HORIZONS_S),
        OutOfSampleErrors.of(tested, train, HORIZONS_S),
        stretches,
    )


def _judged(test: OutOfSampleErrors, widths: HalfWidths, horizon: float) -> tuple[float, ...]:
    """Coverage, mean width, interval score, worst bin, and the score over that of the best constant width."""
    left, half = np.concatenate(test.by_horizon[horizon]), np.concatenate(widths[horizon])
    seen = np.isfinite(left)
    covered = np.where(seen, np.abs(left) <= half, np.nan)
    best = np.full(len(left), np.quantile(np.abs(left[seen]), 1 - ALPHA))
    score = interval_score(-half, half, left, ALPHA)
    worst = worst_bin_coverage(covered, np.concatenate(test.current_a), np.concatenate(test.soc))
    return (
        float(np.nanmean(covered)),
        float(2 * half[seen].mean()),
        score,
        worst,
        score / interval_score(-best, best, left, ALPHA),
    )


def _line(layout: str, design: str, horizon: float, seed: int, figures: Array) -> dict[str, Any]:
    coverage, width, score, worst, ratio = figures.T
    return {
        "layout": layout,
        "method": design,
        "horizon_s": horizon if isfinite(horizon) else None,
        "cells": len(figures),
        "seed": seed,
        "coverage_pct": round(100 * float(coverage.mean()), 2),
        "coverage_sd_pct": round(100 * float(coverage.std()), 2),
        "coverage_se_pct": round(100 * float(coverage.std()) / len(coverage) ** 0.5, 2),
        "width_mv": round(MV_PER_V * float(width.mean()), 3),
        "interval_score_mv": round(MV_PER_V * float(score.mean()), 3),
        "worst_bin_coverage_pct": round(100 * float(np.nanmean(worst)), 2),
        "score_ratio": round(float(np.exp(np.log(ratio).mean())), 4),
    }
