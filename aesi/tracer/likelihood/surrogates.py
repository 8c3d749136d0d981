"""The gain that an effect needs to be admitted: more than the best of all effects gains by chance.

Surrogates are data drawn from a hypothesis, with its model error and noise, so that it lacks nothing on them. The
largest gain of any effect on each draw is the gain of the best effect by chance. A quantile of it over many draws is
the threshold of an admission test, for which only the family-wise error rate has to be chosen. Gains are to first
order, with the sensitivities of the effects where they were fitted to the data.
White, Econometrica 68 (2000) 1097, for the largest of many as the statistic.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from aesi.numerics.typing import Array
from aesi.tracer.case.blocks import Blocks, Windows
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.gaussian import PARTITIONS_OF_CONDITIONS
from aesi.tracer.likelihood.growth import Parent
from aesi.tracer.likelihood.model_error import whitened

DRAWS = 400
"""Number of surrogates: the 99 % quantile is then known to a tenth of its value."""
FAMILY_WISE = 0.01
"""Family-wise error rate: the probability that any effect is admitted at a step where nothing is missing. Also the
share of cells with a declared parameter that is called wrong, where the parameters scatter by their spreads."""


def admission_nats(parent: Parent, slopes_v: Mapping[str, Array]) -> float:
    """The gain on unseen data that an effect has to reach to be admitted, nats.

    slopes_v : id of an effect -> (n, k) V, sensitivities of its parameters; the gain is 0 where there is no effect.
    """
    if not slopes_v:
        return 0.0
    gains = largest_gains(parent, slopes_v, DRAWS, np.random.default_rng(0))
    return max(float(np.quantile(gains, 1.0 - FAMILY_WISE)), 0.0)


def largest_gains(
    parent: Parent, slopes_v: Mapping[str, Array], draws: int, rng: np.random.Generator
) -> Array:
    """(draws,) nats, the largest gain over the effects, at least one, on each surrogate."""
    problem, blocks, size = parent.problem, parent.blocks, parent.fit.score.size
    white = _whitened_surrogates(problem, blocks.windows, draws, rng)
    known = parent.whitened_columns(size)[0]
    added = whitened(problem, blocks, np.column_stack(list(slopes_v.values())), size)[0]
    sums = _Sums.over_blocks(blocks, np.column_stack([known, added]), white)
    ends = known.shape[1] + np.cumsum([0, *(slopes.shape[1] for slopes in slopes_v.values())])
    return _gains_by_effect(blocks, sums, known.shape[1], list(pairwise(ends.tolist()))).max(axis=0)


def _whitened_surrogates(
    problem: InverseProblem, windows: Windows | None, draws: int, rng: np.random.Generator
) -> Array:
    """(n, draws) of model error and noise, whitened: standard normal numbers. Under a coarsened likelihood the rows of
    one independent sample share one draw; the part within seconds has a draw in each row, minus the mean of its
    window."""
    if not problem.coarse:
        return rng.normal(size=(len(problem.time_s), draws))
    sample = np.floor(np.cumsum(problem.independent) - problem.independent).astype(int)
    root = np.sqrt(problem.independent)[:, None]
    lasting = root * rng.normal(size=(sample[-1] + 1, draws))[sample]
    if windows is None:
        return lasting
    fast = rng.normal(size=lasting.shape) / root
    return np.asarray(lasting + root * (fast - windows.means(fast)))


@dataclass(frozen=True, eq=False)
class _Sums:
    """Sums over the rows of each block, or over those that are not left out; whitened.

    gram : (b, m, m) of the sensitivities.  moment : (b, m, s) of these and each of s surrogates.
    """

    gram: Array
    moment: Array

    @classmethod
    def over_blocks(cls, blocks: Blocks, sensitivities: Array, white: Array) -> _Sums:
        """sensitivities : (n, m), white : (n, s)."""
        rows = [sensitivities[block].T for block in blocks.rows]
        gram = np.stack([one @ one.T for one in rows])
        moment = np.stack([one @ white[block] for one, block in zip(rows, blocks.rows, strict=True)])
        return cls(gram, moment)

    def without(self, folds: Sequence[Sequence[int]]) -> _Sums:
        """The sums over all blocks but those of each fold, and over all blocks last."""
        kept = np.ones((len(folds) + 1, len(self.gram)))
        for row, fold in zip(kept, folds, strict=False):
            row[list(fold)] = 0.0
        return _Sums(np.tensordot(kept, self.gram, axes=1), np.tensordot(kept, self.moment, axes=1))


def _gains_by_effect(blocks: Blocks, sums: _Sums, known: int, effects: Sequence[tuple[int, int]]) -> Array:
    """(e, s) gain on unseen data, nats, of each of e effects over none, on each of s surrogates, with blocks and
    conditions weighted as in `gaussian.ScoreAtSize`.

    sums : with the sensitivities of the `known` parameters first.  effects : first column of each and the one after its
    last.
    """
    out = np.zeros((len(effects), sums.moment.shape[-1]))
    conditions = [name for name in PARTITIONS_OF_CONDITIONS if name in blocks.folds]
    shares = {"block": 0.5} | {name: 0.5 / len(conditions) for name in conditions}
    for name, share in shares.items():
        kept = sums.without(blocks.folds[name])
        # The effects' sums given the known parameters: Schur complement of these, by their Cholesky factor.
        root = np.linalg.cholesky(kept.gram[:, :known, :known] + np.eye(known))
        half_gram = np.linalg.solve(root, kept.gram[:, :known, known:])
        half_moment = np.linalg.solve(root, kept.moment[:, :known])
        transposed = np.swapaxes(half_gram, -1, -2)
        gram = kept.gram[:, known:, known:] - transposed @ half_gram
        moment = kept.moment[:, known:] - transposed @ half_moment
        for k, (first, end) in enumerate(effects):
            own = slice(first - known, end - known)
            evidence = _log_evidence_gain(gram[:, own, own], moment[:, own])
            # Each fold: evidence of all blocks minus that of the blocks without the fold, eq. (2) of gaussian.py.
            out[k] += share * (len(evidence) - 1) * evidence[-1] - share * evidence[:-1].sum(axis=0)
    return out


def _log_evidence_gain(gram: Array, moment: Array) -> Array:
    """(f, s) gain in log evidence, nats, (b'A^-1 b - log|A|) / 2 with A = 1 + gram (f, k, k) and b the columns of
    moment (f, k, s)."""
    root = np.linalg.cholesky(gram + np.eye(gram.shape[-1]))
    half = np.linalg.solve(root, moment)
    log_det = np.log(np.diagonal(root, axis1=-2, axis2=-1)).sum(axis=-1)
    return np.asarray(0.5 * (half**2).sum(axis=-2) - log_det[:, None])
