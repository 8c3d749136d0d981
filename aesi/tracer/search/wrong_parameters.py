"""Declared parameters whose fitted values are further off than cell files usually are; they are named as effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.surrogates import FAMILY_WISE
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.forward import without_unneeded
from aesi.tracer.search.hypothesis_fits import fitted_hypothesis
from aesi.tracer.search.path import Path, Step
from aesi.tracer.search.plausible import ALIKE_NATS, most_plausible

NINETY_SDS = 1.645
"""Half width of a 90 % interval, in standard deviations."""


def with_wrong_parameters(path: Path, most: int, archive: Archive) -> Path:
    """The path, with further effects in its choice where declared parameters are further off than cell files are.

    No cell is so far off, so that an effect has to be named even if its gain is too small for admission: either the
    parameter itself as an effect, or another effect with which fewer parameters are off. The most plausible one is
    added, one at a time, up to `most` effects. Effects that are not needed beside them are dropped: a contact and a
    wrong electrolyte say no more than the electrolyte.
    """
    chosen, competing = path.chosen, len(path.problem.competing())
    while len(chosen.hypothesis) < most and (beyond := beyond_spread(path.problem, chosen)):
        fits = [
            fitted_hypothesis(path.problem, path.blocks, (*chosen.hypothesis, owner), chosen, archive)
            for owner in beyond
        ]
        fits += [
            one for one in _with_another(path, chosen) if len(beyond_spread(path.problem, one)) < len(beyond)
        ]
        least = chosen.score.total - ALIKE_NATS
        as_good = [f for f in fits if f is not None and f.score.total > least and not f.at_bounds]
        found = most_plausible(as_good, competing)
        if found is None:
            break
        chosen = found
    if chosen is path.chosen:
        return path
    chosen = without_unneeded(
        path.problem,
        path.blocks,
        chosen,
        path.admission_nats,
        archive,
        may_be=lambda fit: not beyond_spread(path.problem, fit),
    )
    step = Step((path.chosen,), (), (chosen,), chosen)
    return replace(path, steps=(*path.steps, step), chosen=chosen)


def _with_another(path: Path, chosen: FittedHypothesis) -> list[FittedHypothesis]:
    """The fits of the search that hold one effect more than the chosen hypothesis."""
    names = set(chosen.hypothesis)
    fits = [fit for step in path.steps for fit in step.fitted]
    return [fit for fit in fits if names < set(fit.hypothesis) and len(fit.hypothesis) == len(names) + 1]


def beyond_spread(problem: InverseProblem, fit: FittedHypothesis, sure_sds: float = NINETY_SDS) -> list[str]:
    """Ids of the effects whose own parameters are off by more than files are, with 95 % probability.

    sure_sds : standard deviations of the fit by which a value has to be beyond; 0 takes the fitted values themselves.
    """
    sds = np.sqrt(np.diagonal(fit.score.covariance))
    declared = [
        (f.owner, abs(float(x)) - sure_sds * float(sd))
        for f, x, sd in zip(fit.free, fit.point.x, sds, strict=True)
        if f.own and f.owner in problem.effects and problem.effects[f.owner].refines is None
    ]
    most = wrong_sds(len(declared))
    return list(dict.fromkeys(owner for owner, off in declared if off > most))


def wrong_sds(parameters: int) -> float:
    """Number of standard deviations that any of so many normal deviates exceeds with probability `FAMILY_WISE` (Sidak,
    J. Am. Stat. Assoc. 62 (1967) 626)."""
    each = 1.0 - (1.0 - FAMILY_WISE) ** (1.0 / max(parameters, 1))
    return -float(ndtri(0.5 * each))
