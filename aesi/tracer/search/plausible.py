"""Which of several hypotheses is believed: that which says most of unseen data, and among those that say as much the
one with the largest marginal likelihood, each of its names paid for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.tracer.likelihood.fit import FittedHypothesis

ALIKE_NATS = 3.0
"""Hypotheses within this of each other say as much of unseen data: odds of twenty, a convention. With half and twice as
much (`docs/hooks/constant.py aesi.tracer.search.plausible:ALIKE_NATS=6 bench blind --set seed=13`) the cases 0, 5, 8,
10, 15, 17 and 19, three of them with an effect, get the same answers."""


def plausibility(fit: FittedHypothesis, competing: int) -> float:
    """Log marginal likelihood less the logarithm of how many effects might have been named, for each name: nats.

    competing : effects that could be named.
    """
    return fit.score.evidence - len(fit.hypothesis) * float(np.log(competing))


def most_plausible(fits: Sequence[FittedHypothesis], competing: int) -> FittedHypothesis | None:
    """Of those that say as much as the best one of unseen data, which do not tell them apart, the one with the largest
    plausibility: that with fewer names, and with fewer and more usual values. None of none."""
    if not fits:
        return None
    most = max(fit.score.total for fit in fits)
    alike = [fit for fit in fits if fit.score.total > most - ALIKE_NATS]
    return max(alike, key=lambda fit: plausibility(fit, competing))
