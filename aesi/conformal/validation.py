"""Scores of the intervals of one candidate of a search: calibrated on its residuals, judged on validation records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.conformal.intervals import Intervals
from aesi.conformal.online.method import Method
from aesi.conformal.scores import Scores, scores_of
from aesi.numerics.typing import Array

Driven = tuple[Array, Array]
"""(one-step-ahead residuals of a record, (n,) V; the current at these samples, (n,) A)."""
PIECES = 20
"""Number of runs, spread over all records, to which calibration residuals are thinned."""


def validation_scores(
    method: Method,
    calibration: Sequence[Driven],
    judged: Sequence[Driven],
    alpha: float,
    window: int,
    rng: np.random.Generator,
    max_residuals: int,
) -> Scores:
    """Coverage, width and interval score on the validation records, all samples pooled.

    calibration, judged : one pair per continuous record, residuals out of sample.  max_residuals : the calibration is
    thinned to evenly spaced pieces with about this many samples in all. Raises as `Method.fit` does.
    """
    records, currents = zip(*spaced_pieces(calibration, max_residuals), strict=True)
    calibrated = method.fit(records, alpha, window, rng, currents)
    parts = [calibrated.intervals(residuals, current_a) for residuals, current_a in judged]
    together = Intervals(
        np.concatenate([part.lower_v for part in parts]),
        np.concatenate([part.upper_v for part in parts]),
        np.concatenate([part.warm for part in parts]),
    )
    return scores_of(together, np.concatenate([residuals for residuals, _ in judged]), alpha)


def spaced_pieces(records: Sequence[Driven], max_samples: int) -> list[Driven]:
    """The records, cut down to about `max_samples` in PIECES evenly spaced pieces (each a record of its own); as they
    are where they hold no more."""
    total = sum(len(residuals) for residuals, _ in records)
    if total <= max_samples:
        return list(records)
    step, length = total / PIECES, max_samples // PIECES
    kept: list[Driven] = []
    start = 0
    for residuals, current_a in records:
        first = np.ceil(start / step) * step - start
        for begin in np.arange(first, len(residuals), step).astype(int):
            piece = np.s_[begin : begin + length]
            kept.append((residuals[piece], current_a[piece]))
        start += len(residuals)
    return kept
