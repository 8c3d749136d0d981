"""`aesi bench bands`: are free-run bands as wide as they have to be?

Several designs of the bands are compared on many virtual cells (`virtual_drives`). Every cell is fitted with the same
genome. The bands are calibrated as in an experiment: on the errors that models leave on pieces they were not fitted to
(halves of repeats and whole repeats, or drives), and on the validation record if there is one. The benchmark yields one
row per layout, horizon and design, with means over the cells, and then the same over all layouts.

A single drive has few independent errors, so that its coverage scatters: `coverage_sd_pct` is the standard deviation
over the cells, `coverage_se_pct` the standard error of the mean, both null for one cell. The standard error is over
cells only; the cells of a layout share their schedules. `score_ratio` is the interval score over that of the best
constant width in hindsight, which is set on the test errors themselves (geometric mean over the cells). The true error
of these cells is a function of the states, and the same in all repeats. A whole repeat that is left out therefore has
larger errors than a test repeat, which lies between two training repeats; the bands of the layout `repeats` are wider
than necessary.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import isfinite
from time import process_time
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench import AtLeastOne
from aesi.bench.virtual_drives import SplitLayout, cuts_of, virtual_splits
from aesi.conformal import WHOLE_DRIVE
from aesi.conformal.scores import interval_score, worst_bin_coverage
from aesi.constants import MV_PER_V
from aesi.errors import FitError
from aesi.numerics.typing import Array
from aesi.physics import Cell
from aesi.pipeline.experiment.intervals.bands import ALL_BUT_FIRST, OutOfSampleErrors, Unseen
from aesi.records import Failed, Split
from aesi.records.horizons import HORIZONS_S
from aesi.sparse import Genome, Options, Problem, evaluate
from aesi.sparse.search.fold_models import fold_models, with_leverage

ALPHA = 0.1
"""Nominal share of misses: bands for 90 %."""
OPTIONS = Options(p_c=3, d=2, mixed=False, resamples=50, block=100)
RIDGE, THRESHOLD = 10.0, 1e-3
"""lambda1 and lambda2 of the genome that all cells are fitted with. Conventions, in the middle of the ranges that a
search tries."""
LAYOUTS: tuple[SplitLayout, ...] = ("repeats", "schedules", "beyond")


@dataclass(frozen=True, eq=False)
class _Errors:
    """The errors of the models of one cell.

    calibration : on left-out pieces and the validation record.  test : on the test records.  stretches : number of
    stretches of the calibration data whose errors are independent of each other.
    """

    calibration: OutOfSampleErrors
    test: OutOfSampleErrors
    stretches: int


HalfWidths = dict[float, list[Array]]
"""Horizon, s -> half width of the band along each test record, (n,) V."""


def one_width(errors: _Errors) -> HalfWidths:
    """The same width everywhere: the quantile of the absolute errors of calibration."""
    return {
        h: [np.full(len(e), np.nanquantile(np.abs(np.concatenate(left)), 1 - ALPHA)) for e in errors.test.soc]
        for h, left in errors.calibration.by_horizon.items()
    }


def without_leverage(errors: _Errors) -> HalfWidths:
    """The bands of the package without the term for the distance of a sample from the fitted rows (leverage)."""
    no_excess: list[Array | None] = [None] * len(errors.calibration.soc)
    return bands(replace(errors, calibration=replace(errors.calibration, excess=no_excess)))


def without_spread(errors: _Errors) -> HalfWidths:
    """The bands of the package without the term for the uncertainty of the physical parameters (spread)."""
    calibration, test = (
        replace(each, spread=[np.zeros(len(s)) for s in each.spread])
        for each in (errors.calibration, errors.test)
    )
    return bands(replace(errors, calibration=calibration, test=test))


def without_reach(errors: _Errors) -> HalfWidths:
    """The bands of the package without the widening where the model leaves its trained range (reach)."""
    no_reach = {h: [np.zeros(len(r)) for r in each] for h, each in errors.test.reach.items()}
    return bands(replace(errors, test=replace(errors.test, reach=no_reach)))


def best_width(errors: _Errors) -> HalfWidths:
    """The best constant width in hindsight: the quantile of the absolute test errors."""
    return one_width(replace(errors, calibration=errors.test))


def bands(errors: _Errors) -> HalfWidths:
    """The bands of the package, calibrated by `OutOfSampleErrors.bands`."""
    found, test = errors.calibration.bands(ALPHA, errors.stretches), errors.test
    return {
        h: [found.at(h, p, x, r)[1] for p, x, r in zip(test.spread, test.excess, test.reach[h], strict=True)]
        for h in errors.calibration.by_horizon
    }


DESIGNS: dict[str, Callable[[_Errors], HalfWidths]] = {
    "one width": one_width,
    "scaled, without leverage": without_leverage,
    "scaled, without spread": without_spread,
    "scaled, without reach": without_reach,
    "scaled": bands,
    "best width in hindsight": best_width,
}


def run(
    cell: str = "experiments/cells/nmc_30ah.bpx.json",
    virtual: PositiveInt = 40,
    layouts: AtLeastOne[SplitLayout] = LAYOUTS,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One row per layout, horizon and design.

    cell : BPX file of the declared cell.  virtual : virtual cells of each layout.  layouts : see `SplitLayout`.
    seed : of the virtual cells.  Widths and scores are in mV; `horizon_s` is null for the whole drive. `cells` counts
    those that a model could be fitted to.  Raises FitError if there is none in a layout.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        everywhere: dict[tuple[str, float], list[Array]] = {}
        for layout in layouts:
            splits = virtual_splits(Cell.from_bpx(cell), layout, virtual, seed)
            errors = [e for e in (_errors(split, cuts_of(layout)) for split in splits) if e is not None]
            if not errors:
                raise FitError(
                    f"bands: the genome gives no model of any of the {virtual} cells of the layout {layout}; ask for "
                    "more cells (virtual), or another seed."
                )
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
    """The errors of one cell; None if the genome cannot be evaluated on it.  cuts : number of parts into which a drive
    is cut to be left out in turn."""
    problem = Problem.build(split, replace(OPTIONS, cuts=cuts))
    chosen = evaluate(problem, Genome.whole(problem.library, RIDGE, THRESHOLD, 0.5, 1, 1))
    if isinstance(chosen, Failed):
        return None
    model = with_leverage(chosen.bagging, problem, chosen.genome.lambda1)
    pairs: list[Unseen] = [(model, record, ALL_BUT_FIRST) for record in problem.split.valid]
    pairs += fold_models(problem, chosen)
    stretches = len(pairs)
    if cuts > 1:
        pairs += fold_models(problem, chosen, cut=problem.spans)
    tested: list[Unseen] = [(model, record, ALL_BUT_FIRST) for record in problem.split.test]
    train = problem.split.train
    return _Errors(
        OutOfSampleErrors.of(pairs, train, HORIZONS_S),
        OutOfSampleErrors.of(tested, train, HORIZONS_S),
        stretches,
    )


def _judged(test: OutOfSampleErrors, widths: HalfWidths, horizon: float) -> tuple[float, ...]:
    """(coverage; mean width, V; interval score, V; lowest coverage in a bin; score over that of the best constant
    width) of the test records of one cell at one horizon. Coverages are shares, 0 to 1."""
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
    cells = len(figures)
    sd_pct = 100 * float(coverage.std(ddof=1)) if cells > 1 else None
    return {
        "layout": layout,
        "method": design,
        "horizon_s": horizon if isfinite(horizon) else None,
        "cells": cells,
        "seed": seed,
        "coverage_pct": round(100 * float(coverage.mean()), 2),
        "coverage_sd_pct": None if sd_pct is None else round(sd_pct, 2),
        "coverage_se_pct": None if sd_pct is None else round(sd_pct / cells**0.5, 2),
        "width_mv": round(MV_PER_V * float(width.mean()), 3),
        "interval_score_mv": round(MV_PER_V * float(score.mean()), 3),
        "worst_bin_coverage_pct": round(100 * float(np.nanmean(worst)), 2),
        "score_ratio": round(float(np.exp(np.log(ratio).mean())), 4),
    }
