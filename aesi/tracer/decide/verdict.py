"""The verdict (found, none or unknown): a pure function of the finished searches.

Thresholds are in one place, `Thresholds`, each with the command that measured it, and are passed in by the caller.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.typing import Array
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import LinearForm, held_out_residual, prediction_sd_v
from aesi.tracer.likelihood.growth import Explanation
from aesi.tracer.likelihood.model_error import PRIORS
from aesi.tracer.search.path import Path, unseen_rmse_v
from aesi.tracer.search.plausible import ALIKE_NATS, ALIKE_SDS, alike, score_lag, sds_behind

Word = Literal["found", "none", "unknown"]
GROUP_SIZE = 3
"""Most names in a group of look-alikes as shown; a note lists the others."""
MOST_SDS = 50.0
"""Margin, standard deviations, where no rival comes close."""
RANGE_OF = {"rate": "current", "charge": "charge"}
"""Partition -> the quantity whose ranges it leaves out in turn, in words."""
PREDICTED_SHARE = 0.5
"""Least share of the rows of left-out conditions that a fit to the other rows has to predict. A convention;
`Thresholds` and `decide.model_to_write.Option` have measured values on either side of it."""


@dataclass(frozen=True)
class Thresholds:
    """The thresholds of a verdict.

    noise_share, solver_v : error that a right hypothesis may leave on unseen data beyond the noise: this share of the
    noise (which is itself an estimate) and this voltage (V), added as squares. The share is a convention: 0.45 of the
    noise raises an error by a tenth of the noise. On development cases right hypotheses left at most 0.4 mV.
    alike_sds, alike_nats : hypotheses that lag by fewer standard deviations of the paired block differences, or by
    fewer nats, are look-alikes.
    predicted_share : least share of the rows that a hypothesis has to predict where ranges of the current, or of
    charge, are left out; one of the two suffices. 31 right hypotheses predicted 69 to 98 % on development cases of
    `aesi bench blind`; fits of a smooth discharge of a measured cell to its noise (the NMC cell's at 1C and C/20, cut
    at 50 to 85 %) 9 to 12 %.
    """

    noise_share: float = 0.45
    solver_v: float = 4e-4
    alike_sds: float = ALIKE_SDS
    alike_nats: float = ALIKE_NATS
    predicted_share: float = PREDICTED_SHARE


@dataclass(frozen=True)
class Verdict:
    """The answer of a discovery.

    word : "found", "none" or "unknown".  effects : ids of the named effects, in the order in which they were added.
    confidence_sets : for each of `effects` that has look-alikes, itself and the effects that the data do not tell from
    it, best first.  confidence : frequency with which such a verdict is right, 0 to 1.
    structured_v, tolerance_v : error beyond noise on unseen data, and the largest that a right answer may leave, V RMS.
    reason : a clause with these figures.
    margin : input of the confidence map, see `decide.confidence`. With names: standard deviations by which the closest
    rival lags, or of the weakest name's gain, whichever are fewer. `none`: minus the largest gain of an effect, nats.
    `unknown` without names: ln(structured_v / tolerance_v), or 0 where too few rows were predicted.
    aged : effects that explain more than the named ones if the good records are of another age than the others.
    """

    word: Word
    effects: tuple[str, ...]
    confidence_sets: tuple[tuple[str, ...], ...]
    confidence: float
    structured_v: float
    tolerance_v: float
    reason: str
    margin: float = 0.0
    aged: tuple[str, ...] = ()

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """The look-alikes that are shown: the first `GROUP_SIZE` of each confidence set."""
        return tuple(one[:GROUP_SIZE] for one in self.confidence_sets)

    @property
    def look_alike_notes(self) -> tuple[str, ...]:
        """A sentence for each confidence set that has more members than are shown."""
        return tuple(
            f"the data do not distinguish {one[0]} from {', '.join(one[1:])}: these {len(one)} effects explain them "
            f"about equally well, and the first {GROUP_SIZE} are shown as look-alikes."
            for one in self.confidence_sets
            if len(one) > GROUP_SIZE
        )


def beyond_noise(rmse_v: float, noise_v: float) -> float:
    """Error beyond white noise, V RMS: root of the difference of the mean squares, at least 0."""
    return float(np.sqrt(max(rmse_v**2 - noise_v**2, 0.0)))


def structured_v(path: Path, one: Explanation) -> float:
    """Error of a hypothesis beyond noise on left-out blocks, V RMS."""
    return beyond_noise(unseen_rmse_v(path.blocks, one), path.problem.noise_v)


def unexplained_v(problem: InverseProblem, blocks: Blocks, one: Explanation, allowed_v: float) -> float:
    """`structured_v`, V, with each row of a left-out block weighted by how well a right hypothesis could predict it.

    A row counts in full where its prediction, with the parameters fitted to the other blocks, is far less uncertain
    than the noise and `allowed_v`, and little where it is far more uncertain: a potential with nine coefficients cannot
    be known where no other block has been.

    The noise is still subtracted in full: with w = s**2/(s**2 + sd**2) and s**2 = noise**2 + allowed**2 a right
    hypothesis has E[r**2] = s**2 + sd**2, so that E[w r**2] = s**2 whatever sd is, and `allowed_v` is left.

    allowed_v : V beyond the noise that a right hypothesis may leave.
    """
    usual = PRIORS[problem.trust].median
    counts = prediction_weight(problem.white_v, prediction_sd_v(problem, blocks, one, usual), allowed_v)
    square = float(np.mean(counts * held_out_residual(blocks, one) ** 2))
    return beyond_noise(float(np.sqrt(square)), problem.noise_v)


def prediction_weight(white_v: Array | float, sd_v: Array, allowed_v: float) -> Array:
    """(n,) weight of each row by how well it is predicted: 1 for a certain prediction, towards 0 for an uncertain one.

    sd_v : (n,) V, standard deviation of the prediction.  white_v : V, noise.  allowed_v : as for `unexplained_v`.
    """
    allowed_v2 = white_v**2 + allowed_v**2
    return np.asarray(allowed_v2 / (allowed_v2 + sd_v**2))


def predicted_share(
    problem: InverseProblem, blocks: Blocks, one: LinearForm, allowed_v: float, partition: str
) -> float:
    """Share of the rows that a hypothesis predicts, 0 to 1, where the conditions of a partition are left out in turn:
    the mean of `prediction_weight`.

    The other rows are predicted with so much uncertainty that no measured value would contradict the hypothesis. The
    parameters are as uncertain as a model error of `allowed_v` (V) leaves them: with a model without error, a smooth
    discharge predicts all of its ranges of charge, and with one that may be off by 0.4 mV hardly any.
    partition : "rate" or "charge", a key of `blocks.folds`.
    """
    most = PRIORS[problem.trust].median._replace(delta_v=allowed_v)
    sd_v = prediction_sd_v(problem, blocks, one, most, partition)
    return float(np.mean(prediction_weight(problem.white_v, sd_v, allowed_v)))


def tolerance_v(problem: InverseProblem, thresholds: Thresholds) -> float:
    """Largest error that a right hypothesis may leave on unseen data beyond the noise, V RMS."""
    return float(np.hypot(thresholds.noise_share * problem.noise_v, thresholds.solver_v))


def verdict_on(path: Path, thresholds: Thresholds) -> Verdict:
    """The verdict on a search at the trust `tight` or `exact`.

    Its confidence is 0 until `evidence.with_confidence` sets it from the margin.
    """
    allowed = tolerance_v(path.problem, thresholds)
    left = unexplained_v(path.problem, path.blocks, path.chosen, allowed)
    if left > allowed:
        margin = float(np.log(left / allowed))
        reason = (
            f"the error on unseen data is {MV_PER_V * left:.2f} mV beyond the noise, {_tried_words(path)} (a right "
            f"model leaves at most {MV_PER_V * allowed:.2f} mV)"
        )
        return Verdict("unknown", (), (), 0.0, left, allowed, reason, margin)
    if not path.chosen.hypothesis:
        words = explained_words(path, left, allowed)
        return Verdict("none", (), (), 0.0, left, allowed, words, -best_gain(path))
    conditions = [name for name in ("rate", "charge") if name in path.blocks.folds]
    tested, by = max(
        (predicted_share(path.problem, path.blocks, path.chosen, allowed, name), name) for name in conditions
    )
    if tested < thresholds.predicted_share:
        reason = (
            f"{' + '.join(path.chosen.hypothesis)} fits the data to {MV_PER_V * left:.2f} mV beyond the noise, but "
            f"these data hardly test it: where a range of {RANGE_OF[by]} is left out of the fit, it predicts only "
            f"{100 * tested:.0f} % of the rows there; add a record with other currents"
        )
        return Verdict("unknown", (), (), 0.0, left, allowed, reason, 0.0)
    groups, margin = look_alikes(path, thresholds)
    words = explained_words(path, left, allowed)
    return Verdict("found", path.chosen.hypothesis, groups, 0.0, left, allowed, words, margin)


def explained_words(path: Path, left_v: float, allowed_v: float) -> str:
    """The reason of a verdict where the chosen hypothesis explains the data, a clause.

    left_v : `unexplained_v` of the chosen hypothesis.  allowed_v : the largest that a right one may leave, V RMS.
    """
    if not path.chosen.hypothesis:
        return (
            f"the error on unseen data is {MV_PER_V * left_v:.2f} mV beyond the noise, and a right model leaves at "
            f"most {MV_PER_V * allowed_v:.2f} mV"
        )
    before_v = structured_v(path, path.base)
    return (
        f"the error on unseen data is {MV_PER_V * before_v:.2f} mV beyond the noise without the finding, "
        f"{MV_PER_V * left_v:.2f} mV with it"
    )


def _tried_words(path: Path) -> str:
    """Clause on the effects behind an error that is left."""
    tried = path.beyond_reach_v is not None or any(step.grown or step.fitted for step in path.steps)
    return "whichever of the tried effects are added" if tried else "with no effect added"


def partly_explained(path: Path, verdict: Verdict, thresholds: Thresholds) -> Verdict:
    """The verdict `unknown`, with the names of effects whose gain exceeds the usual error of measured cells.

    path : the search at the trust `measured`.
    """
    before, left = structured_v(path, path.base), structured_v(path, path.chosen)
    groups, margin = look_alikes(path, thresholds)
    reason = (
        f"{' + '.join(path.chosen.hypothesis)} reduces the error on unseen data from {MV_PER_V * before:.1f} to "
        f"{MV_PER_V * left:.1f} mV beyond the noise, by more than the usual error of models of measured cells"
    )
    if left > verdict.tolerance_v:
        reason += "; no effect that was tried explains the rest"
    return replace(
        verdict,
        effects=path.chosen.hypothesis,
        confidence_sets=groups,
        margin=margin,
        structured_v=left,
        reason=reason,
    )


def best_gain(path: Path) -> float:
    """The largest gain of an effect at any step, admitted or not, nats; 0 where no effect could be grown."""
    return max((step.best_gain for step in path.steps if step.grown), default=0.0)


def look_alikes(path: Path, thresholds: Thresholds) -> tuple[tuple[tuple[str, ...], ...], float]:
    """(sets of effects that these data do not tell apart, margin as in `Verdict`).

    They are a model confidence set, Hansen, Lunde & Nason, Econometrica 79 (2011) 453, over paired block differences.
    """
    groups, margin = [], np.inf
    tried = {frozenset(e.hypothesis): e for e in path.explanations()}
    for name in path.chosen.hypothesis:
        same = []
        for anchor, other, added in _rivals(path, name, tried):
            without = tried.get(frozenset(anchor.hypothesis) - {name})
            if without is not None and other.score.total - without.score.total < path.admission_nats:
                continue
            nats, deviation = score_lag(anchor, other)
            if alike(anchor, other, thresholds.alike_sds, thresholds.alike_nats):
                same.append((nats, added))
            else:
                margin = min(margin, sds_behind(nats, deviation, thresholds.alike_nats))
        same.sort()
        if same:
            groups.append((name, *(other for _, other in same)))
    return tuple(groups), float(min(margin, _weakest_sds(path, tried), MOST_SDS))


def across_models(verdict: Verdict, other: Verdict) -> Verdict:
    """The verdict, with one more look-alike where the search with the other model of the cell names the same effects
    but one, and another effect in its place.

    Both searches explain the data to the noise. Each tells the two effects apart, but only by the approximations of its
    model.
    """
    instead = set(other.effects) - set(verdict.effects)
    same_count = len(other.effects) == len(verdict.effects)
    if verdict.word != "found" or other.word != "found" or not same_count or len(instead) != 1:
        return verdict
    (named,) = set(verdict.effects) - set(other.effects)
    sets = {one[0]: one for one in verdict.confidence_sets}
    sets[named] = tuple(dict.fromkeys((*sets.get(named, (named,)), *instead)))
    return replace(verdict, confidence_sets=tuple(sets[name] for name in verdict.effects if name in sets))


def _weakest_sds(path: Path, tried: Mapping[frozenset[str], Explanation]) -> float:
    """Smallest gain of a chosen effect over the hypothesis without it, in standard deviations."""
    chosen = frozenset(path.chosen.hypothesis)
    rests = (tried.get(chosen - {name}) for name in chosen)
    gains = [path.chosen.score.total - rest.score.total for rest in rests if rest is not None]
    return float(np.sqrt(2.0 * max(min(gains), 0.0))) if gains else MOST_SDS


def _rivals(
    path: Path, name: str, tried: Mapping[frozenset[str], Explanation]
) -> Iterator[tuple[Explanation, Explanation, str]]:
    """(hypothesis to compare with, rival, its other effect): a rival has another effect in place of the chosen `name`.

    The rival has all other chosen effects or, where that was not tried, those chosen before `name` was admitted.
    """
    named: set[str] = set()
    admitted = (
        s.admitted for s in path.steps if s.admitted is not None and s.admitted.hypothesis[-1] == name
    )
    for anchor in (path.chosen, *admitted):
        rest = frozenset(anchor.hypothesis) - {name}
        for hypothesis, other in tried.items():
            added = hypothesis - rest
            if rest < hypothesis and len(added) == 1 and name not in hypothesis and not added & named:
                named |= added
                yield anchor, other, next(iter(added))
