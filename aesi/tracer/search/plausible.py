"""Which of several hypotheses is believed.

The one that says most of unseen data. Among those that say as much, the one with the largest marginal likelihood, less
a price for each effect that it names.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.growth import Explanation

ALIKE_NATS = 3.0
"""Hypotheses within this of each other say as much of unseen data: odds of twenty, a convention. With half and twice as
much (`docs/hooks/constant.py aesi.tracer.search.plausible:ALIKE_NATS=6 bench blind --set seed=13`) the cases 0, 5, 8,
10, 15, 17 and 19, three of them with an effect, get the same answers."""

ALIKE_SDS = 1.64
"""Standard deviations of the paired differences between blocks by which one has to lag to be told apart: 95 % of a
normal distribution, to one side."""


def lag(better: Explanation, other: Explanation) -> tuple[float, float]:
    """Nats by which `other` says less of unseen data, and the standard deviation of that over blocks."""
    difference = better.score.log_density["block"] - other.score.log_density["block"]
    deviation = float(np.std(difference, ddof=1) * np.sqrt(len(difference))) if len(difference) > 1 else 0.0
    return better.score.total - other.score.total, deviation


def sds_behind(nats: float, deviation: float, least_nats: float = ALIKE_NATS) -> float:
    """Standard deviations by which a hypothesis lags, of a `lag`.  least_nats : the least that one counts."""
    return nats / max(deviation, least_nats)


def alike(better: Explanation, other: Explanation, sds: float = ALIKE_SDS, nats: float = ALIKE_NATS) -> bool:
    """Whether the data do not tell the second hypothesis from the first."""
    behind, deviation = lag(better, other)
    return behind < max(nats, sds * deviation)


def plausibility(fit: FittedHypothesis, competing: int) -> float:
    """Log marginal likelihood less the logarithm of how many effects might have been named, for each name: nats.

    competing : effects that could be named.
    """
    return fit.score.evidence - len(fit.hypothesis) * float(np.log(competing))


def most_plausible(fits: Sequence[FittedHypothesis], competing: int) -> FittedHypothesis | None:
    """The most plausible of those that unseen data do not tell from the best one; None where there are no fits.

    Plausibility prefers fewer names, and fewer and more usual values.
    """
    if not fits:
        return None
    most = max(fit.score.total for fit in fits)
    alike = [fit for fit in fits if fit.score.total > most - ALIKE_NATS]
    return max(alike, key=lambda fit: plausibility(fit, competing))
