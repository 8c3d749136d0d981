"""The reduction of the squared error by a candidate, for each physics model in the tables, in free run.

    r_p = 100 - (100 - r) E / E_p                                                                         (1)

A search judges by r, per cent of the squared error E of the physics that it corrects. The tables say r_p, per cent of
the error E_p of the declared model or of the recalibrated one on the same samples: those of the validation records, or
of the left-out pieces where there are none.
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
"""Name of a reduction -> the physics whose error it is taken off, in the rows of models and of candidates alike."""


def valid_shares(problem: Problem, left_out: LeftOutDrives) -> dict[str, float]:
    """Name of a reduction -> E / E_p of (1); NaN where that physics is exact."""
    pieces = tuple(_judged_pieces(problem, left_out))
    corrected = sum(float(np.sum(piece.error_v**2)) for piece in pieces)
    squares = {
        key: sum(float(np.sum(piece.left_by(name) ** 2)) for piece in pieces) for key, name in AGAINST.items()
    }
    return {key: corrected / square if square > 0.0 else float("nan") for key, square in squares.items()}


def valid_reductions(candidate: Candidate, shares: Mapping[str, float]) -> dict[str, float]:
    """Name of a reduction -> (1) of AESI I, per cent; shares : those of its problem."""
    left = 100.0 - candidate.free_run_valid_mser_pct
    return {key: 100.0 - left * share for key, share in shares.items()}


def _judged_pieces(problem: Problem, left_out: LeftOutDrives) -> Iterator[ErrorSeries]:
    """The samples on which candidates are judged, without the measured ones that free runs start from; left-out pieces
    under physics that has not seen them, where the search judges so."""
    if problem.split.valid:
        yield from (record.take(slice(1, None)) for record in problem.split.valid)
        return
    unseen = refits_physics_per_fold(
        problem.folds_are_drives, problem.options.feedback, len(left_out.parts), len(problem.folds)
    )
    for number, (a, b) in enumerate(problem.folds):
        record, rows = fold_samples(problem, a, b)
        yield (left_out.parts[number].series if unseen else record).take(rows)
