"""Hypotheses fitted with the whole model, or read from the archive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aesi.numerics.typing import Array
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.free_parameter import FreeParameter, coordinates_of, values_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis, HypothesisFitter
from aesi.tracer.likelihood.growth import Explanation
from aesi.tracer.likelihood.model_error import PRIORS, Size, SizePrior
from aesi.tracer.search.archive import Archive, fit_name

FIT_ROUNDS = 8
"""Most evaluations of the sensitivities in a fit; it ends sooner where a step gains nothing. Measured on a blind case
(asymmetric kinetics, seed 12): after three steps a parameter was on its bound, after six at its true value."""
MOVED_SDS = 1.0
"""Distance of a parameter from its declared value, in spreads, beyond which it counts as moved. Growth to first order
may then be far off, and effects are grown about the declared value as well. Measured on a blind case (leakage and a
contact, seed 0): growth of the contact gained 1 nat, its fit 52."""


def base_of(problem: InverseProblem, blocks: Blocks, archive: Archive) -> FittedHypothesis | None:
    """The hypothesis without effects; None where it cannot be simulated."""
    return fitted_hypothesis(problem, blocks, (), None, archive)


def fitted_hypothesis(
    problem: InverseProblem,
    blocks: Blocks,
    hypothesis: Sequence[str],
    near: Explanation | None,
    archive: Archive,
) -> FittedHypothesis | None:
    """A hypothesis fitted with the whole model, or read from the archive where it was fitted before; None where the
    model fails.

    near : a similar hypothesis, whose values and size of the model error the fit starts from; None starts from the
    middle of every prior.
    """
    name = fit_name(problem, "fit", hypothesis)
    if name in archive.fits:
        return replace(archive.fits[name], simulations=0)
    fitter = HypothesisFitter(problem, blocks, hypothesis)
    x = archive.get(name, len(fitter.free))
    if x is None:
        prior = PRIORS[problem.trust]
        if near is None:
            x = _from_the_middle(fitter, prior)
        else:
            x = _from_near(fitter, near, prior.nearest(near.score.size))
        archive.put(name, x)
    found = fitter.finished(x)
    if found is not None:
        archive.fits[name] = found
    return found


def refitted_off_bounds(
    problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis, archive: Archive
) -> FittedHypothesis:
    """The fit, or a better one that starts away from the bounds on which it ended: two parameters of an effect can hold
    each other on their bounds."""
    fitter = HypothesisFitter(problem, blocks, fit.hypothesis)
    name = fit_name(problem, "fit from within", fit.hypothesis)
    x = archive.get(name, len(fitter.free))
    if x is None:
        x0 = [f.start if f.on_bound(float(v)) else v for f, v in zip(fit.free, fit.point.x, strict=True)]
        x = fitter.descend(np.array(x0), PRIORS[problem.trust].nearest(fit.score.size), FIT_ROUNDS)
        archive.put(name, x)
    found = fitter.finished(x)
    if found is None or found.score.total < fit.score.total:
        return fit
    # All later questions are put to this one.
    archive.fits[fit_name(problem, "fit", fit.hypothesis)] = found
    return found


def _from_the_middle(fitter: HypothesisFitter, prior: SizePrior) -> Array:
    """Coordinates after a descent from the middle of every prior at the median size of the model error. A second
    descent, with a larger `fast_v`, follows where so much error is left within seconds that the file's errors would
    have to exceed their bounds. A lag of 2 s in a Panasonic's drive ended at 0.5 s with 3 mV and at 2.1 s with the
    24 mV that were left."""
    x = fitter.descend(np.zeros(len(fitter.free)), prior.nearest(prior.median), FIT_ROUNDS)
    there = fitter.finished(x) if prior.fast is not None else None
    if there is None or there.score.size.fast_v <= prior.median.fast_v:
        return x
    return fitter.descend(x, prior.median._replace(fast_v=there.score.size.fast_v), FIT_ROUNDS)


def _from_near(fitter: HypothesisFitter, near: Explanation, size: Size) -> Array:
    """Coordinates after a descent from a similar hypothesis.

    It starts from the values there with their change to first order, and with the sensitivities there. It starts
    without that change, or from the middle of the own parameters' priors, where that is closer to the data: at the knee
    of a discharge a change to first order may be off by volts, from which no descent returns.
    """
    moved = coordinates_of(fitter.free, near.values_by_key)
    before = {f.key: f.value(float(x)) for f, x in zip(near.free, near.point.x, strict=True)}
    unmoved = coordinates_of(fitter.free, {**near.values_by_key, **before})
    middle = np.where([f.own for f in fitter.free], 0.0, unmoved)
    x = fitter.closest((moved, unmoved, middle), size)
    return fitter.descend(x, size, FIT_ROUNDS, _slopes_v(near, fitter.free) if x is moved else None)


def values_without(
    problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis, fold: Sequence[int]
) -> dict[str, dict[str, float]]:
    """owner -> name -> value of a hypothesis fitted to the data without the blocks of `fold`: with the whole model, by
    steps from the fit to all data, with updates of the sensitivities that it had there."""
    fitter = HypothesisFitter(problem, blocks, fit.hypothesis)
    x = fitter.descend(fit.point.x, fit.score.size, 0, fit.point.jacobian_v, fold)
    return values_of(fit.free, x, fit.hypothesis)


def _slopes_v(near: Explanation, free: Sequence[FreeParameter]) -> Array | None:
    """(n, k) V, sensitivities of these parameters at another hypothesis; None where it lacks one of them."""
    place = {one: j for j, one in enumerate(near.free)}
    if not all(one in place for one in free):
        return None
    return near.point.jacobian_v[:, [place[one] for one in free]]


def linearised_as_declared(
    problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis
) -> FittedHypothesis | None:
    """The hypothesis linearised at the declared values of its own parameters, to grow effects from: a fit without the
    right effect moves own parameters to make up for it. Initial states and effects keep their fitted values. None where
    no parameter moved by more than `MOVED_SDS`, or where it cannot be simulated there."""
    own = np.array([f.own and f.record is None for f in fit.free])
    if not np.any(own & (np.abs(fit.point.x) > MOVED_SDS)):
        return None
    there = HypothesisFitter(problem, blocks, fit.hypothesis).finished(np.where(own, 0.0, fit.point.x))
    return None if there is None else replace(there, as_declared=True)
