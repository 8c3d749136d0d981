"""The reduction of the squared error in free run by a candidate, relative to each physics model in the tables.

    r_p = 100 - (100 - r) E / E_p                                                                         (1)

A search judges candidates by r, the reduction in per cent of the squared error E of the physics that is corrected. The
tables show r_p, the reduction of the squared error E_p of the declared or of the recalibrated model. Both are over the
same samples: the validation records, or the left-out pieces if there are no validation records.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from aesi.pipeline.experiment.physics_models import DECLARED, RECALIBRATED
from aesi.records import ErrorSeries, LeftOutDrives
from aesi.sparse import Candidate, Problem
from aesi.sparse.search.fold_models import fold_samples
from aesi.sparse.search.unseen import refits_physics_per_fold

AGAINST = {"mser_pct": DECLARED, "mser_recalibrated_pct": RECALIBRATED}
"""Key of a reduction -> physics model whose squared error it is relative to, in the rows of models and candidates."""


def valid_shares(problem: Problem, left_out: LeftOutDrives) -> dict[str, float]:
    """Key of a reduction -> E / E_p of (1); NaN if the error of that physics is zero."""
    pieces = tuple(_judged_pieces(problem, left_out))
    corrected = sum(float(np.sum(piece.error_v**2)) for piece in pieces)
    squares = {
        key: sum(float(np.sum(piece.left_by(name) ** 2)) for piece in pieces) for key, name in AGAINST.items()
    }
    return {key: corrected / square if square > 0.0 else float("nan") for key, square in squares.items()}


def valid_reductions(candidate: Candidate, shares: Mapping[str, float]) -> dict[str, float]:
    """Key of a reduction -> r_p of (1) for AESI I, per cent.

    shares : of `valid_shares` for the problem of the candidate.
    """
    left = 100.0 - candidate.free_run_valid_mser_pct
    return {key: 100.0 - left * share for key, share in shares.items()}


def _judged_pieces(problem: Problem, left_out: LeftOutDrives) -> Iterator[ErrorSeries]:
    """The samples on which candidates are judged, without the first one of each record, which a free run starts from.
    Left-out pieces are under physics that has not seen them, if the search judges them so."""
    if problem.split.valid:
        yield from (record.take(slice(1, None)) for record in problem.split.valid)
        return
    unseen = refits_physics_per_fold(
        problem.folds_are_drives, problem.options.feedback, len(left_out.parts), len(problem.folds)
    )
    for number, (a, b) in enumerate(problem.folds):
        record, rows = fold_samples(problem, a, b)
        yield (left_out.parts[number].series if unseen else record).take(rows)
