"""The validation figure, which predicts the test figure of a model from the training drives alone.

    figure = 1 - median_d S_d / E_d                                                                       (1)

E_d is the squared error of the declared physics on a left-out piece d, and S_d that of the model; the fit of the
physics, the search and the fit of the model are repeated without the piece. The pieces are whole drives and, if the
search leaves out parts of drives, these parts as well. A part lies closer to the rest of its drive than a test drive
does; a whole drive lies further from the others than a test drive does that has a training drive on either side. The
figure uses the median, because a ratio of sums would be dominated by one piece: the one with the largest error of the
physics, or one on which physics that has not seen it fails by volts.

Over the ten development splits of the NMC drive in `aesi bench splits` (16 candidates), the figure of AESI I differs
from the test figure by 2.8 percentage points in the median and by 49 at worst. With sums over the parts alone it
differed by 6.5 and 75. With a share S_d / E_d that grows with the distance of the test's rows from the nearest fitted
state of charge it differed by 16 or more: the growth between parts and drives does not continue further away.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from aesi.numerics.blocks import Span
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.experiment.physics_models import DECLARED, PHYSICS_NAMES
from aesi.records import ErrorSeries, HeldOutDrive
from aesi.sparse import ENSEMBLES, Candidate, Problem
from aesi.sparse.search.fold_models import fold_models, fold_samples
from aesi.sparse.search.pick.nested import nested_shares, picked

SquaresLeft = dict[str, float]
"""Model -> sum of its squared errors on a left-out piece, V**2."""


def validation_mser(loaded: Loaded, problem: Problem, candidates: Sequence[Candidate]) -> dict[str, float]:
    """Model -> the figure (1), per cent: the reduction of the declared physics' squared error on the median piece.

    The physics is refitted without each piece, and the ensembles are chosen without it (`picked`). A piece on which the
    error of the declared physics is exactly zero has no share and is left out, as a test record has no reduction then.
    Empty if no piece has one, and if the search leaves out other pieces than drives or parts of them.
    """
    if len(problem.folds) < 2 or not problem.folds_are_drives:
        return {}
    every = [*_part_squares(loaded, problem, candidates), *_drive_squares(loaded, problem, candidates)]
    pieces = [left for left in every if left[DECLARED] > 0.0]
    if not pieces:
        return {}
    return {
        name: 100.0 * (1.0 - float(np.median([left[name] / left[DECLARED] for left in pieces])))
        for name in pieces[0]
    }


def _part_squares(loaded: Loaded, problem: Problem, candidates: Sequence[Candidate]) -> Iterator[SquaresLeft]:
    """Squared errors on each fold of the search, of the physics that did not see it and of the ensembles. That of an
    ensemble is the share of the error which it leaves in the search, times the error of this physics; both errors are
    of the same physics unless terms may hold the error."""
    shares = [nested_shares(problem, candidates, number) for number in range(len(ENSEMBLES))]
    for d, ((a, b), out) in enumerate(zip(problem.folds, loaded.left_out.parts, strict=True)):
        rows = fold_samples(problem, a, b)[1]
        part = out.series.take(rows)
        left = _physics_squares(part)
        base = float(np.sum(part.error_v**2))
        left |= {name: base * float(share[d]) for name, share in zip(ENSEMBLES, shares, strict=True)}
        yield left


def _drive_squares(
    loaded: Loaded, problem: Problem, candidates: Sequence[Candidate]
) -> Iterator[SquaresLeft]:
    """Squared errors on each whole left-out drive, if the folds are parts of drives."""
    for out, span in zip(loaded.left_out.drives, problem.spans, strict=False):
        rows = slice(1, len(out.series))
        part = out.series.take(rows)
        left = _physics_squares(part)
        for number, name in enumerate(ENSEMBLES):
            given = _left_out_correction_v(problem, candidates, number, out, span)
            left[name] = float(np.sum((part.error_v - given[rows]) ** 2))
        yield left


def _left_out_correction_v(
    problem: Problem, candidates: Sequence[Candidate], ensemble: int, out: HeldOutDrive, span: Span
) -> Array:
    """Correction in free run of a left-out drive, (n,) V, by the model that the other drives choose and are fitted
    with; zero if they cannot choose one.

    ensemble : number of the ensemble in ENSEMBLES.  span : rows of the left-out drive in the problem.
    """
    apart = np.array([not span[0] <= a < span[1] for a, _ in problem.folds])
    pick = picked(problem, candidates, ensemble, apart)
    if pick is None:
        return np.zeros(len(out.series))
    chosen = pick.candidate
    model = chosen.ensembles[ensemble]
    if model.fade is not None:
        model = replace(model, fade=replace(model.fade, amplitude=pick.amplitude))
    for fitted, series, _ in fold_models(problem, chosen, model, (out,), (span,)):
        return fitted.free_run(series).error_v
    return np.zeros(len(out.series))


def _physics_squares(part: ErrorSeries) -> SquaresLeft:
    """Squared errors of all physics models on a piece."""
    return {name: float(np.sum(part.left_by(name) ** 2)) for name in PHYSICS_NAMES}
