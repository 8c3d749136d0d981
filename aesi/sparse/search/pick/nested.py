"""Nested cross-validation of a search: the whole selection repeated without each fold in turn.

For each left-out fold the candidate and its amplitude are chosen by the other folds, with coefficients from fits
without it. The error on that fold then estimates the error on unseen rows: on an unseen drive where a fold is one, and
somewhat less where drives are cut into several, since the rest of the same drive stays. The validation loss that a
search reports of its own pick is optimistic, since the pick is the best of many (selection bias).
Varma & Simon, BMC Bioinformatics 7 (2006) 91, doi:10.1186/1471-2105-7-91.

The choice is of one candidate, by the squared error on the other folds alone. A search weighs that beside the error out
of bag. Where corrections do not fade it averages its fittest candidates (`average.py`), and the error is then that of
another model: a mean of candidates has errors that no sums of each tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array, BoolArray
from aesi.sparse.fade import shrunken_slope
from aesi.sparse.search.evaluate import Candidate
from aesi.sparse.search.problem import Problem


@dataclass(frozen=True, eq=False)
class NestedPick:
    """The choice of some folds: a candidate, and the amplitude of its correction, 1 where that does not fade."""

    candidate: Candidate
    amplitude: float


def picked(
    problem: Problem, candidates: Sequence[Candidate], ensemble: int, folds: BoolArray
) -> NestedPick | None:
    """The choice by some folds alone; None where no fold or no candidate is left.

    folds : (n_folds,) True for the folds to use.  ensemble : 0 for AESI I, 1 for AESI II, as in `Candidate.fold_sums`.
    """
    known = [c for c in candidates if np.isfinite(c.fold_sums[ensemble]).all()]
    if not folds.any() or not known:
        return None
    weights = np.array([problem.row_weights[a] for a, _ in problem.folds])
    sums = [(weights[:, None] * c.fold_sums[ensemble])[folds] for c in known]
    drives = problem.fold_drives[folds]
    amplitudes = [
        1.0 if c.ensembles[ensemble].fade is None else shrunken_slope(each, drives)
        for c, each in zip(known, sums, strict=True)
    ]
    squared_errors = [_squared_error(each, a).sum() for each, a in zip(sums, amplitudes, strict=True)]
    best = int(np.argmin(squared_errors))
    return NestedPick(known[best], amplitudes[best])


def nested_shares(problem: Problem, candidates: Sequence[Candidate], ensemble: int) -> Array:
    """(n_folds,) squared error on each fold by the candidate that the other folds choose, over that of the bare
    physics; 1 where they choose none, and where the bare physics has no error.

    ensemble : as for `picked`.
    """
    shares = np.ones(len(problem.folds))
    for d in range(len(problem.folds)):
        pick = picked(problem, candidates, ensemble, np.arange(len(problem.folds)) != d)
        if pick is not None and (sums := pick.candidate.fold_sums[ensemble][d])[0] > 0.0:
            shares[d] = _squared_error(sums, pick.amplitude) / sums[0]
    return shares


def _squared_error(sums: Array, amplitude: float) -> Array:
    """Summed |e - amplitude p|**2, from (..., 3) sums of e**2, e p and p**2."""
    return np.asarray(sums[..., 0] - 2.0 * amplitude * sums[..., 1] + amplitude**2 * sums[..., 2])
