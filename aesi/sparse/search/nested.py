"""Nested cross-validation of a search: the whole selection repeated without each drive in turn.

For each left-out drive the candidate and its amplitude are chosen by the other drives, with coefficients from fits
without it; the error on that drive then estimates the error on a drive that nobody has seen. The validation loss that a
search reports of its own pick is optimistic, since the pick is the best of many (selection bias).
Varma & Simon, BMC Bioinformatics 7 (2006) 91, doi:10.1186/1471-2105-7-91.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.numerics.typing import Array
from aesi.sparse.fade import shrunken
from aesi.sparse.search.evaluate import Candidate
from aesi.sparse.search.problem import Problem

ENSEMBLES = (0, 1)
"""AESI I and II, as in `Candidate.fold_sums`."""


def nested_shares(problem: Problem, candidates: Sequence[Candidate], ensemble: int) -> Array:
    """(n_folds,) the share of each fold's squared error that is left by what the other folds chose.

    ensemble : 0 for AESI I, 1 for AESI II.  1 everywhere where there are fewer than two folds.
    """
    folds = len(problem.folds)
    known = [c.fold_sums[ensemble] for c in candidates if np.isfinite(c.fold_sums).all()]
    if folds < 2 or not known:
        return np.ones(folds)
    weights = np.array([problem.row_weights[a] for a, _ in problem.folds])
    sums = np.stack(known) * weights[:, None]
    shares = np.empty(folds)
    for d in range(folds):
        others = np.delete(sums, d, axis=1)
        amplitudes = np.array([shrunken(each) if problem.options.fade else 1.0 for each in others])
        pick = int(np.argmin([_left(each, a).sum() for each, a in zip(others, amplitudes, strict=True)]))
        shares[d] = _left(sums[pick, d], amplitudes[pick]) / sums[pick, d, 0]
    return shares


def _left(sums: Array, amplitude: float) -> Array:
    return np.asarray(sums[..., 0] - 2.0 * amplitude * sums[..., 1] + amplitude**2 * sums[..., 2])
