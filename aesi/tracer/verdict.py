"""Found, none or unknown: what a finished search allows one to say, and how sure one may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from aesi.tracer.search import EVIDENCE_NATS, POLARISATION_SHARE, Scored, Search, only_by_freedom

Word = Literal["found", "none", "unknown"]

NOISE_SHARE = 0.6
EXPLAINED_SHARE = 0.08
"""What may be left beyond white noise and still count as explained: this share of the noise, what solvers differ by,
and this share of what there was to explain, added as squares."""

UNSEEN_SHARE = 0.85
"""With effects added, at most this share of that may be left on data that the fit has not seen: combinations that only
just get there are as a rule the wrong ones."""

LOOK_ALIKE_NATS = 8.0
LOOK_ALIKE_SHARE = 0.2
GROUP_SIZE = 3
SUFFICIENT_SHARE = 0.6
"""With an unexplained rest, only effects that took up this share of the structured variance are named."""
CLEAR_NATS = 10.0
"""Beside `unknown`, an effect is named only this far ahead of every hypothesis without it and its look-alikes."""

TEMPERATURE = 4.0
"""Evidence is divided by this before it becomes a confidence: the noise model is itself a model."""

CONFIDENT = 0.5
"""Below this confidence in an effect, or in the group it stands for, it is not called found."""

TOLERATED_EFFECTS = ("reaction_nonuniformity", "numerical_error")
"""What the order reduction leaves out: a finding of its own, never a reason to doubt another one."""


@dataclass(frozen=True)
class Verdict:
    """What may be said.

    effects : ids in the order in which they were added.  groups : look-alikes, each group begins with a
    member of
    `effects`.  structured_v, tolerance_v : what is left beyond noise, and how much may be.
    """

    word: Word
    effects: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...]
    confidence: float
    structured_v: float
    tolerance_v: float
    reason: str


def tolerance_v(noise_v: float, polarisation_v: float, structured_before_v: float) -> float:
    """Root mean square beyond white noise that still counts as explained, V."""
    parts = (
        NOISE_SHARE * noise_v,
        POLARISATION_SHARE * polarisation_v,
        EXPLAINED_SHARE * structured_before_v,
    )
    return float(np.sqrt(sum(p**2 for p in parts)))


def judge(search: Search, steps: Sequence[Scored], noise_v: float, polarisation_v: float) -> Verdict:
    """The verdict on a finished search.

    noise_v : white noise of the sensors, V.  polarisation_v : RMS distance of the voltage from equilibrium,
    V.
    """
    base, chosen = steps[0], steps[-1]
    before, left = beyond(base.fit.rmse_v, noise_v), beyond(chosen.fit.rmse_v, noise_v)
    allowed = tolerance_v(noise_v, polarisation_v, before if len(chosen.hypothesis) else 0.0)
    if chosen.hypothesis:
        allowed *= UNSEEN_SHARE
        unseen_v = search.unseen_rmse_v(chosen, float(np.hypot(allowed, noise_v)))
        left = max(left, beyond(unseen_v, noise_v))
    if left > allowed:
        return _unknown(search, steps, before, left, allowed, noise_v)
    if not chosen.hypothesis:
        confidence = _sigmoid((EVIDENCE_NATS - _best_rival(search, base)) / TEMPERATURE)
        reason = (
            f"{1e3 * left:.2f} mV beyond the noise, {1e3 * allowed:.2f} mV are within what a model may miss"
        )
        return Verdict("none", (), (), confidence, left, allowed, reason)
    groups = look_alikes(search, chosen)
    confidence = _confidence(search, steps, groups, allowed)
    if confidence < CONFIDENT:
        return _undecided(search, chosen, before, left, allowed, noise_v, confidence)
    reason = f"{1e3 * before:.2f} mV beyond the noise before, {1e3 * left:.2f} mV after"
    return Verdict("found", chosen.hypothesis, groups, confidence, left, allowed, reason)


def beyond(rmse_v: float, noise_v: float) -> float:
    """Root mean square of what is left beyond white noise, V."""
    return float(np.sqrt(max(rmse_v**2 - noise_v**2, 0.0)))


def _unknown(
    search: Search, steps: Sequence[Scored], before: float, left: float, allowed: float, noise_v: float
) -> Verdict:
    named, groups = _partial(search, steps[-1], before, noise_v)
    reason = (
        f"{1e3 * left:.2f} mV of structured residual are left that no effect of the catalogue explains "
        f"({1e3 * allowed:.2f} mV would be within what a model may miss)"
    )
    confidence = _sigmoid(4.0 * float(np.log(left / allowed)))
    return Verdict("unknown", named, groups, confidence, left, allowed, reason)


def _undecided(
    search: Search,
    chosen: Scored,
    before: float,
    left: float,
    allowed: float,
    noise_v: float,
    confidence: float,
) -> Verdict:
    """Something is there and can be explained, but another explanation is at least as good."""
    named, groups = _partial(search, chosen, before, noise_v)
    reason = (
        f"{1e3 * before:.2f} mV beyond the noise are explained best by {' + '.join(chosen.hypothesis)}, but with "
        f"{100 * confidence:.0f} % confidence over what else explains them, and {100 * CONFIDENT:.0f} % are asked for"
    )
    return Verdict("unknown", named, groups, 1.0 - confidence, left, allowed, reason)


def _partial(
    search: Search, chosen: Scored, before: float, noise_v: float
) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """The effects that may be named beside `unknown`, with their look-alikes: clear ones that took up most of it."""
    twins = {g[0]: set(g) for g in look_alikes(search, chosen)}
    clear = tuple(n for n in chosen.hypothesis if _clear(search, chosen, twins.get(n, {n})))
    named = search.fit(clear) if clear else None
    if named is None or beyond(named.fit.rmse_v, noise_v) ** 2 > (1.0 - SUFFICIENT_SHARE) * before**2:
        return (), ()
    return clear, look_alikes(search, named)


def _clear(search: Search, chosen: Scored, group: set[str]) -> bool:
    """Is every hypothesis without any of the group far behind, on evidence and on unseen data?

    A rival on a bound counts: it, too, says that something else may be at work.
    """
    if any(bound.split(".")[0] in group for bound in chosen.fit.at_bounds):
        return False
    for other in search.scored.values():
        if other is None or group & set(other.hypothesis):
            continue
        if only_by_freedom(chosen, other, search.material_v):
            continue
        dearer = EVIDENCE_NATS * max(len(other.hypothesis) - len(chosen.hypothesis), 0)
        ahead = chosen.evidence - other.evidence + dearer
        if ahead < CLEAR_NATS or other.held_out_rmse_v <= chosen.held_out_rmse_v:
            return False
    return True


def look_alikes(search: Search, chosen: Scored) -> tuple[tuple[str, ...], ...]:
    """Groups of effects that these data cannot tell apart, at most three in a group."""
    groups = []
    for name in chosen.hypothesis:
        rest = frozenset(chosen.hypothesis) - {name}
        rivals = []
        for key, other in search.scored.items():
            if other is None or len(key) != len(chosen.hypothesis) or not rest < key or name in key:
                continue
            if _alike(search, chosen, other, rest):
                rivals.append((other.evidence, next(iter(key - rest))))
        rivals.sort(reverse=True)
        if rivals:
            groups.append((name, *(r for _, r in rivals[: GROUP_SIZE - 1])))
    return tuple(groups)


def _alike(search: Search, chosen: Scored, other: Scored, rest: frozenset[str]) -> bool:
    if other.fit.at_bounds or search.far_behind(other, chosen):
        return False
    parent = search.scored.get(rest)
    if parent is None:
        return False
    noise = search.noise_v
    worse = other.held_out_rmse_v**2 - chosen.held_out_rmse_v**2
    gain = parent.held_out_rmse_v**2 - chosen.held_out_rmse_v**2
    if worse > 0.5 * gain:
        return False
    close_in_evidence = chosen.evidence - other.evidence < LOOK_ALIKE_NATS
    close_in_voltage = worse < (LOOK_ALIKE_SHARE * noise) ** 2
    return close_in_evidence or close_in_voltage


def _best_rival(search: Search, base: Scored) -> float:
    """Evidence, beyond the base, of the best hypothesis that would also be material."""
    best = -np.inf
    for other in search.scored.values():
        if other is not None and other.hypothesis:
            gain = base.held_out_rmse_v**2 - other.held_out_rmse_v**2
            if gain > search.material_v**2:
                best = max(best, other.evidence - base.evidence)
    return best


def _confidence(
    search: Search, steps: Sequence[Scored], groups: tuple[tuple[str, ...], ...], allowed: float
) -> float:
    """How far the chosen hypothesis (with its look-alikes) is ahead of everything else, as a probability."""
    chosen = steps[-1]
    twins = {g[0]: set(g) for g in groups}
    lead = chosen.evidence - steps[0].evidence - EVIDENCE_NATS
    for other in search.scored.values():
        if other is None or other is chosen or _covered(chosen.hypothesis, other.hypothesis, twins):
            continue
        if only_by_freedom(chosen, other, search.material_v) or search.far_behind(other, chosen):
            continue
        dearer = EVIDENCE_NATS * max(len(other.hypothesis) - len(chosen.hypothesis), 0)
        ahead = chosen.evidence - other.evidence + dearer
        lead = min(lead, max(ahead, 0.0) if _doubtful(steps[0], other, allowed) else ahead)
    parent = search.without(chosen, chosen.hypothesis[-1])
    if parent is not None:
        admission = search.admit(parent, chosen)
        lead = min(lead, 10.0 * float(np.log(max(admission.over_placebo, 1.0))))
    return _sigmoid(lead / TEMPERATURE)


def _doubtful(base: Scored, other: Scored, allowed: float) -> bool:
    """A rival that ends on a bound, explains nothing unseen or leaves structure may cost certainty, but cannot win."""
    worse = other.held_out_rmse_v >= base.held_out_rmse_v
    return bool(other.fit.at_bounds) or worse or other.structured_v > allowed


def _covered(chosen: Sequence[str], other: Sequence[str], twins: dict[str, set[str]]) -> bool:
    """True where `other` is `chosen` up to look-alikes, perhaps with something more."""
    return all(any(o in twins.get(c, {c}) for o in other) for c in chosen)


def _sigmoid(x: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(x, -50.0, 50.0))))
