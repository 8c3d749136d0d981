"""Errors of physics that was fitted without a fold, for the judgement of a search whose physics was fitted too.

A physics model fitted to the training drives has smaller errors on them than on the next drive. A correction must not
be judged on these errors. For each fold, the targets of fit and judgement are therefore those of physics fitted without
it: the whole procedure is cross-validated. Stone, J. R. Stat. Soc. B 36 (1974) 111.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.errors import DataError
from aesi.numerics.blocks import Span
from aesi.numerics.typing import Array
from aesi.records import HeldOutDrive
from aesi.records.checked import row_words
from aesi.sparse.terms.scaling import Scaling


@dataclass(frozen=True, eq=False)
class UnseenErrors:
    """targets : (n_folds, n) scaled e[k + 1] by the physics of each fold, or (0, n) with one physics for all folds.
    error, target : (n,) scaled e[k] and e[k + 1] of each row by physics that was fitted without its fold."""

    targets: Array
    error: Array
    target: Array


def refits_physics_per_fold(drives: bool, feedback: bool, parts: int, folds: int) -> bool:
    """Whether each fold is judged by the error of physics that was fitted without it.

    drives : whether folds are whole records or parts of them; for pieces of rows there is no such physics.
    feedback : whether terms may hold the error; all folds are then judged with the final physics.
    parts : number of folds with physics of their own; 0 with one physics for all.  folds : number of folds.
    Raises DataError where `parts` is neither 0 nor `folds`.
    """
    if not drives or feedback or not parts:
        return False
    if parts != folds:
        raise DataError(
            f"physics was fitted without {parts} parts of the training records, but the search leaves out {folds} in "
            "turn; give one for each, cut as the search cuts the records."
        )
    return True


def unseen_errors(
    left_out: Sequence[HeldOutDrive], scaling: Scaling, error: Array, target: Array, folds: Sequence[Span]
) -> UnseenErrors:
    """Errors of the physics fitted without each fold; where `left_out` is empty, `error` and `target` as they are.

    Raises DataError for the first of these errors that is not finite.
    """
    if not left_out:
        return UnseenErrors(np.empty((0, len(target))), error, target)
    for number, each in enumerate(left_out, start=1):
        for place, error_v in enumerate(each.errors_v, start=1):
            if not np.isfinite(error_v).all():
                row = int(np.flatnonzero(~np.isfinite(error_v))[0])
                raise DataError(
                    f"under the physics fitted without part {number} of the training records the error of training "
                    f"record {place} is not a number in {row_words(row)}."
                )
    before, after = (
        np.stack(
            [
                scaling.error_to_scaled(np.concatenate([error_v[which] for error_v in each.errors_v]))
                for each in left_out
            ]
        )
        for which in (slice(None, -1), slice(1, None))
    )
    fold_of_row = np.repeat(np.arange(len(folds)), [b - a for a, b in folds])
    rows = np.arange(len(target))
    return UnseenErrors(after, before[fold_of_row, rows], after[fold_of_row, rows])
