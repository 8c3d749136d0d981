"""One cause in place of several declared parameters that came out wrong together.

A particle radius that is off looks like a diffusivity off by 1/f^2 and a rate constant off by 1/f: declared parameters
have tolerances, so that the search finds the two before the one. What says as much with fewer numbers is the better
name; what it stands for is told as its look-alikes.
"""

from __future__ import annotations

from dataclasses import replace

from aesi.physics.effect import Effect
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.fitted import fitted_hypothesis
from aesi.tracer.search.path import Path, Step
from aesi.tracer.search.plausible import most_plausible


def in_one(path: Path, archive: Archive) -> tuple[Path, tuple[str, ...]]:
    """The path with one effect in the place of all of its effects, and the group of look-alikes that it heads.

    The path as it was, and no group, where it does not name several declared parameters, or no single cause says as
    much as they do.
    """
    chosen = path.chosen
    effects = path.problem.effects
    if len(chosen.hypothesis) < 2 or not all(_tolerated(effects[name]) for name in chosen.hypothesis):
        return path, ()
    causes = [e.id for e in effects.values() if e.kind == "parameter" and not _tolerated(e)]
    fits = [fitted_hypothesis(path.problem, path.blocks, (cause,), path.base, archive) for cause in causes]
    inside = [fit for fit in fits if fit is not None and not fit.at_bounds]
    best = most_plausible([chosen, *inside], len(path.problem.competing()))
    if best is None or best is chosen:
        return path, ()
    step = Step((path.base,), (), (best,), best)
    group = (*best.hypothesis, *chosen.hypothesis)
    return replace(path, steps=(*path.steps, step), chosen=best), group


def _tolerated(effect: Effect) -> bool:
    """Whether cell files declare what the effect moves, with a tolerance."""
    return any(p.spread is not None for p in effect.parameters.values())
