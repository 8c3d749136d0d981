"""The ranking of what was tried: one row an effect, at its best among the hypotheses that hold it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from aesi.tracer.decide.verdict import Verdict
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.growth import Explanation
from aesi.tracer.search.path import Path
from aesi.tracer.search.wrong_parameters import NINETY


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 90 % interval."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class CandidateEffect:
    """One effect as it competed.

    score : nats that it says more of unseen data than the hypothesis without effects.
    hypothesis : the effects beside which it did best.
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
    """Rows for every effect that could be simulated, best first: one of the verdict as it stands in the chosen
    hypothesis, another one at its best alone or beside those chosen."""
    chosen = path.chosen
    rows = []
    for effect in path.problem.effects.values():
        held = [e for e in path.explanations() if effect.id in e.hypothesis]
        if not held:
            continue
        best = chosen if effect.id in chosen.hypothesis else max(held, key=lambda e: e.score.total)
        named = effect.id in verdict.effects
        remark = "in the verdict" if named else _remark(path, best)
        rows.append(
            CandidateEffect(
                effect.id,
                str(effect.kind),
                path.gain(best),
                test_rmse_v(best),
                estimates(best, effect.id),
                tuple(best.hypothesis),
                remark,
            )
        )
    return tuple(sorted(rows, key=lambda row: -row.score))


def _remark(path: Path, one: Explanation) -> str:
    rest = path.chosen.score.total
    if isinstance(one, FittedHypothesis) and one.at_bounds:
        return f"ends on a bound: {', '.join(one.at_bounds)}"
    gained = one.score.total - rest
    chosen = "what was chosen" if path.chosen.hypothesis else "the declared model"
    return f"{abs(gained):.1f} nats {'better' if gained > 0.0 else 'worse'} on unseen data than {chosen}"


def estimates(one: Explanation, effect: str) -> dict[str, Estimate]:
    """The parameters of one effect of a hypothesis."""
    out = {}
    placed = one.placed
    for index, free in enumerate(one.free):
        if free.owner == effect:
            x = free.coordinate(placed[free.key])
            reach = NINETY * float(one.score.covariance[index, index]) ** 0.5
            out[free.name] = Estimate(
                placed[free.key], free.value(x - reach), free.value(x + reach), free.unit
            )
    for (owner, name), value in placed.items():
        if owner == effect and name not in out:
            out[name] = Estimate(value, value, value, "")
    return out
