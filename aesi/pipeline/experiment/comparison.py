"""The part of one run on the page that compares runs: uncertainty of its figures, genes, terms, maps of its error."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.blocks import INTERVAL_BLOCKS, pieces, resampled_interval
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.outputs import Result, published_by
from aesi.pipeline.experiment.physics_models import DECLARED
from aesi.pipeline.report.arrays.binning import error_map
from aesi.pipeline.report.views import RecordTrace
from aesi.sparse.search.rows import spans_of

SCHEMA = "aesi.comparison/1"
DRAWS = 4000
"""Number of block-bootstrap resamples. The ends of a 90 % interval are then known to half a percentile."""
SHARE = 0.9
"""Nominal coverage of the bootstrap intervals."""
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
    """Bootstrap intervals [low, high] of a model's test figures: RMSE, mV, and reduction of the declared model's mean
    squared error, per cent. The records are resampled in about `INTERVAL_BLOCKS` blocks, of which none reaches over two
    records. The same blocks are drawn for the model and for the declared physics, so that what both have in common
    cancels in the reduction. A single block, of a test of one row, has no interval: empty."""
    spans = spans_of([len(trace.time_s) for trace in tests])
    starts = np.array([start for start, _ in pieces(spans, max(1, spans[-1][1] // INTERVAL_BLOCKS))])

    def block_sums(of: Callable[[RecordTrace], Array]) -> Array:
        return np.asarray(np.add.reduceat(np.concatenate([of(trace) for trace in tests]), starts))

    squares = block_sums(lambda trace: _free_run_error_v(trace, name) ** 2)
    bare = block_sums(lambda trace: _free_run_error_v(trace, DECLARED) ** 2)
    rows = np.diff(starts, append=spans[-1][1])
    if len(rows) < 2:
        return {}
    drawn = np.random.default_rng([seed, 7]).integers(len(rows), size=(DRAWS, len(rows)))
    total = squares[drawn].sum(axis=1)
    rmse = MV_PER_V * np.sqrt(total / rows[drawn].sum(axis=1))
    reduction = 100.0 * (1.0 - total / bare[drawn].sum(axis=1))
    return {
        "test_rmse_mv": list(resampled_interval(rmse, len(rows), SHARE)),
        "test_mser_pct": list(resampled_interval(reduction, len(rows), SHARE)),
    }


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
