"""What is different about some records, with others of the same cell beside them that are known to be good?

The model errs on all of them. The good records say how large its error is in this cell, and what of the instruments
all of them share; effects act on the others alone. What is named is a difference between records, and what a right
answer may leave is what the model leaves of the good ones. What the cell is made with is alike in all. Its age should
be, and is asked about: a cell that has lost lithium since the good records reads like one whose current reads too low.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from aesi.numerics.metrics import rms
from aesi.numerics.typing import BoolArray
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.decide.carry_over import ORDINARY_C, range_fault
from aesi.tracer.decide.evidence import MEASURED_EFFECTS, Answer, Evidence, with_confidence
from aesi.tracer.decide.verdict import MOST_SDS, Thresholds, Verdict, best_gain, beyond, look_alikes
from aesi.tracer.decide.written import limits_of
from aesi.tracer.likelihood.fit import FittedHypothesis, held_out_residual
from aesi.tracer.likelihood.growth import Explanation, Parent
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.fitted import fitted_hypothesis
from aesi.tracer.search.forward import searched
from aesi.tracer.search.grown import grown_with
from aesi.tracer.search.path import Path, Report
from aesi.tracer.search.plausible import alike
from aesi.tracer.search.wrong_parameters import NINETY


def gathered_beside(
    problem: InverseProblem, max_effects: int, archive: Archive, thresholds: Thresholds, report: Report
) -> Answer:
    """Search for what the records have that the good ones have not, and judge.

    Raises DataError where the model cannot be simulated on the records.
    """
    beside = replace(problem, trust="beside")
    path = searched(beside, min(max_effects, MEASURED_EFFECTS), archive, report)
    verdict = of_one_age(judged_beside(path, thresholds), path.chosen, _of_another_age(path, archive))
    return Answer(path, verdict, {"beside": path}, partial(_settled, path))


def _settled(path: Path, verdict: Verdict) -> Evidence:
    beside, verdict = path.problem, with_confidence(verdict)
    recalibrated = ModelState.of(beside, path.base)
    after = ModelState.of(beside, path.chosen) if verdict.effects else recalibrated
    fault = range_fault(after, ORDINARY_C)
    if fault is not None:
        return Evidence(path, {"beside": path}, recalibrated, ModelState(beside), verdict, fault)
    limits = limits_of(after) if verdict.effects else ()
    return Evidence(path, {"beside": path}, recalibrated, after, verdict, None, limits)


def _of_another_age(path: Path, archive: Archive) -> list[FittedHypothesis]:
    """What the records would be left with if instead of what is named the cell had aged beside the good ones."""
    if not path.chosen.hypothesis:
        return []
    names = [name for name, effect in path.problem.effects.items() if effect.of_age]
    grown = grown_with(Parent(path.problem, path.blocks, path.base), names, archive)
    fits = (fitted_hypothesis(path.problem, path.blocks, one.hypothesis, one, archive) for one in grown)
    return [fit for fit in fits if fit is not None]


def of_one_age(verdict: Verdict, named: Explanation, aged: Sequence[Explanation]) -> Verdict:
    """The verdict, with what an age of its own would say as well of the records among the look-alikes; no name where
    it says more.

    named : what the verdict names.  aged : what an age would say instead.
    """
    if not verdict.effects:
        return verdict
    better = [one for one in aged if not alike(one, named)]
    if better:
        most = max(better, key=lambda one: one.score.total)
        reason = (
            f"{most.hypothesis[0]} says {most.score.total - named.score.total:.1f} nats more of unseen data than "
            f"{verdict.effects[0]} does, and records of one age do not differ by it: the good records seem to be of "
            "another age; leave out --good to ask what the cell has lost since its file"
        )
        return replace(verdict, word="unknown", effects=(), confidence_sets=(), reason=reason, margin=0.0)
    as_well = tuple(one.hypothesis[0] for one in aged if alike(named, one))
    if not as_well:
        return verdict
    (known,) = verdict.confidence_sets or (verdict.effects,)
    reason = (
        f"{verdict.reason}; {' or '.join(as_well)} would say as much if the good records are of another age"
    )
    return replace(verdict, confidence_sets=((*known, *as_well),), reason=reason)


def judged_beside(path: Path, thresholds: Thresholds) -> Verdict:
    """The verdict on a search beside good records; its confidence is still to be read off the margin."""
    problem = path.problem
    good = problem.good_rows
    before, left = (left_v(path, one, ~good) for one in (path.base, path.chosen))
    usual = left_v(path, path.chosen, good & problem.compared)
    allowed = usual * (1.0 + NINETY * _relative_sd(problem, good))
    named = path.chosen.hypothesis
    if left > allowed and path.gain(path.chosen) * (usual / left) ** 2 < path.admission_nats:
        named = ()  # of the error that these records show by themselves it does not say enough
    groups, margin = look_alikes(path, thresholds, max(allowed, left)) if named else ((), -best_gain(path))
    others = ", ".join(r.name for r in problem.records if not r.good)
    reason = (
        f"{1e3 * before:.1f} mV beyond the noise on unseen data of {others} before, {1e3 * left:.1f} mV after; "
        f"{1e3 * usual:.1f} mV on the good records"
    )
    if left > allowed:
        reason += f", beyond {1e3 * allowed:.1f} mV no chance: not all of what is different is explained"
        if not named:
            margin = float(np.log(left / allowed)) if allowed > 0.0 else MOST_SDS
        return Verdict("unknown", named, groups, 0.0, left, allowed, reason, max(margin, 0.0))
    return Verdict("found" if named else "none", named, groups, 0.0, left, allowed, reason, margin)


def left_v(path: Path, one: FittedHypothesis, rows: BoolArray) -> float:
    """What a hypothesis leaves beyond noise of some rows, in blocks that it has not seen, V RMS."""
    return beyond(rms(held_out_residual(path.blocks, one)[rows]), rms(path.problem.white_v[rows]))


def _relative_sd(problem: InverseProblem, good: BoolArray) -> float:
    """By how much the root mean squares of both kinds of record differ by chance, as a share: each of N independent
    samples is uncertain by one over the root of 2 N."""
    many = [float(problem.independent[rows].sum()) for rows in (good, ~good)]
    return float(np.sqrt(sum(0.5 / n for n in many)))
