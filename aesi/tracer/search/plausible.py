"""Which of several hypotheses is believed.

The one with the highest score on unseen data. Among those within `ALIKE_NATS` of it, the one with the largest marginal
likelihood, minus a penalty for each effect that it names.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.growth import Explanation

ALIKE_NATS = 3.0
"""Difference of scores on unseen data below which hypotheses count as alike: odds of twenty, a convention. With half
and twice as much (`docs/hooks/constant.py aesi.tracer.search.plausible:ALIKE_NATS=6 bench blind --set seed=13`) the
cases 0, 5, 8, 10, 15, 17 and 19, three of them with an effect, get the same answers."""

ALIKE_SDS = 1.64
"""A hypothesis is told apart from a better one where its lag exceeds this many standard deviations of the paired
differences between blocks: one-sided 95 % of a normal distribution."""


def score_lag(better: Explanation, other: Explanation) -> tuple[float, float]:
    """(difference of the scores on unseen data `better` - `other`, standard deviation of the sum of the differences on
    all left-out blocks, if blocks are independent), nats."""
    difference = better.score.log_density["block"] - other.score.log_density["block"]
    deviation = float(np.std(difference, ddof=1) * np.sqrt(len(difference))) if len(difference) > 1 else 0.0
    return better.score.total - other.score.total, deviation


def sds_behind(nats: float, deviation: float, least_nats: float = ALIKE_NATS) -> float:
    """A `score_lag` in standard deviations.  least_nats : smallest standard deviation that is used."""
    return nats / max(deviation, least_nats)


def alike(better: Explanation, other: Explanation, sds: float = ALIKE_SDS, nats: float = ALIKE_NATS) -> bool:
    """True where the data do not tell the second hypothesis from the first: it is behind by less than `nats`, or by
    less than `sds` standard deviations of the difference."""
    behind, deviation = score_lag(better, other)
    return behind < max(nats, sds * deviation)


def plausibility(fit: FittedHypothesis, competing: int) -> float:
    """Log marginal likelihood minus log(competing) for each named effect, nats: the log posterior probability of the
    hypothesis, up to a constant, if any effect is as likely as any other.

    competing : number of effects that could be named, 0 where there is none.
    """
    penalty = float(np.log(competing)) if fit.hypothesis else 0.0
    return fit.score.evidence - len(fit.hypothesis) * penalty


def most_plausible(fits: Sequence[FittedHypothesis], competing: int) -> FittedHypothesis | None:
    """The most plausible of the fits whose score is within `ALIKE_NATS` of the best one; None where there are no fits.

    Plausibility prefers fewer effects, fewer parameters, and values nearer to the centres of their priors.
    """
    if not fits:
        return None
    highest = max(fit.score.total for fit in fits)
    near_best = [fit for fit in fits if fit.score.total > highest - ALIKE_NATS]
    return max(near_best, key=lambda fit: plausibility(fit, competing))
