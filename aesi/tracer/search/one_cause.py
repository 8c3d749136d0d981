"""One cause in place of several declared parameters that came out wrong together.

A particle radius that is off by a factor f looks like a diffusivity off by 1/f^2 and a rate constant off by 1/f. Since
declared parameters have tolerances, the search finds these two before the radius. An effect that scores as well with
fewer parameters is the better name; the parameters that it replaces become its look-alikes.
"""

from __future__ import annotations

from dataclasses import replace

from aesi.tracer.search.archive import Archive
from aesi.tracer.search.hypothesis_fits import fitted_hypothesis
from aesi.tracer.search.path import Path, Step
from aesi.tracer.search.plausible import most_plausible


def with_one_effect(path: Path, archive: Archive) -> tuple[Path, tuple[str, ...]]:
    """(path with one effect in place of all of its effects, group of look-alikes that begins with it).

    The path as it was, with an empty group, where it does not name several declared parameters, or where no single
    effect scores as well.
    """
    chosen = path.chosen
    effects = path.problem.effects
    if len(chosen.hypothesis) < 2 or not all(effects[name].restates_declared for name in chosen.hypothesis):
        return path, ()
    causes = [e.id for e in effects.values() if e.kind == "parameter" and not e.restates_declared]
    fits = [fitted_hypothesis(path.problem, path.blocks, (cause,), path.base, archive) for cause in causes]
    inside = [fit for fit in fits if fit is not None and not fit.at_bounds]
    best = most_plausible([chosen, *inside], len(path.problem.competing()))
    if best is None or best is chosen:
        return path, ()
    step = Step((path.base,), (), (best,), best)
    group = (*best.hypothesis, *chosen.hypothesis)
    return replace(path, steps=(*path.steps, step), chosen=best), group
