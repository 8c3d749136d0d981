"""What the best of all effects gains where nothing is missing: on surrogates of the model error and the noise.

A hypothesis is right on data that are drawn from it. The largest gain of any effect on many such draws is what chance
alone gives the best of so many; a quantile of it is an admission test whose family-wise error rate is the one number
that is chosen. Gains are to first order, with the slopes that the effects have where they were fitted to the data.
White, Econometrica 68 (2000) 1097, for the largest of many as the statistic.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from aesi.numerics.typing import Array
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.gaussian import PARTITIONS_OF_CONDITIONS
from aesi.tracer.likelihood.growth import Parent
from aesi.tracer.likelihood.model_error import whitened

DRAWS = 400
"""The 99 % quantile of so many is known to a tenth of its value."""
FAMILY_WISE = 0.01
"""Chance that any effect at all is admitted at a step where nothing is missing."""


def admission_nats(parent: Parent, slopes_v: Mapping[str, Array], seed: int = 0) -> float:
    """What an effect has to say of unseen data more than the hypothesis without it, nats.

    slopes_v : id of an effect -> (n, k) V, what its parameters do.
    """
    gains = largest_gains(parent, slopes_v, DRAWS, np.random.default_rng(seed))
    return max(float(np.quantile(gains, 1.0 - FAMILY_WISE)), 0.0)


def largest_gains(
    parent: Parent, slopes_v: Mapping[str, Array], draws: int, rng: np.random.Generator
) -> Array:
    """(draws,) nats, the largest gain over the effects on each surrogate."""
    problem, blocks, delta_v = parent.problem, parent.blocks, parent.fit.score.delta_v
    white = _drawn(problem, draws, rng)
    known = parent.white[delta_v][0]
    without = _said(blocks, known, white)
    best = np.full(draws, -np.inf)
    for slopes in slopes_v.values():
        added = whitened(problem, blocks, slopes, delta_v)[0]
        best = np.maximum(best, _said(blocks, np.column_stack([known, added]), white) - without)
    return best


def _drawn(problem: InverseProblem, draws: int, rng: np.random.Generator) -> Array:
    """(n, draws) of model error and noise, whitened: standard normal numbers. Under a coarsened likelihood the rows
    that make up one independent sample share its draw."""
    if not problem.coarse:
        return rng.normal(size=(len(problem.time_s), draws))
    sample = np.floor(np.cumsum(problem.independent) - problem.independent).astype(int)
    return np.sqrt(problem.independent)[:, None] * rng.normal(size=(sample[-1] + 1, draws))[sample]


def _said(blocks: Blocks, sensitivities: Array, white: Array) -> Array:
    """(s,) held-out log predictive density of each of s surrogates under a linear hypothesis, nats, up to a constant
    that all hypotheses share.

    sensitivities : (n, m), white : (n, s), both whitened.
    """
    rows = list(pairwise(blocks.starts))
    gram = np.stack([sensitivities[a:b].T @ sensitivities[a:b] for a, b in rows])
    moment = np.stack([sensitivities[a:b].T @ white[a:b] for a, b in rows])
    whole = _explained(gram.sum(axis=0), moment.sum(axis=0))

    def of(folds: Sequence[Sequence[int]]) -> Array:
        out = np.zeros(white.shape[1])
        for fold in folds:
            kept = np.setdiff1d(np.arange(len(rows)), fold)
            out += whole - _explained(gram[kept].sum(axis=0), moment[kept].sum(axis=0))
        return out

    conditions = [of(blocks.folds[name]) for name in PARTITIONS_OF_CONDITIONS if name in blocks.folds]
    return 0.5 * of(blocks.folds["block"]) + 0.5 * np.mean(conditions, axis=0)


def _explained(gram: Array, moment: Array) -> Array:
    """(s,) (b'A^-1 b - log|A|) / 2 with A = 1 + gram and b = moment, one column a surrogate."""
    root = np.linalg.cholesky(gram + np.eye(len(gram)))
    half = np.linalg.solve(root, moment)
    return 0.5 * np.sum(half**2, axis=0) - float(np.sum(np.log(np.diagonal(root))))
