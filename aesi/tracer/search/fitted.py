"""Hypotheses fitted with the whole model, or as the archive has them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.free_parameter import STATE_OF_CHARGE, coordinates_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis, HypothesisFitter
from aesi.tracer.likelihood.model_error import PRIORS
from aesi.tracer.search.archive import Archive, fit_name

FIT_STEPS = 8
"""At most; a fit that gains nothing more ends before. Measured on a blind case (asymmetric kinetics, seed 12): after
three steps a parameter was on its bound, after six it was where the truth is."""
MOVED_SDS = 1.0
"""Of its spread: what is to first order about a declared parameter that moved further may be far off where it is not.
Measured on a blind case (leakage and a contact, seed 0): growth of the contact said 1 nat more, its fit 52."""


def base_of(problem: InverseProblem, blocks: Blocks, archive: Archive) -> FittedHypothesis | None:
    """The hypothesis without effects; None where it cannot be simulated."""
    return fitted_hypothesis(problem, blocks, (), None, PRIORS[problem.trust].median_v, archive)


def fitted_hypothesis(
    problem: InverseProblem,
    blocks: Blocks,
    hypothesis: Sequence[str],
    placed: dict[tuple[str, str], float] | None,
    delta_v: float,
    archive: Archive,
) -> FittedHypothesis | None:
    """A hypothesis fitted with the whole model, from `placed` values or the middle of every prior; as the archive
    has it where it was fitted before.  None where the model fails."""
    fitter = HypothesisFitter(problem, blocks, hypothesis)
    name = fit_name(problem, "fit", hypothesis)
    x = archive.get(name, len(fitter.free))
    if x is None:
        x0 = np.zeros(len(fitter.free)) if placed is None else coordinates_of(fitter.free, placed)
        x = fitter.descend(x0, PRIORS[problem.trust].nearest(delta_v), FIT_STEPS)
        archive.put(name, x)
    return fitter.finished(x)


def as_declared(problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis) -> FittedHypothesis | None:
    """The same hypothesis about the declared values of its own parameters, as a place to grow from: one that lacks an
    effect moves them to make up for it. None where none of them moved far, or where it cannot be simulated there."""
    own = np.array([f.own and f.owner != STATE_OF_CHARGE for f in fit.free])
    if not np.any(own & (np.abs(fit.point.x) > MOVED_SDS)):
        return None
    there = HypothesisFitter(problem, blocks, fit.hypothesis).finished(np.where(own, 0.0, fit.point.x))
    return None if there is None else replace(there, as_declared=True)
