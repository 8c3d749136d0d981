"""Declared parameters that the data put beyond what cell files are off by, named as effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.fitted import fitted_hypothesis
from aesi.tracer.search.path import Path, Step
from aesi.tracer.search.plausible import ALIKE_NATS

NINETY = 1.645
"""Standard deviations either side of a 90 % interval."""
WRONG_SDS = 2.0
"""Of its spread: a declared parameter that the data put further off, with 95 % probability, is wrong and is named. A
convention: of values that scatter as the spread says, one in twenty lies further off."""


def with_wrong_parameters(path: Path, most: int, archive: Archive) -> Path:
    """The path with those declared parameters as effects that the data put beyond what cell files are off by.

    One at a time, that which says most: another one may only have made up for it. `most` names in all.
    """
    chosen = path.chosen
    while len(chosen.hypothesis) < most and (beyond := beyond_spread(path.problem, chosen)):
        fits = [
            fitted_hypothesis(path.problem, path.blocks, (*chosen.hypothesis, owner), chosen, archive)
            for owner in beyond
        ]
        said = chosen.score.total - ALIKE_NATS
        better = [f for f in fits if f is not None and f.score.total > said and not f.at_bounds]
        if not better:
            break
        chosen = max(better, key=lambda f: f.score.total)
    if chosen is path.chosen:
        return path
    step = Step((path.chosen,), (), (chosen,), chosen)
    return replace(path, steps=(*path.steps, step), chosen=chosen)


def beyond_spread(problem: InverseProblem, fit: FittedHypothesis) -> list[str]:
    """Ids of the effects whose own parameters are off by more than files are, with 95 % probability."""
    sds = np.sqrt(np.diagonal(fit.score.covariance))
    owners = [
        f.owner
        for f, x, sd in zip(fit.free, fit.point.x, sds, strict=True)
        if f.own and f.owner in problem.effects and problem.effects[f.owner].refines is None
        if abs(float(x)) - NINETY * float(sd) > WRONG_SDS
    ]
    return list(dict.fromkeys(owners))
