"""Causal features of a series, from its recent past, for the prediction of the next value.

Row k is made of e[k-1], e[k-2], ... only, never of e[k]. With h the values since the last missing one:

    lags            h[1] ... h[N_LAGS]                     (most recent first)
    mean_m          mean of the last m values              m in SPANS and the window w
    deviation_m     root mean square about that mean
    step_m          mean absolute difference of neighbours
    |h[1]|          size of the last value

With fewer than w values, long spans use the available ones; with fewer than N_LAGS values there is no row. All
features are homogeneous of degree one: twice the series, twice the features. Batch and stream use the same
compiled function for a row, so their results are bitwise equal.
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array, BoolArray, IntArray

N_LAGS = 10
"""Number of single past values; a convention. The longer spans hold the slower past."""
SPANS = (5, 20, 60)
"""Lengths of the averages, in samples; a convention."""


def spans(window: int) -> IntArray:
    """The averaging spans for a window of `window` samples: SPANS below it, then the window itself."""
    return np.array([m for m in SPANS if m < window] + [window], dtype=np.int64)


def n_features(window: int) -> int:
    """Number of columns of `history_features` for this window."""
    return N_LAGS + 3 * len(spans(window)) + 1


@kept_njit()
def history_row(past: Array, lengths: IntArray, out: Array) -> None:
    """Fill `out` with the features of `past` ((m,) V, most recent last, m >= N_LAGS, all finite)."""
    m = past.size
    for j in range(N_LAGS):
        out[j] = past[m - 1 - j]
    column = N_LAGS
    for length in lengths:
        first = max(0, m - length)
        count = m - first
        total = 0.0
        steps = 0.0
        for i in range(first, m):
            total += past[i]
            if i > first:
                steps += abs(past[i] - past[i - 1])
        mean = total / count
        squares = 0.0
        for i in range(first, m):
            squares += (past[i] - mean) ** 2
        out[column] = mean
        out[column + 1] = np.sqrt(squares / count)
        out[column + 2] = steps / (count - 1)
        column += 3
    out[column] = abs(past[m - 1])


@kept_njit()
def _fill_rows(series: Array, window: int, lengths: IntArray, rows: Array, ready: BoolArray) -> None:
    run = 0  # finite values since the last missing one
    for k in range(series.size):
        if run >= N_LAGS:
            history_row(series[k - min(run, window) : k], lengths, rows[k])
            ready[k] = True
        run = run + 1 if np.isfinite(series[k]) else 0


def history_features(series: Array, window: int) -> tuple[Array, BoolArray]:
    """(features of every sample's past (n, n_features(window)), ready (n,)).

    series : (n,) V; a non-finite value is missing, and the history starts again after it.
    ready is False where the history is shorter than N_LAGS; that row is zero.
    """
    series = np.ascontiguousarray(series, dtype=float)
    rows = np.zeros((series.size, n_features(window)))
    ready = np.zeros(series.size, dtype=bool)
    _fill_rows(series, window, spans(window), rows, ready)
    return rows, ready


@kept_njit()
def runs_before(series: Array) -> IntArray:
    """(n,) number of finite values directly before each sample, since the last missing one."""
    out = np.zeros(series.size, dtype=np.int64)
    run = 0
    for k in range(series.size):
        out[k] = run
        run = run + 1 if np.isfinite(series[k]) else 0
    return out


def raw_lags(series: Array, window: int) -> tuple[Array, BoolArray]:
    """The last `window` values before each sample, most recent first: (rows (n, window), ready (n,)).

    Rows are views into one padded copy, so n windows cost the memory of one series.
    """
    series = np.ascontiguousarray(series, dtype=float)
    padded = np.concatenate([np.zeros(window), series])
    rows = np.lib.stride_tricks.sliding_window_view(padded, window)[: series.size, ::-1]
    return rows, runs_before(series) >= window
