"""Effects grown on the hypotheses kept so far: which are worth it, side by side in threads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from aesi.numerics.threads import side_by_side
from aesi.numerics.typing import Array
from aesi.tracer.case.problem import MEASURED_CELL, InverseProblem
from aesi.tracer.likelihood.growth import EffectGrowth, Grown, Parent, promise
from aesi.tracer.likelihood.model_error import PRIORS, Size, replace_fast
from aesi.tracer.search.archive import Archive, fit_name

PROMISING = 9
"""Effects that are grown on a hypothesis with effects: those that say most to first order. A convention that saves
time: of these, `FINALISTS` are fitted, so that three more than are needed are looked at. With 5 the seven cases of
`ALIKE_NATS` get the same answers."""


def promising(parent: Parent, slopes: Mapping[str, Array]) -> list[str]:
    """Effects to grow on a parent: all on the bare model, later those that say most with the slopes that they had."""
    names = [
        name
        for name in parent.problem.competing()
        if name not in parent.fit.hypothesis and _has_something_to_say(parent.problem, name)
    ]
    if not slopes:
        return names
    size = parent.fit.score.size
    said = {name: promise(parent, slopes[name], size) for name in names if name in slopes}
    ranked = sorted(said, key=lambda name: -said[name])[:PROMISING]
    return [name for name in names if name in ranked]


def _has_something_to_say(problem: InverseProblem, name: str) -> bool:
    """Not what infers a quantity that every record holds, nor what a file has right that was fitted to this very
    cell, nor, where good records stand beside the others, what all records of a cell share."""
    effect = problem.effects[name]
    if effect.infers is not None and all(r.data.temperature_degc is not None for r in problem.records):
        return False
    if problem.has_good and effect.of_every_record:
        return False
    return not (problem.trust in MEASURED_CELL and effect.of_design)


def growths_on(
    parents: Iterable[Parent], slopes: Mapping[str, Array], archive: Archive
) -> list[EffectGrowth]:
    """All that is worth growing on these parents."""
    return [_growth(parent, name, archive) for parent in parents for name in promising(parent, slopes)]


def _growth(parent: Parent, name: str, archive: Archive) -> EffectGrowth:
    key, size = _key(parent, name), len(parent.problem.effects[name].parameters)
    return EffectGrowth(parent, name, _growth_size(parent), archive.get(key, size), archive.near(key, size))


def ended(growths: Sequence[EffectGrowth], archive: Archive) -> Iterable[Grown | None]:
    """Where they end, in the order given."""

    def one(growth: EffectGrowth) -> Grown | None:
        found = growth.ended()
        if found is not None:
            archive.put(_key(growth.parent, growth.effect), found.u)
        return found

    return side_by_side(one, growths)


def _key(parent: Parent, name: str) -> str:
    """Of a growth in the archive."""
    kind = "grown as declared" if parent.fit.as_declared else "grown"
    return fit_name(parent.problem, kind, (*parent.fit.hypothesis, name))


def _growth_size(parent: Parent) -> Size:
    """Size of the model error at which the parameters of an effect are fitted: what a right hypothesis leaves. With all
    own parameters open that is less than files leave, and unknown: half of what the parent leaves, since at the size
    that the parent needs no effect has to move. Of what is gone within seconds it is all that the parent leaves: a lag
    of 2 s grew to 0.8 s with 3 mV and to 2.2 s with 24.

    On the NMC cell (C/20, C/2, 1C and 4,000 s of its drive fitted) particles of several sizes ended as particles of
    one with 9 mV, and say 10 nats with 4.5.
    """
    prior = PRIORS[parent.problem.trust]
    open_wide = parent.problem.trust == "loose"
    if open_wide:
        return prior.nearest(Size(0.5 * parent.fit.score.delta_v))
    return prior.nearest(replace_fast(prior.median, parent.fit.score.size))
