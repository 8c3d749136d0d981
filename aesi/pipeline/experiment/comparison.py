"""The part of one run on the page that compares runs: uncertainty of its figures, genes, terms, maps of its error."""

from __future__ import annotations

from typing import Any

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.quantiles import student_widening
from aesi.numerics.typing import Array, IntArray
from aesi.pipeline.experiment.outputs import Result, published_by
from aesi.pipeline.experiment.physics_models import DECLARED
from aesi.pipeline.report.arrays.binning import error_map
from aesi.pipeline.report.views import RecordTrace

SCHEMA = "aesi.comparison/1"
BLOCK_S = 300.0
"""Length of a bootstrap block, s. On drives of measured cells n seconds of a model's error tell as much as n / 45 to
n / 670 independent ones (see `aesi.tracer.case.problem`). Of simulated errors of one hour for which that is 120 and 400
s, nominal 90 % intervals of the RMSE hold the true one in 85 and 76 % of cases; with blocks of 60 s, as if these told
the scatter exactly, in 76 and 55 %."""
DRAWS = 1000
"""Number of block-bootstrap resamples. The ends of a 90 % interval are then known to about one percentile."""
LEVEL_PCT = 90.0
"""Nominal coverage of the bootstrap intervals, per cent."""
BINS = 16
"""Number of bins of the current, and of the state of charge, in a map. A convention."""


def comparison(result: Result) -> dict[str, Any]:
    """JSON content of a run: 90 % intervals of the test figures by model, the genes and terms of the chosen candidate,
    and maps of the error of the declared and of the chosen model."""
    tests = [trace for trace in result.evaluation.traces if trace.role == "test"]
    chosen = result.best
    shown = published_by(result.loaded.model)
    names = [str(row["name"]) for row in result.evaluation.rows]
    return {
        "schema": SCHEMA,
        "intervals": {shown(name): _intervals(tests, name, result.config.seed) for name in names},
        "genome": {k: v for k, v in result.chosen.genome.to_dict().items() if k != "terms"},
        "terms": result.ensemble.coefficient_table() if result.ensemble else {},
        "maps": {shown(name): _map(tests, name) for name in dict.fromkeys((DECLARED, chosen))},
    }


def _free_run_error_v(trace: RecordTrace, name: str) -> Array:
    """Error of a model in free run along a record, (n,) V, measured minus model; that of the corrected physics for a
    name without a prediction in the trace."""
    if name in trace.all_physics_v:
        return trace.measured_v - trace.all_physics_v[name]
    if name not in trace.predictions:
        return trace.measured_v - trace.physics_v
    return trace.measured_v - trace.predictions[name].free_run_v


def _intervals(tests: list[RecordTrace], name: str, seed: int) -> dict[str, list[float]]:
    """Bootstrap intervals [low, high] of a model's test figures, of those that have one (see `_ratio_interval`): RMSE,
    mV, and reduction of the declared model's mean squared error, per cent. The same blocks are drawn for the model and
    for the declared physics, so that what both have in common cancels in the reduction."""
    squares = np.concatenate([_block_sums(trace, _free_run_error_v(trace, name)) for trace in tests])
    bare = np.concatenate([_block_sums(trace, _free_run_error_v(trace, DECLARED)) for trace in tests])
    rows = np.concatenate([_block_sums(trace, np.ones(len(trace.time_s))) for trace in tests])
    drawn = np.random.default_rng([seed, 7]).integers(len(rows), size=(DRAWS, len(rows)))
    out = {}
    if (mean_square := _ratio_interval(squares, rows, drawn)) is not None:
        out["test_rmse_mv"] = [MV_PER_V * float(np.sqrt(v)) for v in mean_square]
    if (left := _ratio_interval(squares, bare, drawn)) is not None:
        out["test_mser_pct"] = [100.0 * (1.0 - v) for v in reversed(left)]
    return out


def _ratio_interval(over: Array, under: Array, drawn: IntArray) -> tuple[float, float] | None:
    """Interval of the ratio of two sums over blocks, from resamples of the blocks; None for a single block, and for a
    ratio of zero or without bound.

    m blocks tell the scatter as m samples do, so the interval is as wide as Student's t has it, in the logarithm of the
    ratio, which stays positive.
    over, under : (m,) of each block, >= 0.  drawn : (DRAWS, m) blocks of each resample.
    """
    m = len(over)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.log(over.sum() / under.sum())
        resampled = np.log(over[drawn].sum(axis=1) / under[drawn].sum(axis=1))
    if m == 1 or not np.isfinite(resampled).all():
        return None
    ends = np.percentile(resampled, (50 - LEVEL_PCT / 2, 50 + LEVEL_PCT / 2))
    wider = np.sqrt(m / (m - 1)) * student_widening(m, 1 - LEVEL_PCT / 100)
    low, high = np.exp(value + wider * (ends - value))
    return float(low), float(high)


def _block_sums(trace: RecordTrace, values: Array) -> Array:
    """Sums of squares over consecutive blocks of BLOCK_S of a record, (blocks,).  values : (n,)."""
    step = float(np.median(np.diff(trace.time_s)))
    starts = np.arange(0, len(values), max(1, round(BLOCK_S / step)))
    return np.asarray(np.add.reduceat(values**2, starts))


def _map(tests: list[RecordTrace], name: str) -> dict[str, Any]:
    """Mean error of a model in free run on the test records by bins of current and state of charge, mV; None in a bin
    with too few samples."""
    current = np.concatenate([trace.current_a for trace in tests])
    soc = np.concatenate([trace.soc for trace in tests])
    error = MV_PER_V * np.concatenate([_free_run_error_v(trace, name) for trace in tests])
    binned = error_map(current, soc, error, BINS)
    return {
        "current_a": [round(float(v), 3) for v in binned.current_a],
        "soc": [round(float(v), 4) for v in binned.soc],
        "mean_mv": [[None if v != v else round(float(v), 3) for v in row] for row in binned.mean],
    }
