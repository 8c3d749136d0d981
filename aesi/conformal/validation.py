"""Scores of the intervals of one candidate of a search: calibrated on its residuals, judged on validation records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.conformal.intervals import Intervals
from aesi.conformal.online.method import Method
from aesi.conformal.scores import Scores, scores_of
from aesi.numerics.typing import Array

MAX_RESIDUALS = 20_000
"""Most calibration residuals: enough for half a per cent of coverage, in a fraction of a second."""
PIECES = 20
"""Number of runs, spread over all records, to which calibration residuals are thinned."""


def validation_scores(
    method: Method,
    residuals: Sequence[Array],
    valid_residuals: Sequence[Array],
    alpha: float = 0.1,
    window: int = 200,
    rng: np.random.Generator | None = None,
    current_a: Sequence[Array] | None = None,
    valid_current_a: Sequence[Array] | None = None,
    max_residuals: int = MAX_RESIDUALS,
) -> Scores:
    """Coverage, width and interval score on the validation records, all samples pooled.

    residuals, valid_residuals : one (n_i,) array per continuous record, V, out of sample.  current_a, valid_current_a :
    one (n_i,) array per record, A, both or neither.  max_residuals : the calibration is thinned to evenly spaced
    pieces with about this many samples in all. Raises as `Method.fit` does.
    """
    records, currents = spaced_pieces(residuals, current_a, max_residuals)
    calibrated = method.fit(records, alpha, window, rng, currents)
    parts = [
        calibrated.intervals(record, None if valid_current_a is None else valid_current_a[i])
        for i, record in enumerate(valid_residuals)
    ]
    together = Intervals(
        np.concatenate([part.lower_v for part in parts]),
        np.concatenate([part.upper_v for part in parts]),
        np.concatenate([part.warm for part in parts]),
    )
    return scores_of(together, np.concatenate(list(valid_residuals)), alpha)


def spaced_pieces(
    records: Sequence[Array], currents: Sequence[Array] | None, max_samples: int
) -> tuple[list[Array], list[Array] | None]:
    """The records and their currents, cut down to about `max_samples` in PIECES evenly spaced pieces (each a
    record of its own); as they are where they hold no more."""
    total = sum(len(r) for r in records)
    if total <= max_samples:
        return list(records), None if currents is None else list(currents)
    step, length = total / PIECES, max_samples // PIECES
    kept: list[Array] = []
    kept_current: list[Array] = []
    start = 0
    for i, record in enumerate(records):
        first = np.ceil(start / step) * step - start
        for begin in np.arange(first, len(record), step).astype(int):
            kept.append(record[begin : begin + length])
            if currents is not None:
                kept_current.append(currents[i][begin : begin + length])
        start += len(record)
    return kept, None if currents is None else kept_current
