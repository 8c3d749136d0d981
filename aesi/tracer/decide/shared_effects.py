"""Effects that the good records show too: they are no difference from the others, however much they explain.

An effect on the other records alone takes up half of what all records share: a contact resistance that the file lacks
looks like one that has increased. A found effect is therefore compared with the same effect in all records. Where that
says more of unseen data, by more than `ALIKE_NATS`, the good records have shown the effect, and it is opened in all
records like a declared parameter; then the search for differences is repeated. Good records that cannot show it (a lag,
under constant current) are taken to be what they were declared to be.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from aesi.parameters import Parameter, Spread
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.trust import own_sd
from aesi.tracer.search.archive import Archive, context_of
from aesi.tracer.search.forward import forward_search
from aesi.tracer.search.hypothesis_fits import base_of
from aesi.tracer.search.path import Path, Report
from aesi.tracer.search.plausible import ALIKE_NATS


@dataclass(frozen=True, eq=False)
class Unshared:
    """A search for effects on the other records alone, with shared effects opened in all records.

    archive : of that search.  shared : sentences on the effects that all records may share.
    """

    path: Path
    archive: Archive
    shared: tuple[str, ...] = ()


def searched_unshared(problem: InverseProblem, most: int, archive: Archive, report: Report) -> Unshared:
    """The search, repeated with the found effect open in all records for as long as the good ones show it, too.

    most : effects that may be named, 0 or 1.  Raises DataError where the model cannot be simulated on the records.
    """
    found, opened = Unshared(forward_search(problem, most, archive, report), archive), set[str]()
    while found.path.chosen.hypothesis and not opened.issuperset(found.path.chosen.hypothesis):
        (name,) = found.path.chosen.hypothesis
        opened.add(name)
        found = _with_shared(found, name, most, report)
    return found


def _with_shared(found: Unshared, name: str, most: int, report: Report) -> Unshared:
    """The search with an effect open in all records; the one that found it where the good records do not show it."""
    alone, problem = found.path.chosen, in_all_records(found.path.problem, name)
    archive = Archive(found.archive.path, context_of(problem))
    base = base_of(problem, found.path.blocks, archive)
    if base is None:
        return found
    report(problem, base, base.score.total - alone.score.total)
    shared, named = base.score.total - found.path.base.score.total, found.path.gain(alone)
    told = (
        f"{name} gains {shared:.1f} nats on unseen data if it acts in all records, and {named:.1f} if only in those "
        "that are compared with the good ones: "
    )
    if shared < named - ALIKE_NATS:
        return found
    if shared <= named + ALIKE_NATS:
        told += "the good ones do not tell whether they have it, too, and are taken to be good."
        return replace(found, shared=(*found.shared, told))
    told += (
        "it is taken as common to all, and the verdict is on what these have beyond it; leave out --good to ask what "
        "the file lacks."
    )
    path = forward_search(problem, most, archive, report)
    return Unshared(path, archive, (*found.shared, told))


def in_all_records(problem: InverseProblem, name: str) -> InverseProblem:
    """The problem with an effect open in all records, with the priors that it has as an effect under test.

    A parameter that moves the voltage by its square alone cannot leave zero in this way, so that its effect remains a
    difference between records.
    """
    effect = problem.effects[name]
    tried = {one.name: one.sd for one in problem.parameters_of(name)}

    def opened(key: str, p: Parameter) -> Parameter:
        unit = replace(p, spread=Spread(1.0, 1.0, ""))
        share = own_sd(problem.trust, effect, unit, problem.cell.nominal_capacity_ah)
        assert share is not None  # it has a spread
        per_ah = problem.cell.nominal_capacity_ah**p.capacity_power
        spread = Spread(tried[key] / share, tried[key] / per_ah, "as far as it may go where it is tried")
        return replace(p, spread=spread)

    wide = replace(effect, parameters={key: opened(key, p) for key, p in effect.parameters.items()})
    return replace(problem, effects={**problem.effects, name: wide})
