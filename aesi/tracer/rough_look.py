"""A rough look, where the residual is large and nothing explains it to what a model may miss.

A residual's memory says how its samples repeat one another as long as sensors make it. Where a model errs by many
millivolts whatever is added to it, the memory is the model's own, and what errs slowly would be forgiven for the sake
of what is quick. So single effects compete once more by plain least squares, at the weight of what the best hypothesis
of the first search leaves: is there one that alone takes up most of what there is?
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from aesi.tracer.calibrate import MODEL_ERROR_V
from aesi.tracer.problem import Problem
from aesi.tracer.search import EVIDENCE_NATS, Scored, Search
from aesi.tracer.verdict import GROUP_SIZE, LOOK_ALIKE_NATS, Verdict, beyond

FAR_OFF = 3.0
"""Times the error of a calibrated model, that the best hypothesis has to leave for a rough look to be due."""
MOST_SHARE = 0.8
"""Of the structured variance, that an effect has to take up alone."""


@dataclass(frozen=True, eq=False)
class Rough:
    """The effect that takes up most of the residual alone, the bare model, and what explains it as well."""

    base: Scored
    best: Scored
    group: tuple[str, ...]


def error_left_v(search: Search) -> float:
    """The least that any hypothesis of a search leaves beyond noise, V: seen or unseen, whichever is more."""
    return min(
        max(beyond(s.fit.rmse_v, search.noise_v), beyond(s.held_out_rmse_v, search.noise_v))
        for s in search.scored.values()
        if s is not None
    )


def is_due(search: Search) -> bool:
    """True where even the best hypothesis leaves far more than a calibrated model does."""
    return error_left_v(search) > FAR_OFF * MODEL_ERROR_V


def weighed(search: Search) -> Problem:
    """The same case for plain least squares, at the error that is left anyway."""
    return replace(search.problem, model_error_v=error_left_v(search))


def most_of_it(search: Search) -> Rough | None:
    """The one effect that takes up most of the residual, clearly ahead of all but a few look-alikes; else None.

    search : on `weighed`.  A rival that ends on a bound counts as one that says as much, but cannot be named.
    """
    base = search.fit(())
    if base is None:
        return None
    rivals = [s for s in search.grow(base) if s.evidence - base.evidence >= EVIDENCE_NATS]
    best = max(rivals, key=lambda s: s.evidence, default=None)
    if best is None or not search.admit(base, best).admitted:
        return None
    if best.structured_v**2 > (1.0 - MOST_SHARE) * base.structured_v**2:
        return None
    alike = sorted(
        (s for s in rivals if best.evidence - s.evidence < LOOK_ALIKE_NATS), key=lambda s: -s.evidence
    )
    if len(alike) > GROUP_SIZE or any(s.fit.at_bounds for s in alike):
        return None
    return Rough(base, best, tuple(s.hypothesis[0] for s in alike))


def named(verdict: Verdict, rough: Rough) -> Verdict:
    """The verdict `unknown` with the effect that takes up most of the residual named beside it."""
    share = 1.0 - (rough.best.structured_v / rough.base.structured_v) ** 2
    name = rough.best.hypothesis[0]
    reason = (
        f"{verdict.reason}; {name} alone takes up {100 * share:.0f} % of the structured variance and leaves "
        f"{1e3 * rough.best.structured_v:.2f} mV"
    )
    groups = (rough.group,) if len(rough.group) > 1 else ()
    return replace(verdict, effects=(name,), groups=groups, reason=reason)
