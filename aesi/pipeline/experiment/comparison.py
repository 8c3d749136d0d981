"""The content of one run on the page that compares runs: uncertainty of its figures, its genes and terms, maps of its
error."""

from __future__ import annotations

from typing import Any

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.outputs import Result, published_by
from aesi.pipeline.experiment.physics_models import DECLARED
from aesi.pipeline.report.arrays.binning import error_map
from aesi.pipeline.report.views import RecordTrace

SCHEMA = "aesi.comparison/1"
BLOCK_S = 60.0
"""Length of a bootstrap block, s: errors forget each other within about this time."""
DRAWS = 1000
"""Block-bootstrap resamples: the ends of a 90 % interval are then known to about a percentile."""
LEVEL_PCT = 90.0
BINS = 16
"""Bins of current, and of state of charge."""


def comparison(result: Result) -> dict[str, Any]:
    """JSON content: 90 % intervals of the test figures by model, and genes, terms and maps of the chosen one."""
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


def _left(trace: RecordTrace, name: str) -> Array:
    """(n,) V that the model leaves in free run; the error of the physics where the model is not among the traces."""
    if name in trace.all_physics_v:
        return trace.measured_v - trace.all_physics_v[name]
    if name not in trace.predictions:
        return trace.measured_v - trace.physics_v
    return trace.measured_v - trace.predictions[name].free_run_v


def _intervals(tests: list[RecordTrace], name: str, seed: int) -> dict[str, list[float]]:
    """Percentiles over resampled blocks of the test records; the same blocks for the model and the declared physics."""
    squares = np.concatenate([_block_sums(trace, _left(trace, name)) for trace in tests])
    bare = np.concatenate([_block_sums(trace, _left(trace, DECLARED)) for trace in tests])
    rows = np.concatenate([_block_sums(trace, np.ones(len(trace.time_s))) for trace in tests])
    drawn = np.random.default_rng([seed, 7]).integers(len(rows), size=(DRAWS, len(rows)))
    total = squares[drawn].sum(axis=1)
    rmse = MV_PER_V * np.sqrt(total / rows[drawn].sum(axis=1))
    reduction = 100.0 * (1.0 - total / bare[drawn].sum(axis=1))
    ends = (50 - LEVEL_PCT / 2, 50 + LEVEL_PCT / 2)
    return {
        "test_rmse_mv": [float(v) for v in np.percentile(rmse, ends)],
        "test_mser_pct": [float(v) for v in np.percentile(reduction, ends)],
    }


def _block_sums(trace: RecordTrace, values: Array) -> Array:
    """(blocks,) sums of squares over blocks of a record."""
    step = float(np.median(np.diff(trace.time_s)))
    starts = np.arange(0, len(values), max(1, round(BLOCK_S / step)))
    return np.asarray(np.add.reduceat(values**2, starts))


def _map(tests: list[RecordTrace], name: str) -> dict[str, Any]:
    """Mean error in bins over current and state of charge, mV; None where a bin has too few samples."""
    current = np.concatenate([trace.current_a for trace in tests])
    soc = np.concatenate([trace.soc for trace in tests])
    error = MV_PER_V * np.concatenate([_left(trace, name) for trace in tests])
    binned = error_map(current, soc, error, BINS)
    return {
        "current_a": [round(float(v), 3) for v in binned.current_a],
        "soc": [round(float(v), 4) for v in binned.soc],
        "mean_mv": [[None if v != v else round(float(v), 3) for v in row] for row in binned.mean],
    }
