"""The errors of physics that has not seen a fold: what a search is judged on where its physics was fitted too.

A physics model fitted to the training drives errs less on them than on the next drive. A correction that is judged on
what that model leaves of its own training data is judged on another error than it will meet, so for each fold the
targets of the fit and of the judgement are those of physics fitted without it: the whole procedure is left out.
Stone, J. R. Stat. Soc. B 36 (1974) 111.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.numerics.blocks import Span
from aesi.numerics.typing import Array
from aesi.records import HeldOutDrive
from aesi.sparse.terms.scaling import Scaling


@dataclass(frozen=True, eq=False)
class UnseenErrors:
    """targets : (n_folds, n) scaled e[k + 1] by the physics of each fold, or (0, n) where one physics serves all.
    error, target : (n,) scaled e[k] and e[k + 1] of each row by the physics that has not seen its fold."""

    targets: Array
    error: Array
    target: Array


def judged_unseen(fold: object, feedback: bool, parts: int, folds: int) -> bool:
    """Are folds judged by the error of physics that has not seen them?

    Not where they are pieces of a `fold` length, or terms hold the error itself, and only where there is a left-out
    part for each.
    """
    return fold is None and not feedback and parts == folds


def unseen_errors(
    left_out: Sequence[HeldOutDrive], scaling: Scaling, error: Array, target: Array, folds: Sequence[Span]
) -> UnseenErrors:
    """Errors of the physics fitted without each fold; where `left_out` is empty, `error` and `target` as they are."""
    if not left_out:
        return UnseenErrors(np.empty((0, len(target))), error, target)
    before, after = (
        np.stack(
            [
                scaling.error_to_scaled(np.concatenate([error_v[which] for error_v in each.errors_v]))
                for each in left_out
            ]
        )
        for which in (slice(None, -1), slice(1, None))
    )
    own = np.repeat(np.arange(len(folds)), [b - a for a, b in folds])
    rows = np.arange(len(target))
    return UnseenErrors(after, before[own, rows], after[own, rows])
