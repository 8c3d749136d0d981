"""Forward search: step by step, the effect with the largest gain on unseen data is added, as long as it is admitted.

A step grows every effect on the hypotheses kept so far, their parameters to first order, and fits the best results with
the whole model. Its record is frozen, and the verdict needs no further simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.tracer.case.blocks import Blocks, blocks_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis, held_out_residual
from aesi.tracer.likelihood.growth import EffectGrowth, Explanation, Grown, Parent
from aesi.tracer.likelihood.surrogates import admission_nats
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.growths import grow_all, growths_on, promising_first
from aesi.tracer.search.hypothesis_fits import (
    base_of,
    fitted_hypothesis,
    linearised_as_declared,
    refitted_off_bounds,
)
from aesi.tracer.search.path import Path, Report, Step, excess_mean_square_v2, unseen_rmse_v
from aesi.tracer.search.plausible import most_plausible, plausibility
from aesi.tracer.search.reach import REACH_FACTOR, reach_check

FINALISTS = 6
"""Effects that are fitted with the whole model in a step, the best ones; further ones only where no fit of these does
what the next growth promises. Growth is to first order in the parent's parameters, so that a right effect can gain too
little in it. On a blind development case (leakage and a resistance on the LG M50) the right second effect stood fifth
to first order, with 10 nats, and first with 61 when fitted: three fits left 1.36 mV with a wrong name, six 1.006 of a
noise of 1.01, in 30 instead of 22 s of processor."""
FINALIST_SHARE = 0.5
"""Least share of the best gain to first order that an effect needs in order to be fitted. On six blind cases of
seeds 0 and 12 those below ended at 2 to 27 % of the best one's full fit."""
BEYOND_ONE_EFFECT_SHARE = 0.7
"""Share of the mean square error beyond noise, on unseen data, of the model without effects. Where two effects leave
more than this, no third is tried and none is exchanged. A convention that saves time: on a measured cell, which no two
effects explain, each further round takes minutes. One effect may leave all of it: on a blind case (a contact,
hysteresis and heat, seed 13) the first of three gained 256 nats and did not lower the error, and the three were
found."""


def forward_search(
    problem: InverseProblem,
    max_effects: int,
    archive: Archive,
    report: Report = lambda problem, one, gain: None,
    allowed_v: float = np.inf,
    shallower: Path | None = None,
) -> Path:
    """The search from the bare model until no effect is admitted, with at most `max_effects` effects.

    allowed_v : error beyond noise that a right hypothesis may leave, V. No effect is fitted where all effects together
    leave far more.  shallower : the same search with fewer effects, whose first step is reused.
    Raises DataError where the bare model cannot be simulated on the records.
    """
    blocks = blocks_of(problem)
    base = base_of(problem, blocks, archive)
    if base is None:
        raise DataError(
            f"the model of {problem.cell.name} cannot be simulated; check the cell file: {problem.failure_reason(())}"
        )
    if shallower is not None and shallower.beyond_reach_v is not None:
        return shallower
    known_first_step = None if shallower is None else next(iter(shallower.steps), None)
    first = (
        growths_on([Parent(problem, blocks, base)], {}, archive)
        if max_effects and known_first_step is None
        else []
    )
    # With fewer effects, fitting them takes no longer than the check would save.
    if len(first) > FINALISTS and np.isfinite(allowed_v):
        reach_v = REACH_FACTOR * allowed_v + problem.reduced_v
        least_v, first = reach_check(problem, base, first, reach_v, archive)
        if least_v > reach_v:
            return Path(problem, blocks, base, (), base, beyond_reach_v=least_v)
    first, slopes = promising_first(first, archive)
    notes = () if shallower is None else shallower.notes
    search = _ForwardSearch(problem, blocks, base, archive, report, slopes, notes)
    chosen = search.add(max_effects, first, known_first_step)
    least_nats = max((step.admission_nats for step in search.steps), default=0.0)
    chosen = without_unneeded(problem, blocks, chosen, least_nats, archive, base, report)
    if not search.beyond_one_effect(chosen):
        chosen = search.exchange(chosen)
    return Path(problem, blocks, base, tuple(search.steps), chosen, tuple(dict.fromkeys(search.notes)))


