"""Hypotheses fitted with the whole model, or as the archive has them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.free_parameter import coordinates_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis, HypothesisFitter
from aesi.tracer.likelihood.model_error import PRIORS
from aesi.tracer.search.archive import Archive, fit_name

BASE_STEPS = 8
REFIT_STEPS = 3
ALIKE_NATS = 3.0
"""Hypotheses within this of each other say as much."""


def base_of(problem: InverseProblem, blocks: Blocks, archive: Archive) -> FittedHypothesis | None:
    """The hypothesis without effects; None where it cannot be simulated."""
    return fitted_hypothesis(problem, blocks, (), None, PRIORS[problem.trust].median_v, BASE_STEPS, archive)


def fitted_hypothesis(
    problem: InverseProblem,
    blocks: Blocks,
    hypothesis: Sequence[str],
    placed: dict[tuple[str, str], float] | None,
    delta_v: float,
    steps: int,
    archive: Archive,
) -> FittedHypothesis | None:
    """A hypothesis fitted with the whole model, from `placed` values or the middle of every prior; as the archive
    has it where it was fitted before.  None where the model fails."""
    fitter = HypothesisFitter(problem, blocks, hypothesis)
    name = fit_name(problem, "fit", hypothesis)
    x = archive.get(name, len(fitter.free))
    if x is None:
        x0 = np.zeros(len(fitter.free)) if placed is None else coordinates_of(fitter.free, placed)
        x = fitter.descend(x0, PRIORS[problem.trust].nearest(delta_v), steps)
        archive.put(name, x)
    return fitter.finished(x)
