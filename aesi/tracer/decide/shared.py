"""What the good records have too: no difference between them and the others, however much of the others it explains.

Half of what all records share is taken up by an effect on the others alone, so that a contact that the file lacks reads
like one that has become worse. So what is found is held against the same effect in all records. Where that is believed
it is opened there, as a declared parameter is, and the others are asked once more for what they have beyond it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from aesi.parameters import Parameter, Spread
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.trust import own_sd
from aesi.tracer.search.archive import Archive, context_of
from aesi.tracer.search.fitted import base_of
from aesi.tracer.search.forward import searched
from aesi.tracer.search.path import Path, Report
from aesi.tracer.search.plausible import most_plausible


@dataclass(frozen=True, eq=False)
class Unshared:
    """A search for what some records have beside good ones, with all open that these share with them.

    archive : of that search.  shared : sentences on what was opened in all records.
    """

    path: Path
    archive: Archive
    shared: tuple[str, ...] = ()


def searched_unshared(problem: InverseProblem, most: int, archive: Archive, report: Report) -> Unshared:
    """Search, and search again with what was found open in all records, while that is believed instead.

    most : effects that may be named, at most one.  Raises DataError where the model cannot be simulated on the records.
    """
    found, opened = Unshared(searched(problem, most, archive, report), archive), set[str]()
    while found.path.chosen.hypothesis and not opened.issuperset(found.path.chosen.hypothesis):
        (name,) = found.path.chosen.hypothesis
        opened.add(name)
        again = _with_shared(found, name, most, report)
        if again is None:
            break
        found = again
    return found


def _with_shared(found: Unshared, name: str, most: int, report: Report) -> Unshared | None:
    """The search with an effect open in all records; None where that is not believed rather than what was found."""
    alone, problem = found.path.chosen, in_all_records(found.path.problem, name)
    archive = Archive(found.archive.path, context_of(problem))
    base = base_of(problem, found.path.blocks, archive)
    if base is None:
        return None
    report(problem, base, base.score.total - alone.score.total)
    if most_plausible([alone, base], len(problem.competing())) is alone:
        return None
    shared, named = base.score.total - found.path.base.score.total, found.path.gain(alone)
    told = (
        f"{name} in all records says {shared:.1f} nats more of unseen data than none, in those beside the good ones "
        f"alone {named:.1f}: it is taken as what all share, and what is told is what the others have beyond that; "
        "leave out --good to ask what the file lacks."
    )
    path = searched(problem, most, archive, report)
    return Unshared(path, archive, (*found.shared, told))


def in_all_records(problem: InverseProblem, name: str) -> InverseProblem:
    """The problem with an effect open in all records, as far as it may go where it is tried.

    A parameter with whose square alone the voltage moves cannot leave nought so, and its effect stays a difference.
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