class _ForwardSearch:
    """A search in progress.

    base : the hypothesis without effects.  slopes : effect -> (n, k) V, sensitivities of its growth on the base.
    steps, notes : so far.
    """

    def __init__(
        self,
        problem: InverseProblem,
        blocks: Blocks,
        base: FittedHypothesis,
        archive: Archive,
        report: Report,
        slopes: Mapping[str, Array],
        notes: Sequence[str],
    ) -> None:
        self.problem, self.blocks, self.base = problem, blocks, base
        self.archive, self.report = archive, report
        self.slopes, self.notes = dict(slopes), list(notes)
        self.steps: list[Step] = []

    def add(
        self, max_effects: int, first: Sequence[EffectGrowth], known_first_step: Step | None
    ) -> FittedHypothesis:
        """The hypothesis after steps of one effect each, until none is admitted or the case is `beyond_one_effect`.

        first : growths of the first step; all effects where it is empty.  known_first_step : the first step, where a
        search with fewer effects made it already.
        """
        parents, chosen = [self.base], self.base
        for number in range(max_effects):
            if number == 0 and known_first_step is not None:
                step = known_first_step
            else:
                step, refused = self._step(parents, first if number == 0 else ())
                self.notes += refused
            if number == 0:
                self.slopes |= {g.hypothesis[-1]: g.slopes_v for g in step.grown}
            self.steps.append(step)
            if step.admitted is None:
                break
            chosen = step.admitted
            if len(chosen.hypothesis) > 1 and self.beyond_one_effect(chosen):
                break
            parents = [chosen, *(f for f in step.fitted if f is not chosen)]
        return chosen

    def exchange(self, chosen: FittedHypothesis) -> FittedHypothesis:
        """The hypothesis with one effect at a time exchanged for another, while that gains: the effect added first may
        only stand in for several missing ones. The steps that this takes are added to `steps`."""
        grown_from = {frozenset(parent.hypothesis) for step in self.steps for parent in step.parents}
        while True:
            rests = [
                tuple(other for other in chosen.hypothesis if other != name) for name in chosen.hypothesis
            ]
            new = [rest for rest in rests if frozenset(rest) not in grown_from]
            others = []
            for rest in new:
                grown_from.add(frozenset(rest))
                fit = self._fitted(rest, chosen)
                if fit is None:
                    continue
                step, _ = self._step([fit])
                self.steps.append(step)
                if step.admitted is not None:
                    others.append(step.admitted)
            best = most_plausible([chosen, *others], len(self.problem.competing()))
            if best is None or best is chosen:
                return chosen
            chosen = best

    def beyond_one_effect(self, chosen: FittedHypothesis) -> bool:
        """Whether the hypothesis leaves so large an error that one more effect cannot explain it."""
        remaining, without = (
            excess_mean_square_v2(self.problem, self.blocks, fit) for fit in (chosen, self.base)
        )
        return remaining > BEYOND_ONE_EFFECT_SHARE * without

    def _step(
        self, parents: Sequence[FittedHypothesis], growths: Sequence[EffectGrowth] = ()
    ) -> tuple[Step, list[str]]:
        """(one step, sentences on effects that could not be tried).

        parents : the hypothesis chosen so far, then others to grow from.  growths : growths on these; empty takes all
        that are worth it.
        """
        best = parents[0]
        places = [Parent(self.problem, self.blocks, fit) for fit in parents]
        grown, refused = _grown(growths or growths_on(places, self.slopes, self.archive), self.archive)
        slopes = {**self.slopes, **{g.hypothesis[-1]: g.slopes_v for g in grown}}
        declared = linearised_as_declared(self.problem, self.blocks, best)
        if declared is not None:
            place = Parent(self.problem, self.blocks, declared)
            again, more = _grown(growths_on([place], slopes, self.archive), self.archive)
            grown, refused = [*grown, *again], [*refused, *more]
        for one in grown:
            self.report(self.problem, one, one.score.total - best.score.total)
        ranked = _ranked(grown)
        least_nats = admission_nats(places[0], slopes)
        fitted = self._finalists_fitted(ranked, best)
        candidates = [f for f in fitted if admissible(self.problem, self.blocks, best, f, least_nats)]
        admitted = most_plausible(candidates, len(self.problem.competing()))
        return Step(tuple(parents), tuple(ranked), tuple(fitted), admitted, least_nats), refused

    def _finalists_fitted(self, ranked: Sequence[Grown], best: FittedHypothesis) -> list[FittedHypothesis]:
        """The best growths, fitted with the whole model; best first. There are more than `FINALISTS` where none of the
        fits reaches what the next growth promises, so that the growths have not shown which is best."""
        fitted: list[FittedHypothesis] = []
        for number, one in enumerate(_finalists(ranked, best)):
            reached = max((fit.score.total for fit in fitted), default=-np.inf)
            if number >= FINALISTS and reached >= one.score.total:
                break
            fit = self._fitted(one.hypothesis, one)
            if fit is not None:
                self.report(self.problem, fit, fit.score.total - best.score.total)
                fitted.append(fit)
        fitted.sort(key=lambda f: -f.score.total)
        if fitted and fitted[0].at_bounds:
            fitted[0] = refitted_off_bounds(self.problem, self.blocks, fitted[0], self.archive)
        return fitted

    def _fitted(self, hypothesis: Sequence[str], near: Explanation) -> FittedHypothesis | None:
        return fitted_hypothesis(self.problem, self.blocks, hypothesis, near, self.archive)


