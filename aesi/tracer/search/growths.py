"""Growth of effects on the hypotheses kept so far: the choice of effects, and their descents in parallel threads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from aesi.numerics.threads import side_by_side
from aesi.numerics.typing import Array
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.trust import MEASURED_CELL
from aesi.tracer.likelihood.growth import EffectGrowth, Grown, Parent, expected_score
from aesi.tracer.likelihood.model_error import PRIORS, Size
from aesi.tracer.search.archive import Archive, fit_name

PROMISING = 12
"""Most hypotheses that are grown in a later step: those with the largest gains to first order. A convention that saves
time: of these, `FINALISTS` are fitted. On a blind development case (lost lithium beside a growing film) the right
second effect, which gains most when fitted, is among 12 and not among 9; with 18, this case and another one end as with
12."""


def growths_on(
    parents: Sequence[Parent], slopes: Mapping[str, Array], archive: Archive
) -> list[EffectGrowth]:
    """The growths that are worth a descent: every effect on the bare model; in later steps the `PROMISING` hypotheses
    with the largest expected scores, from any parent.

    slopes : effect -> (n, k) V, its sensitivities on an earlier parent; empty for the bare model.
    """
    best = parents[0]
    growths = {name: _growth(best, name, archive) for name in addable(best)}
    if not slopes:
        return list(growths.values())
    pairs = [(parent, name) for parent in parents for name in addable(parent)]
    if any(archive.get(_promise_key(*pair), 1) is None for pair in pairs):
        if archive.other_model is None and not best.fit.as_declared:
            slopes = {**slopes, **_first_slopes(growths)}
        _store_expected_gains(pairs, slopes, archive)
    promised = [
        (parent, name, parent.fit.score.total + float(gain[0]))
        for parent, name in pairs
        if (gain := archive.get(_promise_key(parent, name), 1)) is not None
    ]
    return [
        growths[name] if parent is best else _growth(parent, name, archive)
        for parent, name in most_promising(promised)
    ]


def _store_expected_gains(
    pairs: Sequence[tuple[Parent, str]], slopes: Mapping[str, Array], archive: Archive
) -> None:
    """Put into the archive the expected gain of each effect over its parent, nats: that with the other model of the
    cell, else that to first order by its sensitivities, (n, k) V; -inf without these."""
    for parent, name in pairs:
        gain = archive.near(_promise_key(parent, name), 1)
        if gain is None:
            score = expected_score(parent, slopes[name]) if name in slopes else -np.inf
            gain = np.array([score - parent.fit.score.total])
        archive.put(_promise_key(parent, name), gain)


def promising_first(
    growths: Sequence[EffectGrowth], archive: Archive
) -> tuple[list[EffectGrowth], dict[str, Array]]:
    """(growths to carry out, effect -> sensitivities (n, k) V of the others), from the growths on the bare model.

    The first are the `PROMISING` growths with the largest gain with the other model of the cell, or expected gain with
    this one. They are all growths, with no sensitivities, where the other model did not grow every effect.
    """
    near = [archive.near(_key(growth.parent, growth.effect, "said"), 1) for growth in growths]
    if any(gain is None for gain in near):
        return list(growths), {}
    slopes = _first_slopes({growth.effect: growth for growth in growths})

    def larger_gain(growth: EffectGrowth, with_other: Array) -> float:
        own = slopes.get(growth.effect)
        expected = (
            np.inf if own is None else expected_score(growth.parent, own) - growth.parent.fit.score.total
        )
        return max(float(with_other[0]), expected)

    ranked = sorted(
        (
            (larger_gain(growth, gain), growth)
            for growth, gain in zip(growths, near, strict=True)
            if gain is not None
        ),
        key=lambda one: -one[0],
    )
    kept = [growth for _, growth in ranked[:PROMISING]]
    rest = {growth.effect for _, growth in ranked[PROMISING:]}
    return kept, {name: own for name, own in slopes.items() if name in rest}


def _first_slopes(growths: Mapping[str, EffectGrowth]) -> dict[str, Array]:
    """Effect -> sensitivities (n, k) V at the start of its descent; without effects that cannot be simulated there.

    They predict the gain of an effect beside those found so far much better than the sensitivities at its end on the
    bare model, where it stood in for all that was missing."""
    found = side_by_side(EffectGrowth.first_slopes, growths.values())
    return {name: slopes for name, slopes in zip(growths, found, strict=True) if slopes is not None}


def most_promising(promised: Sequence[tuple[Parent, str, float]]) -> list[tuple[Parent, str]]:
    """The `PROMISING` pairs of parent and effect with the largest expected score (nats), each hypothesis once."""
    best: dict[frozenset[str], tuple[Parent, str]] = {}
    for parent, name, _ in sorted(promised, key=lambda one: -one[2]):
        best.setdefault(frozenset((*parent.fit.hypothesis, name)), (parent, name))
    return list(best.values())[:PROMISING]


def addable(parent: Parent) -> list[str]:
    """Ids of the effects that may be added to a hypothesis: those that it may name, does not name yet, and that the
    records can decide on."""
    return [
        name
        for name in parent.problem.competing()
        if name not in parent.fit.hypothesis and is_testable(parent.problem, name)
    ]


def grown_with(parent: Parent, names: Sequence[str], archive: Archive) -> list[Grown]:
    """The growths of these effects on a hypothesis, also of effects that do not compete; those that fail are left
    out."""
    growths = [_growth(parent, name, archive) for name in names]
    return [one for one in grow_all(growths, archive) if one is not None]


def is_testable(problem: InverseProblem, name: str) -> bool:
    """Whether these records can show an effect at all. They cannot show one that supplies a quantity which every record
    has measured (the temperature), one that restates design parameters of a file which was fitted to this very cell,
    and, beside known-good records, one that all records of a cell have in common."""
    effect = problem.effects[name]
    if effect.infers is not None and all(r.data.temperature_degc is not None for r in problem.records):
        return False
    if problem.has_good and (effect.of_every_record or effect.of_age):
        return False
    return not (problem.trust in MEASURED_CELL and effect.of_design)


def _growth(parent: Parent, name: str, archive: Archive) -> EffectGrowth:
    key, size = _key(parent, name), len(parent.problem.effects[name].parameters)
    return EffectGrowth(parent, name, _growth_size(parent), archive.get(key, size), archive.near(key, size))


def grow_all(growths: Sequence[EffectGrowth], archive: Archive) -> Iterable[Grown | None]:
    """Each growth carried out (`EffectGrowth.grow`) in parallel threads, in the order given; None where the effect
    cannot be simulated. Ends and gains are put into the archive."""

    def one(growth: EffectGrowth) -> Grown | None:
        found = growth.grow()
        if found is not None:
            archive.put(_key(growth.parent, growth.effect), found.u)
            gain = found.score.total - growth.parent.fit.score.total
            archive.put(_key(growth.parent, growth.effect, "said"), np.array([gain]))
        return found

    return side_by_side(one, growths)


def _promise_key(parent: Parent, name: str) -> str:
    return _key(parent, name, "promised")


def _key(parent: Parent, name: str, what: str = "grown") -> str:
    """Name in the archive: of the end of a growth ("grown"), of its expected gain ("promised") or of its gain
    ("said")."""
    kind = f"{what} as declared" if parent.fit.as_declared else what
    return fit_name(parent.problem, kind, (*parent.fit.hypothesis, name))


def _growth_size(parent: Parent) -> Size:
    """Size of the model error at which the parameters of an effect are fitted: that of a right hypothesis. With all own
    parameters open this size is unknown. It is then half of the parent's, since at the parent's own size no effect has
    to move. The part within seconds keeps the parent's size: a lag of 2 s grew to 0.8 s with 3 mV and to 2.2 s with 24.

    On the NMC cell (C/20, C/2, 1C and 4,000 s of its drive fitted) particles of several sizes ended as particles of
    one with 9 mV, and gain 10 nats with 4.5.
    """
    prior = PRIORS[parent.problem.trust]
    if parent.problem.trust == "loose":
        return prior.nearest(Size(0.5 * parent.fit.score.delta_v))
    return prior.nearest(prior.median._replace(fast_v=parent.fit.score.size.fast_v))
