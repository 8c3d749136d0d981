"""Models for free-run residuals: each is fitted to all training rows except one long piece, and judged on that piece.

The search may judge candidates on shorter pieces (`Options.fold`); the drift of a free run shows only over a long one.

Like the final model, they learn the error of physics that was fitted to all training drives. They are judged on the
piece with physics that was fitted without it. If they learnt the error of that physics, as in the search, their errors
would be smaller than on test drives: over the development splits in `aesi bench splits` the bands of AESI I then
covered 87 % of the NMC drive and 51 % of the LG M50T's, instead of 90 and 66 %, at Winkler scores of 51.1 and 40.8
instead of 50.8 and 29.0 mV.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.blocks import Span, leave_out_weights, pieces
from aesi.numerics.typing import Array, IntArray
from aesi.numerics.weighted_grams import orthonormal, triangular_factors, weighted_grams
from aesi.records import ErrorSeries, HeldOutDrive
from aesi.sparse.fade import Fade
from aesi.sparse.leverage import Leverage
from aesi.sparse.model import SparseModel
from aesi.sparse.search.evaluate import Candidate, sparse_model
from aesi.sparse.search.problem import Problem
from aesi.sparse.stridge import STRidge
from aesi.sparse.trained_region import TrainedRegion

N_PIECES = 12
"""Pieces that a single training record is cut into: long enough for drift to show, and short enough that a fit without
one is nearly the fit to all. A convention: in `aesi bench bands --set layouts='["one"]' --set virtual=2` the bands of a
whole drive cover 86.2 % (6.3 % of standard error) at a score of 103.2 mV, with half of it 83.4 % at 105.4, with twice
85.6 % at 104.2."""


def fold_models(
    problem: Problem,
    candidate: Candidate,
    judged: SparseModel | None = None,
    left_out: Sequence[HeldOutDrive] = (),
    cut: Sequence[Span] | None = None,
) -> Iterator[tuple[SparseModel, ErrorSeries, slice]]:
    """For every piece of the training records: (a model fitted without it, its record, its samples).

    The model has the candidate's genome, or is the mean of models with its members' genomes. A piece is skipped where
    no term survives the fit without it.

    judged : AESI I (the default), or AESI II, whose terms alone are refitted then.
    left_out : for every piece, its record under physics that has not seen the piece either; by default the records as
    they are.
    cut : the pieces; by default the folds of the search where these are drives, else about `N_PIECES` of like length.
    """
    judged = judged or candidate.bagging
    active, members = _members(problem, candidate, judged)
    n = len(problem.target)
    drives = problem.folds_are_drives
    if cut is None:
        cut = problem.folds if drives else pieces(problem.spans, max(1, n // N_PIECES))
    for i, ((a, b), factor) in enumerate(zip(cut, _factors_without(problem, active, cut), strict=True)):
        coefficients = sum((member.coefficients(factor) for member in members), start=np.zeros(len(active)))
        if not coefficients.any():
            continue
        kept = np.flatnonzero(coefficients)
        seen = np.r_[0:a, b:n]
        model = replace(
            sparse_model(problem, active, coefficients, judged.memory, "left-out piece"),
            leverage=Leverage.of(factor[:, kept], candidate.ridge, problem.theta(active[kept])[:, seen]),
        )
        if judged.fade is not None:
            region = TrainedRegion.of(problem.inputs[seen], problem.soc[seen], problem.temperature_degc[seen])
            model = replace(model, fade=Fade(judged.fade.amplitude, region))
        record, rows = fold_samples(problem, a, b)
        yield model, left_out[i].series if drives and left_out else record, rows


def _factors_without(problem: Problem, active: IntArray, cut: Sequence[Span]) -> Array:
    """(pieces, m + 1, m + 1) triangular factors of the active terms (m,) and the target, each without one piece."""
    n = len(problem.target)
    augmented = np.empty((n, len(active) + 1), order="F")
    augmented[:, :-1] = problem.theta(active).T
    augmented[:, -1] = problem.target
    augmented *= np.sqrt(problem.row_weights)[:, None]
    q_rows, r = orthonormal(augmented)
    return triangular_factors(weighted_grams(q_rows, leave_out_weights(cut, n)), r)


@dataclass(frozen=True, eq=False)
class _Member:
    """One model of a mean.  places : of its terms among all terms of the fits.  share : its weight in the mean."""

    solver: STRidge
    places: IntArray
    share: float

    def coefficients(self, factor: Array) -> Array:
        """(m,) of the problem that the factor (any, m + 1) poses, times its share."""
        m = factor.shape[1] - 1
        shared = np.zeros(m)
        shared[self.places] = self.share * self.solver.fit_factor(factor[:, np.append(self.places, m)])
        return shared


def _members(
    problem: Problem, candidate: Candidate, judged: SparseModel
) -> tuple[IntArray, tuple[_Member, ...]]:
    """(numbers of all terms in the fits of a fold, the members with their terms)."""
    candidates = candidate.members or (candidate,)
    stable = judged.name == candidate.stability.name
    terms = [_terms(problem, one, stable) for one in candidates]
    all_terms = np.unique(np.concatenate(terms))
    return all_terms, tuple(
        _Member(
            STRidge(one.genome.lambda1, one.genome.lambda2),
            np.searchsorted(all_terms, own_terms),
            1 / len(candidates),
        )
        for one, own_terms in zip(candidates, terms, strict=True)
    )


def _terms(problem: Problem, candidate: Candidate, stable: bool) -> IntArray:
    """Numbers of the terms of a candidate that enter its fits; stable : of AESI II."""
    active = np.flatnonzero(candidate.genome.active(problem.library))
    if not stable:
        return active
    kept = set(candidate.stability.library.terms)
    return np.array([j for j in active if problem.library.terms[j] in kept])


def with_leverage(model: SparseModel, problem: Problem, lambda1: float) -> SparseModel:
    """The model with the leverage of a fit of its terms to all training rows, which its fade then uses too."""
    number = {term: j for j, term in enumerate(problem.library.terms)}
    own_terms: IntArray = np.array([number[term] for term in model.library.terms])
    return replace(
        model, leverage=Leverage.of(problem.full_factor[:, own_terms], lambda1, problem.theta(own_terms))
    )


def fold_samples(problem: Problem, a: int, b: int) -> tuple[ErrorSeries, slice]:
    """The record that training rows a to b - 1 come from, and the samples they predict: row k, sample k + 1.  Raises
    IndexError for a row of no record."""
    for record, (first, last) in zip(problem.split.train, problem.spans, strict=True):
        if first <= a < last:
            return record, slice(a - first + 1, b - first + 1)
    raise IndexError(f"row {a} belongs to no training record")