def without_unneeded(
    problem: InverseProblem,
    blocks: Blocks,
    chosen: FittedHypothesis,
    least_nats: float,
    archive: Archive,
    base: FittedHypothesis | None = None,
    report: Report = lambda problem, one, gain: None,
    may_be: Callable[[FittedHypothesis], bool] = lambda fit: True,
) -> FittedHypothesis:
    """The hypothesis, with effects dropped one at a time that it does not need beside the others.

    least_nats : gain on unseen data below which an effect is dropped.  base : the hypothesis without effects; None
    where one effect has to stay.  may_be : whether a smaller hypothesis is admissible by itself.
    """
    while chosen.hypothesis:
        best: FittedHypothesis | None = None
        for name in chosen.hypothesis:
            rest = tuple(other for other in chosen.hypothesis if other != name)
            fit = fitted_hypothesis(problem, blocks, rest, chosen, archive) if rest else base
            if fit is None:
                continue
            report(problem, fit, fit.score.total - chosen.score.total)
            if (
                not needed(problem, blocks, fit, chosen, least_nats)
                and may_be(fit)
                and (best is None or fit.score.total > best.score.total)
            ):
                best = fit
        if best is None:
            break
        chosen = best
    return chosen


def refitted(problem: InverseProblem, path: Path, archive: Archive) -> Path | None:
    """The chosen hypothesis of a path, refitted at the trust of `problem`, with nothing else tried; None where it
    cannot be simulated."""
    blocks = blocks_of(problem)
    base = base_of(problem, blocks, archive)
    if base is None:
        return None
    fit = fitted_hypothesis(problem, blocks, path.chosen.hypothesis, path.chosen, archive)
    search = path.search or path
    return None if fit is None else Path(problem, blocks, base, path.steps, fit, path.notes, search=search)


def _grown(growths: Sequence[EffectGrowth], archive: Archive) -> tuple[list[Grown], list[str]]:
    """(growths at their ends, sentences on those that could not be simulated)."""
    grown, refused = [], []
    for growth, one in zip(growths, grow_all(growths, archive), strict=True):
        if one is None:
            names = (*growth.parent.fit.hypothesis, growth.effect)
            refused.append(f"{' + '.join(names)}: not tried; {growth.problem.failure_reason(names)}")
        else:
            grown.append(one)
    return grown, refused


def _ranked(grown: Sequence[Grown]) -> list[Grown]:
    """The growths, best first; of several with the same effects only the best."""
    best: dict[frozenset[str], Grown] = {}
    for one in sorted(grown, key=lambda g: -g.score.total):
        best.setdefault(frozenset(one.hypothesis), one)
    return list(best.values())


def _finalists(ranked: Sequence[Grown], best: FittedHypothesis) -> list[Grown]:
    """The growths that are worth a fit with the whole model."""
    gains = [one.score.total - best.score.total for one in ranked]
    least = max(FINALIST_SHARE * max(gains, default=0.0), 0.0)
    return [one for one, gain in zip(ranked, gains, strict=True) if gain > least]


def admissible(
    problem: InverseProblem,
    blocks: Blocks,
    without: FittedHypothesis,
    fit: FittedHypothesis,
    least_nats: float,
) -> bool:
    """Whether an effect is admitted: it gains more than `least_nats` on unseen data, makes the hypothesis more
    plausible, moves the voltage by more than approximations of the model do, and ends on no bound. It need not lower
    the error: the first of several effects may not lower it at all."""
    competing = len(problem.competing())
    moved_v = held_out_residual(blocks, without) - held_out_residual(blocks, fit)
    return (
        fit.score.total - without.score.total > least_nats
        and plausibility(fit, competing) > plausibility(without, competing)
        and float(np.mean(moved_v**2)) > problem.approximated_v**2
        and not fit.at_bounds
    )


def needed(
    problem: InverseProblem,
    blocks: Blocks,
    without: FittedHypothesis,
    fit: FittedHypothesis,
    least_nats: float,
) -> bool:
    """Whether the effect would be admitted on top of all the others, and lowers the error on unseen data."""
    lowers = unseen_rmse_v(blocks, fit) < unseen_rmse_v(blocks, without)
    return lowers and admissible(problem, blocks, without, fit, least_nats)
