"""The ranking of the effects that were tried: one row per effect, from its best hypothesis."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aesi.tracer.decide.verdict import Verdict
from aesi.tracer.likelihood.credible import interval_distances
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.gaussian import Linearised, Posterior, block_sums
from aesi.tracer.likelihood.growth import Explanation, Grown
from aesi.tracer.likelihood.model_error import whitened
from aesi.tracer.search.path import Path
from aesi.tracer.search.plausible import plausibility

SHARE = 0.9
"""Share of the posterior density of a parameter that its interval covers."""
DIGITS = 6
"""Decimals to which scores (nats) are rounded for the ranking. Fits amplify the round-off of a simulation, 4e-15 V: it
moved scores of four discoveries by 1e-10 to 7e-8 nats, and scores near zero by 1e-14."""


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 90 % credible interval, in `unit`."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class CandidateEffect:
    """One effect in the ranking, in its best hypothesis.

    score : gain of that hypothesis on unseen data over the one without effects, nats.  test_rmse_v : its RMSE on the
    test part, V; None without one, or where it cannot be simulated there.  parameters : name -> estimate.
    hypothesis : ids of all its effects.  remark : "in the verdict", or why the hypothesis was not chosen.
    """

    effect: str
    kind: str
    score: float
    test_rmse_v: float | None
    parameters: Mapping[str, Estimate]
    hypothesis: tuple[str, ...]
    remark: str


def ranking(
    path: Path, verdict: Verdict, test_rmse_v: Callable[[Explanation], float | None]
) -> tuple[CandidateEffect, ...]:
    """A row for every effect that could be simulated: those of the verdict, then the others, each best first.

    An effect of the verdict is shown in the chosen hypothesis, any other in its best one, all with their gains in the
    search: scores at one trust do not compare with those at another, at which the chosen one may have been refitted.
    """
    chosen, search = path.chosen, path.search or path
    tried, rows = search.explanations(), []
    for effect in path.problem.effects.values():
        held = [e for e in tried if effect.id in e.hypothesis]
        if not held:
            continue
        is_chosen = effect.id in chosen.hypothesis
        where, best = (path, chosen) if is_chosen else (search, max(held, key=lambda e: e.score.total))
        named = effect.id in verdict.effects
        remark = "in the verdict" if named else why_not_chosen(where, best)
        rows.append(
            CandidateEffect(
                effect.id,
                str(effect.kind),
                search.gain(search.chosen if is_chosen else best),
                test_rmse_v(best),
                estimates(where, best, effect.id),
                best.hypothesis,
                remark,
            )
        )
    return tuple(sorted(best_first(rows), key=lambda row: row.effect not in verdict.effects))


def best_first(rows: Sequence[CandidateEffect]) -> tuple[CandidateEffect, ...]:
    """The rows by score, highest first; equal ones stay in the order given."""
    return tuple(sorted(rows, key=lambda row: -round(row.score, DIGITS)))


def why_not_chosen(path: Path, one: Explanation) -> str:
    """Why a hypothesis was not chosen, a clause."""
    rest = path.chosen.score.total
    if isinstance(one, FittedHypothesis) and one.at_bounds:
        return f"ends on a bound: {', '.join(one.at_bounds)}"
    if set(one.hypothesis) == set(path.chosen.hypothesis):
        return "the choice of the search, with which too much is left unexplained"
    gained = one.score.total - rest
    chosen = "the chosen hypothesis" if path.chosen.hypothesis else "the model without effects"
    higher = "higher" if gained > 0.0 else "lower"
    remark = f"scores {abs(gained):.1f} nats {higher} on unseen data than {chosen}"
    return f"{remark}, {_deciding_rule(path, one)}" if gained > 0.0 else remark


def _deciding_rule(path: Path, better: Explanation) -> str:
    """The rule by which a hypothesis with a higher score on unseen data was not chosen, a clause."""
    if not isinstance(better, FittedHypothesis):
        return "but only linearised: it was not among the best, which were fitted with the nonlinear model"
    chosen, competing = path.chosen, len(path.problem.competing())
    gained = better.score.total - chosen.score.total
    if set(chosen.hypothesis) < set(better.hypothesis) and gained <= path.admission_nats:
        return f"but not by more than the {path.admission_nats:.1f} nats that chance may give one more effect"
    less = plausibility(chosen, competing) - plausibility(better, competing)
    if less > 0.0:
        return f"but {less:.1f} nats lower in marginal likelihood, which has a penalty for each effect"
    return "but the search, which adds or exchanges one effect at a time, did not admit or did not reach it"


def estimates(path: Path, one: Explanation, effect: str) -> dict[str, Estimate]:
    """Name -> estimate, for the parameters of one effect of a hypothesis. The 90 % interval is symmetric for a
    parameter inside its bounds, and begins at the bound for one that the data push onto it."""
    known = path.problem.parameters_of(effect)
    reach, placed, out = _reach(path, one), one.values_by_key, {}
    for free in known:
        if free.key not in placed:  # keeps its value in the parent
            out[free.name] = estimates(path, _parent(path, one), effect)[free.name]
            continue
        x, (below, above) = free.coordinate(placed[free.key]), reach[free.key]
        value, low, high = map(
            free.reported, (placed[free.key], free.value(x - below), free.value(x + above))
        )
        out[free.name] = Estimate(value, low, high, free.unit)
    return out


def _parent(path: Path, one: Explanation) -> FittedHypothesis:
    """The hypothesis that another one grew from."""
    steps = (step for step in path.steps if any(grown is one for grown in step.grown))
    return next(fit for step in steps for fit in step.parents if fit.hypothesis == one.hypothesis[:-1])


def _reach(path: Path, one: Explanation) -> dict[tuple[str, str], tuple[float, float]]:
    """(owner, name) -> (distance to the lower end, to the upper end) of the interval, in prior standard deviations."""
    point, keys = one.point, [free.key for free in one.free]
    if isinstance(one, Grown):  # a score leaves out what a descent left on a bound
        added = path.problem.parameters_of(one.hypothesis[-1])
        further = [j for j, free in enumerate(added) if free.key in one.on_bounds]
        keys += [added[j].key for j in further]
        point = Linearised(
            np.append(point.x, one.u[further]),
            point.residual_v,
            np.column_stack([point.jacobian_v, one.slopes_v[:, further]]),
            np.vstack([point.bounds, np.array([added[j].bounds for j in further]).reshape(-1, 2)]),
            point.fast_errors_v,
        )
    white, log_det = whitened(path.problem, path.blocks, point.table(), one.score.size)
    posterior = Posterior(block_sums(path.blocks, white, log_det), point.padded_x, ())
    ends = interval_distances(posterior, point.padded_bounds, SHARE)[: len(keys)]
    return {key: (float(below), float(above)) for key, (below, above) in zip(keys, ends, strict=True)}
