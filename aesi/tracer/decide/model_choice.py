"""Single particle or porous electrode: settled before an effect is blamed on the cell.

Parameters that were fitted with one of the two hold what it approximates, and are of that one.
Where the two models of the declared cell, or of what the single particle ends with, differ by a notable share of the
noise, all hypotheses use the fuller one; but not where the single particle cannot explain the data, and could not
though all of that difference were taken off what it leaves: what is missing is something else then, and a search takes
ten times as long. Where nothing was tried with the single particle, as all effects together leave too much, and that
may be the difference, it is searched for what it leaves first: a drive of a measured LFP cell takes 39 s, not 608.
What was measured may still be a single particle's (a thin electrode, a file made with one): what the two searches end
with is weighed as any two hypotheses are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, TypeGuard

from aesi.physics.simulation import MODEL_WORDS, ModelName
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.reduction import LEAST_V, Reduction, let_stand, reduction_of, with_fine_numerics
from aesi.tracer.decide.evidence import Answer, Evidence, believed
from aesi.tracer.decide.verdict import Thresholds, across_models, structured_v, tolerance_v
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.path import Path


class Search(Protocol):
    """Searches and judges a case with the model of its problem.

    most : effects that may be named.  shallower : the answer of the same search with fewer names, where there is one.
    """

    def __call__(
        self, problem: InverseProblem, archive: Archive, most: int, shallower: Answer | None = None
    ) -> Answer: ...


FIRST_LOOK = 1
"""Names that the single particle is tried with before the porous electrode, where the declared cell asks for that one:
what it approximates, no names explain, and looking for two and three of them takes most of the time. They are looked
for where one explains the data, where none could, or where the porous electrode needs names, too: before that one is
searched for them, since it could only be believed with as few. A lag and a contact at 10 Hz on a blind case took 119 s
so and 233 s in the other order, a triple 37 and 112; of 23 blind cases all answer the same, with 0.6 to 1.1 times the
simulations."""
ArchiveOf = Callable[[InverseProblem, Archive | None], Archive]
"""The archive of a problem with one model of the cell, which knows that of the same case with the other one."""


@dataclass(frozen=True)
class ModelChoice:
    """model : that every hypothesis used.  sentence : which one and why, and by how much the two differ.
    reduction : that difference, None where one of them cannot be simulated on these records."""

    model: ModelName
    sentence: str
    reduction: Reduction | None


def with_model(
    problem: InverseProblem, wanted: ModelName | None, search: Search, archive_of: ArchiveOf, max_effects: int
) -> tuple[Evidence, ModelChoice]:
    """Choose the model of the cell and search with it.

    The first of these that applies: the model that the user asks for; the one that the cell's file was fitted with; the
    single particle, where good records stand beside; the one that the records ask for.

    wanted : by the user.  max_effects : effects that may be named.
    """
    declared = reduction_of(problem)
    settled = wanted or problem.cell.fitted_with
    if settled:
        one = _fine(problem, "dfn" if settled == "dfn" else "espm")
        why = ", as asked" if wanted else ", with which the parameters of the cell were fitted"
        return _chosen(search(one, archive_of(one, None), max_effects), one.model, declared, why)
    reduced = _fine(problem, "espm")
    if declared is not None and not declared.notable:
        reduced = let_stand(reduced, declared.shift_v)
    single = _Single(reduced, archive_of(reduced, None), search, max_effects, declared)
    if problem.has_good:
        return _chosen(
            single.whole(), "espm", declared, ", since the good records share what it approximates"
        )
    return _asked_by_records(single, problem, archive_of)


@dataclass(frozen=True, eq=False)
class _Look:
    """The answer of the single particle.  whole : it was searched for all names that may be given."""

    answer: Answer
    whole: bool


@dataclass(frozen=True, eq=False)
class _Single:
    """The single particle of a case, and how it is asked.  declared : what the two models of the declared cell differ
    by."""

    problem: InverseProblem
    archive: Archive
    search: Search
    max_effects: int
    declared: Reduction | None

    def whole(self, shallower: Answer | None = None) -> Answer:
        """The search for all names that may be given.  shallower : the same for fewer."""
        return self.search(self.problem, self.archive, self.max_effects, shallower)

    def looked(self) -> _Look:
        """The search for `FIRST_LOOK` names where the two models differ notably, and for all where they do not, where
        one of the few explains the data, and where none could."""
        few = min(FIRST_LOOK, self.max_effects) if _notable(self.declared) else self.max_effects
        first = self.search(self.problem, self.archive, few)
        if few == self.max_effects:
            return _Look(first, True)
        if first.verdict.word == "found" or not _explains(first, self.declared):
            return _Look(self.whole(first), True)
        return _Look(first, False)

    def may_explain(self, answer: Answer) -> bool:
        """Whether an answer explains the data, or leaves no more than what the two models may differ by. Where
        nothing was tried, since all effects together leave too much, a search for what it leaves decides."""
        if not _explains(answer, self.declared):
            return False
        if answer.paths["tight"].beyond_reach_v is None or not _notable(self.declared):
            return True
        beside = replace(self.problem, reduced_v=self.declared.shift_v)
        return _explains(self.search(beside, self.archive, self.max_effects), self.declared)


def _asked_by_records(
    single: _Single, problem: InverseProblem, archive_of: ArchiveOf
) -> tuple[Evidence, ModelChoice]:
    """The single particle where the two models do not differ notably, be it on what it ended with, and where it leaves
    far more than they differ by; else the one that is believed of both."""
    look = single.looked()
    explained = single.may_explain(look.answer)
    reduction = _larger(single.declared, look.answer.paths["tight"]) if explained else single.declared
    if not _notable(reduction):
        return _chosen(look.answer, "espm", reduction)
    if not explained:
        return _chosen(look.answer, "espm", reduction, ", which leaves far more than the two differ by")
    full = _fine(problem, "dfn")
    return _weighed(single, look, full, archive_of(full, single.archive), reduction)


def _weighed(
    single: _Single, look: _Look, full: InverseProblem, archive: Archive, reduction: Reduction
) -> tuple[Evidence, ModelChoice]:
    """The model whose search is believed, each asked for as many names as could be.

    full, archive : of the porous electrode. Where that one needs names, the single particle is asked for all of them.
    """
    needs_names = not look.whole and single.search(full, archive, 0).verdict.word == "unknown"
    by_single = single.whole(look.answer) if needs_names else look.answer
    by_full = single.search(full, archive, most_names(by_single, single.max_effects))
    if believed((by_full.path, by_full.verdict), (by_single.path, by_single.verdict)):
        return _chosen(_of_both(by_single, by_full), "espm", reduction, _likelier(by_single))
    return _chosen(_of_both(by_full, by_single), "dfn", reduction)


def _fine(problem: InverseProblem, name: ModelName) -> InverseProblem:
    """The problem with one model of the cell, as finely resolved as that one has to be."""
    return with_fine_numerics(replace(problem, model=name))


def _of_both(believed_one: Answer, other: Answer) -> Answer:
    """The answer of the model that is believed, with the look-alikes of both searches."""
    return replace(believed_one, verdict=across_models(believed_one.verdict, other.verdict))


def _chosen(
    answer: Answer, name: ModelName, reduction: Reduction | None, why: str = ""
) -> tuple[Evidence, ModelChoice]:
    """The answer of a search with one model, and the choice of that model."""
    differ = "" if reduction is None else f"; {reduction.sentence}"
    words = f"all hypotheses use {MODEL_WORDS[name]}{why}{differ}."
    return answer.settled(answer.verdict), ModelChoice(name, words, reduction)


def _likelier(answer: Answer) -> str:
    """Why the single particle is believed where both models were searched."""
    if answer.verdict.word == "unknown":  # and so is that of the porous electrode, else it would be believed
        return (
            ", because it says as much with fewer or likelier names, though neither model explains the data"
        )
    return ", because it explains these data with fewer or likelier names"


def _notable(reduction: Reduction | None) -> TypeGuard[Reduction]:
    return reduction is not None and reduction.notable


def _larger(declared: Reduction | None, path: Path) -> Reduction | None:
    """The larger difference between the two models: on the declared cell, or on the one that the search with the
    single particle ended with. A cell whose electrolyte or particles are not as declared may need the porous
    electrode where the declared one does not."""
    ended = reduction_of(path.problem, path.chosen.values)
    known = [one for one in (declared, ended) if one is not None]
    return max(known, key=lambda one: one.shift_v, default=None)


def most_names(single: Answer, max_effects: int) -> int:
    """How many effects a search with the porous electrode may name and still be believed over the single particle's.

    All of `max_effects`, unless the single particle explains the data without a model error beyond what two solvers
    differ by: then nothing is left for further names to explain, and the porous electrode may name no more than it did.
    """
    chosen = single.path.chosen
    if single.verdict.word == "unknown" or chosen.score.delta_v > LEAST_V:
        return max_effects
    return len(chosen.hypothesis)


def _explains(single: Answer, reduction: Reduction | None) -> bool:
    """Whether a search with the single particle explains the data, or leaves no more beyond a right hypothesis than
    what the two models of the declared cell differ by."""
    path = single.paths["tight"]
    if single.verdict.word != "unknown":
        return True
    allowed_v = tolerance_v(path.problem, Thresholds())
    left_v = structured_v(path, path.chosen) if path.beyond_reach_v is None else path.beyond_reach_v
    return left_v - (0.0 if reduction is None else reduction.shift_v) <= allowed_v
