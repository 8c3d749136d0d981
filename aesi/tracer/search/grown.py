"""Effects grown on the hypotheses kept so far: which are worth it, side by side in threads."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

from aesi.numerics.typing import Array
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.growth import Grown, Parent, grow, promise
from aesi.tracer.likelihood.model_error import PRIORS
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
    size = parent.fit.score.delta_v
    said = {name: promise(parent, slopes[name], size) for name in names if name in slopes}
    ranked = sorted(said, key=lambda name: -said[name])[:PROMISING]
    return [name for name in names if name in ranked]


def _has_something_to_say(problem: InverseProblem, name: str) -> bool:
    """Not what infers a quantity that every record holds, nor what a file has right that was fitted to this very
    cell."""
    effect = problem.effects[name]
    if effect.infers is not None and all(r.data.temperature_degc is not None for r in problem.records):
        return False
    return not (problem.trust == "measured" and effect.of_design)


def side_by_side(wanted: Sequence[tuple[Parent, str]], archive: Archive) -> Iterable[Grown | None]:
    """Growths in threads, since simulations do not hold the interpreter's lock; in the order asked for, so that the
    outcome does not depend on how many threads there are."""

    def one(parent: Parent, name: str) -> Grown | None:
        kind = "grown as declared" if parent.fit.as_declared else "grown"
        key = fit_name(parent.problem, kind, (*parent.fit.hypothesis, name))
        size = len(parent.problem.effects[name].parameters)
        found = grow(parent, name, _growth_size(parent), archive.get(key, size), archive.near(key, size))
        if found is not None:
            archive.put(key, found.u)
        return found

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = [pool.submit(one, parent, name) for parent, name in wanted]
        try:
            for future in futures:
                yield future.result()
        finally:
            for future in futures:
                future.cancel()


def _growth_size(parent: Parent) -> float:
    """Size of the model error at which the parameters of an effect are fitted: what a right hypothesis leaves."""
    prior = PRIORS[parent.problem.trust]
    return prior.nearest(prior.median_v)
