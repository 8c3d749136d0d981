"""The validation figure that stands beside the test figure: from drives that chose nothing.

    figure = 1 - median_d S_d / E_d                                                                       (1)

S_d is what a model leaves of the squared error E_d of the declared physics on a left-out piece d, with physics, search
and fit repeated without it. Pieces are drives, and where the search leaves out parts of drives these too: a part lies
closer to the rest of its drive than a test drive does, and a whole one further from the others than a test drive does
that has one on either side. A median, since the ratio of sums is that of the one piece on which the physics errs most,
or which physics that has not seen it runs into volts.

Over the ten development splits of the NMC drive in `aesi bench splits` (16 candidates) the figure of AESI I is off by
2.8 points in the median and 49 at worst; by sums over the parts alone it was off by 6.5 and 75. With a share that grows
with the distance from the nearest fitted charge, which the test's rows would set, it was off by 16 or more: that shares
grow so fast between parts and drives is not borne out further away.
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
"""Model -> sum of squares, V**2, that it leaves on a left-out piece."""


def validation_mser(loaded: Loaded, problem: Problem, candidates: Sequence[Candidate]) -> dict[str, float]:
    """Model -> reduction of the squared error against the declared physics, per cent, on a typical left-out piece.

    Physics is refitted without each piece, and the ensembles are chosen without it (`picked`).
    Empty where the search left out other pieces than drives or their parts.
    """
    if len(problem.folds) < 2 or not problem.folds_are_drives:
        return {}
    pieces = [*_parts(loaded, problem, candidates), *_drives(loaded, problem, candidates)]
    return {
        name: 100.0 * (1.0 - float(np.median([left[name] / left[DECLARED] for left in pieces])))
        for name in pieces[0]
    }


def _parts(loaded: Loaded, problem: Problem, candidates: Sequence[Candidate]) -> Iterator[SquaresLeft]:
    """Squares left on the folds of the search. What the ensembles leave of the error of physics that saw a fold
    stands for what they leave of the error of physics that did not."""
    shares = [nested_shares(problem, candidates, number) for number in range(len(ENSEMBLES))]
    for d, ((a, b), out) in enumerate(zip(problem.folds, loaded.left_out.parts, strict=True)):
        rows = fold_samples(problem, a, b)[1]
        part = out.series.take(rows)
        left = _by_physics(part)
        base = float(np.sum(part.error_v**2))
        left |= {name: base * float(share[d]) for name, share in zip(ENSEMBLES, shares, strict=True)}
        yield left


def _drives(loaded: Loaded, problem: Problem, candidates: Sequence[Candidate]) -> Iterator[SquaresLeft]:
    """Whole drives, where folds are parts of them."""
    for out, span in zip(loaded.left_out.drives, problem.spans, strict=False):
        rows = slice(1, len(out.series))
        part = out.series.take(rows)
        left = _by_physics(part)
        for number, name in enumerate(ENSEMBLES):
            given = _without(problem, candidates, number, out, span)
            left[name] = float(np.sum((part.error_v - given[rows]) ** 2))
        yield left


def _without(
    problem: Problem, candidates: Sequence[Candidate], ensemble: int, out: HeldOutDrive, span: Span
) -> Array:
    """(n,) V in free run by the model that the other drives choose, fitted to them; zero where they cannot choose
    one."""
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


def _by_physics(part: ErrorSeries) -> SquaresLeft:
    return {name: float(np.sum(part.left_by(name) ** 2)) for name in PHYSICS_NAMES}
