"""How do some records differ from other records of the same cell that are known to be good?

The model errs on all records. The good ones show how large its error is for this cell, and which instrument errors all
records share. Effects act on the other records alone, so that a named effect is a difference between records. A right
answer may leave an error as large as that on the good records. The design of the cell is the same in all records. Its
age should be, and is checked: a cell that has lost lithium since the good records looks like one whose current reads
too low.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms
from aesi.numerics.typing import BoolArray
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.decide.carry_over import ORDINARY_C, range_fault
from aesi.tracer.decide.evidence import MEASURED_EFFECTS, Answer, Evidence, with_confidence
from aesi.tracer.decide.model_to_write import fast_load_limits
from aesi.tracer.decide.shared_effects import searched_unshared
from aesi.tracer.decide.verdict import Thresholds, Verdict, best_gain, beyond_noise, look_alikes, tolerance_v
from aesi.tracer.likelihood.fit import FittedHypothesis, held_out_residual
from aesi.tracer.likelihood.growth import Explanation, Parent
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.growths import grown_with
from aesi.tracer.search.hypothesis_fits import fitted_hypothesis
from aesi.tracer.search.path import Path, Report
from aesi.tracer.search.plausible import alike, score_lag, sds_behind
from aesi.tracer.search.wrong_parameters import NINETY_SDS


def searched_answer_beside(
    problem: InverseProblem, max_effects: int, archive: Archive, thresholds: Thresholds, report: Report
) -> Answer:
    """The search for effects that act on the other records and not on the good ones, with its verdict.

    Raises DataError where the model cannot be simulated on the records.
    """
    beside = replace(problem, trust="beside")
    found = searched_unshared(beside, min(max_effects, MEASURED_EFFECTS), archive, report)
    path = replace(found.path, notes=(*found.path.notes, *found.shared))
    verdict = verdict_beside(path, thresholds)
    if verdict.word != "none":
        believed = path.chosen if verdict.effects else path.base
        allowed_error = AllowedError.of(path, believed, thresholds)
        aged = [
            one
            for one in _ageing_hypotheses(path, found.archive)
            if allowed_error.discounted_gain_nats(path, one) > path.admission_nats
        ]
        verdict = checked_against_ageing(verdict, believed, aged)
    return Answer(path, verdict, {"beside": path}, partial(_evidence_for, path))


def _evidence_for(path: Path, verdict: Verdict) -> Evidence:
    beside, verdict = path.problem, with_confidence(verdict)
    recalibrated = ModelState.of(beside, path.base)
    after = ModelState.of(beside, path.chosen) if verdict.effects else recalibrated
    fault = range_fault(after, ORDINARY_C)
    if fault is not None:
        return Evidence(path, {"beside": path}, recalibrated, ModelState(beside), verdict, fault)
    limits = fast_load_limits(after) if verdict.effects else ()
    return Evidence(path, {"beside": path}, recalibrated, after, verdict, None, limits)


def _ageing_hypotheses(path: Path, archive: Archive) -> list[FittedHypothesis]:
    """The fitted hypotheses in which the cell has aged since the good records, one ageing effect each; best first."""
    names = [name for name, effect in path.problem.effects.items() if effect.of_age]
    grown = grown_with(Parent(path.problem, path.blocks, path.base), names, archive)
    fits = (fitted_hypothesis(path.problem, path.blocks, one.hypothesis, one, archive) for one in grown)
    return sorted((fit for fit in fits if fit is not None), key=lambda fit: -fit.score.total)


def checked_against_ageing(verdict: Verdict, believed: Explanation, aged: Sequence[Explanation]) -> Verdict:
    """The verdict, checked against ageing. Ageing effects that score as well join the look-alikes; where one scores
    better, the verdict is `unknown` without a name.

    believed : the hypothesis of the verdict, or the model without an effect.  aged : hypotheses with an ageing effect
    instead, best first.
    """
    better = tuple(one for one in aged if not alike(one, believed))
    if better:
        nats = better[0].score.total - believed.score.total
        instead = verdict.effects[0] if verdict.effects else "no effect"
        reason = (
            f"{better[0].hypothesis[0]} scores {nats:.1f} nats higher on unseen data than {instead}, and records of "
            "one age cannot differ by it: the good records seem to be of another age; leave out --good to ask what the "
            "cell has lost since its file"
        )
        names = tuple(one.hypothesis[0] for one in better)
        return replace(
            verdict, word="unknown", effects=(), confidence_sets=(), reason=reason, margin=0.0, aged=names
        )
    if not verdict.effects:
        return verdict
    as_well = tuple(one.hypothesis[0] for one in aged if alike(believed, one))
    behind = [sds_behind(*score_lag(believed, one)) for one in aged if one.hypothesis[0] not in as_well]
    verdict = replace(verdict, margin=min([verdict.margin, *behind]))
    if not as_well:
        return verdict
    known = (
        verdict.confidence_sets[0] if verdict.confidence_sets else verdict.effects
    )  # one name is the most here
    reason = f"{verdict.reason}; {' or '.join(as_well)} scores as high if the good records are of another age"
    return replace(verdict, confidence_sets=((*known, *as_well),), reason=reason)


@dataclass(frozen=True)
class AllowedError:
    """Error that a right answer may leave on the other records, V RMS beyond the noise.

    good_v : error of the model on the good records.  usual_v : that and the tolerance for any right hypothesis, added
    as squares.  allowed_v : usual_v, enlarged by the difference that two records may have by chance.
    """

    good_v: float
    usual_v: float
    allowed_v: float

    @classmethod
    def of(cls, path: Path, believed: FittedHypothesis, thresholds: Thresholds) -> AllowedError:
        """The errors under the hypothesis that is believed."""
        problem, good = path.problem, path.problem.good_rows
        good_v = error_beyond_noise_v(path, believed, good & problem.compared)
        usual_v = float(np.hypot(good_v, tolerance_v(problem, thresholds)))
        return cls(good_v, usual_v, usual_v * (1.0 + NINETY_SDS * _relative_sd(problem, good)))

    def discounted_gain_nats(self, path: Path, one: FittedHypothesis) -> float:
        """Gain of a hypothesis over the bare model, nats. Where its error on the other records, left_v, is more than
        `allowed_v`, the gain is multiplied by the ratio of the mean squares (usual_v / left_v)**2."""
        left_v = error_beyond_noise_v(path, one, ~path.problem.good_rows)
        return path.gain(one) * (1.0 if left_v <= self.allowed_v else (self.usual_v / left_v) ** 2)


def verdict_beside(path: Path, thresholds: Thresholds) -> Verdict:
    """The verdict on a search beside good records, without its confidence (`evidence.with_confidence`)."""
    problem, allowed_error = path.problem, AllowedError.of(path, path.chosen, thresholds)
    before, left = (error_beyond_noise_v(path, one, ~problem.good_rows) for one in (path.base, path.chosen))
    named = path.chosen.hypothesis
    if (
        left > allowed_error.allowed_v
        and allowed_error.discounted_gain_nats(path, path.chosen) < path.admission_nats
    ):
        # The gain is too small for the error on these records: the verdict is on the model without an effect.
        named, left, allowed_error = (), before, AllowedError.of(path, path.base, thresholds)
    allowed = allowed_error.allowed_v
    groups, margin = look_alikes(path, thresholds) if named else ((), -best_gain(path))
    others = ", ".join(r.name for r in problem.records if not r.good)
    after = f" without the finding, {MV_PER_V * left:.1f} mV with it" if named else ""
    reason = (
        f"the error on unseen data of {others} is {MV_PER_V * before:.1f} mV beyond the noise{after}; it is "
        f"{MV_PER_V * allowed_error.good_v:.1f} mV on the good records"
    )
    if left > allowed:
        reason += (
            f", and chance makes it at most {MV_PER_V * allowed:.1f} mV: a part of the difference is not "
            "explained"
        )
        if not named:
            margin = float(np.log(left / allowed))
        return Verdict("unknown", named, groups, 0.0, left, allowed, reason, max(margin, 0.0))
    return Verdict("found" if named else "none", named, groups, 0.0, left, allowed, reason, margin)


def error_beyond_noise_v(path: Path, one: FittedHypothesis, rows: BoolArray) -> float:
    """RMS error of a hypothesis beyond noise, V, on `rows` (n,) of left-out blocks."""
    return beyond_noise(rms(held_out_residual(path.blocks, one)[rows]), rms(path.problem.white_v[rows]))


def _relative_sd(problem: InverseProblem, good: BoolArray) -> float:
    """Relative standard deviation of the difference between the RMS errors of the two kinds of record: an RMS of N
    independent samples has a relative standard deviation of one over the root of 2 N."""
    many = [float(problem.independent[rows].sum()) for rows in (good, ~good)]
    return float(np.sqrt(sum(0.5 / n for n in many)))
