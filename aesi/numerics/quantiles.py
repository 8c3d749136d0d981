"""Empirical quantiles with the finite-sample correction of conformal prediction."""

from __future__ import annotations

import numpy as np

from aesi.errors import FitError
from aesi.numerics.typing import Array


def conformal_quantile(scores: Array, alpha: float) -> float:
    """The ceil((n + 1)(1 - alpha))-th smallest score: one more exchangeable score is below with >= 1 - alpha.

    scores : (n,), finite.  Raises FitError where n is too small for that rank to exist (n < 1/alpha - 1).
    Vovk, Gammerman & Shafer, Algorithmic Learning in a Random World (2005), ch. 2.
    """
    n = scores.size
    rank = int(np.ceil((n + 1) * (1 - alpha) - 1e-9))  # round-off must not ask for one rank too many
    if rank > n:
        raise FitError(
            f"{n} scores cannot support a miss rate of {alpha:g}: at least {int(np.ceil(1 / alpha)) - 1} "
            "are needed; give more calibration data or a larger alpha."
        )
    return float(np.partition(scores, rank - 1)[rank - 1])


def grouped_conformal_quantile(groups: list[Array], alpha: float) -> float:
    """The 1 - alpha quantile of scores that come in groups: a random score of one more group, exchangeable
    with these, is below it with at least 1 - alpha, whatever the dependence inside a group.

        smallest q with   sum_g share_g(scores <= q) / (G + 1) >= 1 - alpha

    Every group has one vote of G + 1; the unseen one counts as infinite. groups : (n_g,) finite each; empty
    ones are left out. Raises FitError for fewer than 1/alpha - 1 groups.
    Dunn, Wasserman & Ramdas, J. Am. Stat. Assoc. 118 (2023) 2491; Lee, Barber & Willett, arXiv:2306.06342.
    """
    groups = [g for g in groups if g.size]
    needed = int(np.ceil(1 / alpha - 1e-9)) - 1
    if len(groups) < needed:
        raise FitError(
            f"{len(groups)} blocks cannot support a miss rate of {alpha:g}: at least {needed} are needed; "
            "give longer records, shorter blocks, or a larger alpha."
        )
    scores = np.concatenate(groups)
    votes = np.concatenate([np.full(g.size, 1 / (g.size * (len(groups) + 1))) for g in groups])
    order = np.argsort(scores)
    reached = int(np.searchsorted(np.cumsum(votes[order]), 1 - alpha - 1e-12))
    return float(scores[order[min(reached, scores.size - 1)]])
