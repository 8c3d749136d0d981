"""The ranking of what was tried: one row an effect, at its best among the hypotheses that hold it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from aesi.tracer.fit import Fit
from aesi.tracer.search import Scored, Search
from aesi.tracer.verdict import Verdict


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Candidate:
    """One effect as it competed.

    score : nats of evidence over the empty hypothesis (not above nought where it explains nothing unseen).
    hypothesis : the effects beside which it did best.
    """

    effect: str
    kind: str
    score: float
    test_rmse_v: float
    parameters: Mapping[str, Estimate]
    hypothesis: tuple[str, ...]
    remark: str


def ranking(
    search: Search,
    steps: Sequence[Scored],
    verdict: Verdict,
    test_rmse: Callable[[Fit], float],
    moved: Mapping[str, float],
) -> tuple[Candidate, ...]:
    """Rows for every effect that could be fitted, best first.

    An effect of the verdict is shown as it stands in the chosen hypothesis, another one alone or beside the
    chosen.  moved : parameters that every hypothesis had free and that mattered, with the nats that they bring.
    """
    base, chosen = steps[0], steps[-1]
    sizes = {1, max(len(chosen.hypothesis), 1)}
    kinds = search.problem.effects
    rows = [
        Candidate(
            name,
            str(kinds[name].kind),
            nats,
            test_rmse(chosen.fit),
            estimates(chosen.fit, name),
            (),
            "recalibrated in every hypothesis",
        )
        for name, nats in moved.items()
    ]
    for effect in search.problem.competing:
        held = [
            s
            for s in search.scored.values()
            if s is not None and effect in s.hypothesis and len(s.hypothesis) in sizes
        ]
        if not held:
            continue
        best = chosen if effect in verdict.effects else max(held, key=lambda s: _score(s, base))
        rows.append(_row(search, base, best, effect, verdict, test_rmse))
    return tuple(sorted(rows, key=lambda row: -row.score))


def _score(scored: Scored, base: Scored) -> float:
    gain = scored.evidence - base.evidence
    return gain if scored.held_out_rmse_v < base.held_out_rmse_v else min(gain, 0.0)


def _row(
    search: Search,
    base: Scored,
    scored: Scored,
    effect: str,
    verdict: Verdict,
    test_rmse: Callable[[Fit], float],
) -> Candidate:
    parent = search.without(scored, effect)
    admission = None if parent is None else search.admit(parent, scored)
    return Candidate(
        effect=effect,
        kind=str(search.problem.effects[effect].kind),
        score=_score(scored, base),
        test_rmse_v=test_rmse(scored.fit),
        parameters=estimates(scored.fit, effect),
        hypothesis=scored.hypothesis,
        remark="in the verdict" if effect in verdict.effects else admission.reason if admission else "",
    )


def estimates(fit: Fit, effect: str) -> dict[str, Estimate]:
    """The parameters of one effect of a fit."""
    out = {}
    for index, knob in enumerate(fit.knobs):
        if knob.owner == effect:
            low, high = fit.interval(index)
            out[knob.name] = Estimate(knob.to_value(float(fit.x[index])), low, high, knob.unit)
    return out
