"""Forward search: the effect that says most of unseen data is added while that is admitted.

A step grows every effect on the hypotheses kept so far, the rest to first order, and fits the best of them with the
whole model. What is kept of it is frozen evidence, from which a verdict follows without another simulation.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.typing import Array
from aesi.tracer.case.blocks import Blocks, blocks_of
from aesi.tracer.case.free_parameter import coordinates_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.decide.archive import Archive, fit_name
from aesi.tracer.likelihood.fit import FittedHypothesis, HypothesisFitter, held_out_residual
from aesi.tracer.likelihood.growth import Explanation, Grown, Parent, grow, promise
from aesi.tracer.likelihood.model_error import PRIORS
from aesi.tracer.likelihood.surrogates import admission_nats

BASE_STEPS = 8
REFIT_STEPS = 3
FINALISTS = 6
"""Effects that are fitted with the whole model: so many of the best. Growth is to first order in all that was there
before, so what it says of a right effect can be far too little."""
PROMISING = 9
"""Effects that are grown on a hypothesis with effects: those that say most to first order."""
BEAM = 2
"""Hypotheses that a further effect is tried on."""
NINETY = 1.645
"""Standard deviations either side of a 90 % interval."""
WRONG_SDS = 2.0
"""Of its spread: a declared parameter that the data put further off, with 95 % probability, is wrong and is named."""
HOPELESS_SHARE = 0.7
"""Of the mean square beyond noise on unseen data: where the best effect leaves more, a further one is not tried."""
ALIKE_NATS = 3.0
"""Hypotheses within this of each other say as much."""
LEAST_V = 1.5e-4
"""And what it has to take off the error on unseen data: less is within what two solvers of one model differ by."""


@dataclass(frozen=True, eq=False)
class Step:
    """One step: what the parents grew, best first, what was fitted in full, and the nats that admit an effect."""

    parents: tuple[FittedHypothesis, ...]
    grown: tuple[Grown, ...]
    fitted: tuple[FittedHypothesis, ...]
    admitted: FittedHypothesis | None
    admission_nats: float = 0.0

    @property
    def best_gain(self) -> float:
        """Nats that the best effect says more than its parent, admitted or not."""
        if not self.grown:
            return -np.inf
        return max(g.score.total for g in self.grown) - max(p.score.total for p in self.parents)


@dataclass(frozen=True, eq=False)
class Path:
    """A search that is over: the base without effects, the steps, and the hypothesis that was chosen."""

    problem: InverseProblem
    blocks: Blocks
    base: FittedHypothesis
    steps: tuple[Step, ...]
    chosen: FittedHypothesis
    notes: tuple[str, ...] = ()

    def explanations(self) -> list[Explanation]:
        """All that was tried, each at its best: fits with the whole model before first-order ones."""
        best: dict[frozenset[str], Explanation] = {frozenset(): self.base}
        for step in self.steps:
            tried: list[Explanation] = [*step.grown, *step.fitted]
            for one in tried:  # a full fit takes the place of a linear one
                best[frozenset(one.hypothesis)] = one
        return list(best.values())

    @property
    def admission_nats(self) -> float:
        """What an effect had to say more of unseen data at the strictest step."""
        return max((step.admission_nats for step in self.steps), default=0.0)

    def gain(self, one: Explanation) -> float:
        """Nats that a hypothesis says more than the base."""
        return one.score.total - self.base.score.total


Report = Callable[[InverseProblem, "Explanation", float], None]
"""Called with each hypothesis and what it says more than its parent, nats."""


def unseen_rmse_v(blocks: Blocks, one: Explanation) -> float:
    """Root mean square of the residual on blocks that were left out, V."""
    return float(np.sqrt(np.mean(held_out_residual(blocks, one) ** 2)))


def base_of(
    problem: InverseProblem, archive: Archive
) -> tuple[InverseProblem, Blocks, FittedHypothesis] | None:
    """The hypothesis without effects; None where it cannot be simulated."""
    blocks = blocks_of(problem)
    fit = fitted_hypothesis(problem, blocks, (), None, PRIORS[problem.trust].median_v, BASE_STEPS, archive)
    return None if fit is None else (problem, blocks, fit)


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


def searched(
    problem: InverseProblem,
    max_effects: int,
    enough: Callable[[Blocks, FittedHypothesis], bool],
    archive: Archive,
    report: Report = lambda problem, one, gain: None,
) -> Path | None:
    """Grow from the bare model until nothing more is admitted, at most `max_effects` effects.

    enough : is what a hypothesis leaves within what a right one leaves? Then nothing is added that does not say much.
    """
    based = base_of(problem, archive)
    if based is None:
        return None
    problem, blocks, base = based
    steps: list[Step] = []
    notes: list[str] = []
    parents, chosen = [base], base
    slopes: dict[str, Array] = {}
    for _ in range(max_effects):
        step, refused = _step(problem, blocks, parents, chosen, slopes, archive, report)
        slopes = slopes or {g.hypothesis[-1]: g.slopes_v for g in step.grown}
        notes += refused
        steps.append(step)
        if step.admitted is None:
            break
        left = [beyond_noise(problem, blocks, fit) for fit in (chosen, step.admitted)]
        chosen = step.admitted
        if not enough(blocks, chosen) and left[1] > HOPELESS_SHARE * left[0]:
            break
        others = () if enough(blocks, chosen) else (f for f in step.fitted if f is not chosen)
        parents = [chosen, *others][:BEAM]
    chosen = _pruned(problem, blocks, chosen, steps, archive, report)
    return Path(problem, blocks, base, tuple(steps), chosen, tuple(dict.fromkeys(notes)))


def with_wrong_parameters(path: Path, archive: Archive) -> Path:
    """The path with those declared parameters as effects that the data put beyond what cell files are off by.

    One at a time, that which says most: another one may only have made up for it.
    """
    chosen = path.chosen
    while beyond := _beyond_spread(path.problem, chosen):
        start, size = chosen.placed, chosen.score.delta_v
        fits = [
            fitted_hypothesis(
                path.problem, path.blocks, (*chosen.hypothesis, owner), start, size, 2 * REFIT_STEPS, archive
            )
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


def _beyond_spread(problem: InverseProblem, fit: FittedHypothesis) -> list[str]:
    """Ids of the effects whose own parameters are off by more than files are, with 95 % probability."""
    sds = np.sqrt(np.diagonal(fit.score.covariance))
    owners = [
        f.owner
        for f, x, sd in zip(fit.free, fit.point.x, sds, strict=True)
        if f.own and f.owner in problem.effects and problem.effects[f.owner].refines is None
        if abs(float(x)) - NINETY * float(sd) > WRONG_SDS
    ]
    return list(dict.fromkeys(owners))


def _pruned(
    problem: InverseProblem,
    blocks: Blocks,
    chosen: FittedHypothesis,
    steps: Sequence[Step],
    archive: Archive,
    report: Report,
) -> FittedHypothesis:
    """The hypothesis without effects that it does not need once the others are in."""
    least_nats = max((step.admission_nats for step in steps), default=0.0)
    while len(chosen.hypothesis) > 1:
        best: FittedHypothesis | None = None
        for name in chosen.hypothesis[:-1]:  # the last one was admitted on top of the others
            rest = tuple(other for other in chosen.hypothesis if other != name)
            start, size = chosen.placed, chosen.score.delta_v
            fit = fitted_hypothesis(problem, blocks, rest, start, size, 2 * REFIT_STEPS, archive)
            if fit is None:
                continue
            report(problem, fit, fit.score.total - chosen.score.total)
            if not _admitted(blocks, fit, chosen, least_nats) and (
                best is None or fit.score.total > best.score.total
            ):
                best = fit
        if best is None:
            break
        chosen = best
    return chosen


def beyond_noise(problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis) -> float:
    """V**2 beyond the noise on unseen data."""
    return max(unseen_rmse_v(blocks, fit) ** 2 - float(np.mean(problem.white_v**2)), 0.0)


def refitted(problem: InverseProblem, path: Path, archive: Archive) -> Path | None:
    """The chosen hypothesis of a path at another trust in the declared parameters, with nothing else tried."""
    based = base_of(problem, archive)
    if based is None:
        return None
    problem, blocks, base = based
    start, size = path.chosen.placed, path.chosen.score.delta_v
    fit = fitted_hypothesis(problem, blocks, path.chosen.hypothesis, start, size, BASE_STEPS, archive)
    return None if fit is None else Path(problem, blocks, base, path.steps, fit, path.notes)


def _step(
    problem: InverseProblem,
    blocks: Blocks,
    parents: Sequence[FittedHypothesis],
    best: FittedHypothesis,
    slopes: Mapping[str, Array],
    archive: Archive,
    report: Report,
) -> tuple[Step, list[str]]:
    wanted = [
        (parent, name)
        for parent in (Parent(problem, blocks, fit) for fit in parents)
        for name in _promising(parent, slopes)
    ]
    grown: dict[frozenset[str], Grown] = {}
    refused = []
    for (parent, name), one in zip(wanted, _side_by_side(wanted, archive), strict=True):
        if one is None:
            why = problem.why_not((*parent.fit.hypothesis, name))
            refused.append(f"{' + '.join((*parent.fit.hypothesis, name))}: not tried; {why}")
            continue
        report(problem, one, one.score.total - parent.fit.score.total)
        key = frozenset(one.hypothesis)
        if key not in grown or one.score.total > grown[key].score.total:
            grown[key] = one
    ranked = sorted(grown.values(), key=lambda g: -g.score.total)
    slopes = {**slopes, **{g.hypothesis[-1]: g.slopes_v for g in ranked}}
    least_nats = admission_nats(Parent(problem, blocks, best), slopes)
    fitted = []
    for one in (g for g in ranked[:FINALISTS] if g.score.total - best.score.total > least_nats / 2):
        fit = fitted_hypothesis(
            problem, blocks, one.hypothesis, dict(one.placed), one.score.delta_v, REFIT_STEPS, archive
        )
        if fit is not None:
            report(problem, fit, fit.score.total - best.score.total)
            fitted.append(fit)
    fitted.sort(key=lambda f: -f.score.total)
    admitted = next((f for f in fitted if _admitted(blocks, best, f, least_nats)), None)
    return Step(tuple(parents), tuple(ranked), tuple(fitted), admitted, least_nats), refused


def _admitted(blocks: Blocks, without: FittedHypothesis, fit: FittedHypothesis, least_nats: float) -> bool:
    off = unseen_rmse_v(blocks, without) ** 2 - unseen_rmse_v(blocks, fit) ** 2
    says = fit.score.total - without.score.total
    return says > least_nats and off > LEAST_V**2 and not fit.at_bounds


def _promising(parent: Parent, slopes: Mapping[str, Array]) -> list[str]:
    """Effects to grow on a parent: all on the bare model, later those that say most with the slopes that they had."""
    names = [
        name
        for name in parent.problem.competing()
        if name not in parent.fit.hypothesis and _has_something_to_say(parent.problem, name)
    ]
    if not slopes:
        return names
    size = parent.fit.score.delta_v
    said = {name: promise(parent, slopes[name], size) for name in names if name in slopes}
    ranked = sorted(said, key=lambda name: -said[name])[:PROMISING]
    return [name for name in names if name in ranked]


def _has_something_to_say(problem: InverseProblem, name: str) -> bool:
    """Not what infers a quantity that every record holds, nor what every hypothesis may move anyway."""
    effect = problem.effects[name]
    if effect.infers is not None and all(r.data.temperature_degc is not None for r in problem.records):
        return False
    if problem.trust != "loose":
        return True
    return not all(p.spread is not None and p.spread.loose is not None for p in effect.parameters.values())


def _side_by_side(wanted: Sequence[tuple[Parent, str]], archive: Archive) -> Iterable[Grown | None]:
    """Growths in threads, since simulations do not hold the interpreter's lock; in the order asked for, so that the
    outcome does not depend on how many threads there are."""

    def one(parent: Parent, name: str) -> Grown | None:
        key = fit_name(parent.problem, "grown", (*parent.fit.hypothesis, name))
        known = archive.get(key, len(parent.problem.effects[name].parameters))
        found = grow(parent, name, _growth_size(parent), known)
        if found is not None:
            archive.put(key, found.u)
        return found

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = [pool.submit(one, parent, name) for parent, name in wanted]
        try:
            for future in futures:
                yield future.result()
        finally:
            for future in futures:
                future.cancel()


def _growth_size(parent: Parent) -> float:
    """Size of the model error at which the parameters of an effect are fitted: what a right hypothesis leaves."""
    prior = PRIORS[parent.problem.trust]
    return prior.nearest(prior.median_v)
