"""The model of the cell, single particle or porous electrode, chosen before an effect is blamed on the cell.

Parameters that were fitted with one of the two models compensate for its approximations, and are valid for that one.
Where the two models differ by a notable share of the noise, on the declared cell or on the cell that the single
particle ends with, all hypotheses use the porous electrode. The exception is a single particle that cannot explain the
data and could not even if the whole difference were subtracted from its error: then something else is missing, and a
search with the porous electrode takes ten times as long. Where no effect was tried with the single particle, since all
effects together leave too large an error, and the difference may be the reason, it is searched once more with this
error allowed: a drive of a measured LFP cell takes 39 s, not 608. The data may still be those of a single particle (a
thin electrode, a file made with one), so that the results of the two searches are compared like any two hypotheses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, TypeGuard

from aesi.physics.simulation import MODEL_WORDS, ModelName
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.reduction import (
    LEAST_V,
    Reduction,
    reduction_of,
    with_approximation_kept,
    with_fine_numerics,
)
from aesi.tracer.decide.evidence import Answer, Evidence, second_is_believed
from aesi.tracer.decide.verdict import Thresholds, across_models, structured_v, tolerance_v
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.path import Path


class Search(Protocol):
    """A search with the model of its problem, and its verdict.

    most : most effects that may be named.  shallower : answer of the same search with fewer effects, to be reused.
    """

    def __call__(
        self, problem: InverseProblem, archive: Archive, most: int, shallower: Answer | None = None
    ) -> Answer: ...


FIRST_LOOK = 1
"""Most effects that the single particle is searched for before the porous electrode, where the two models of the
declared cell differ notably: no effect explains an approximation of the model, and searches for two and three effects
take most of the time. The single particle is searched for more where one effect explains the data, where none could, or
where the porous electrode needs effects too. This comes before the search with the porous electrode, which is believed
only with no more effects. A lag and a contact at 10 Hz on a blind case took 119 s so and 233 s in the other order, a
triple 37 and 112; of 23 blind cases all answer the same, with 0.6 to 1.1 times the simulations."""
ArchiveOf = Callable[[InverseProblem, Archive | None], Archive]
"""(problem with one model of the cell, archive of the same case with the other model) -> archive of the problem."""


@dataclass(frozen=True)
class ModelChoice:
    """The model of the cell that every hypothesis uses.

    sentence : names the model, the reason, and the difference of the two models.  reduction : that difference; None
    where one of them cannot be simulated on these records.
    """

    model: ModelName
    sentence: str
    reduction: Reduction | None


def with_model(
    problem: InverseProblem, wanted: ModelName | None, search: Search, archive_of: ArchiveOf, max_effects: int
) -> tuple[Evidence, ModelChoice]:
    """The evidence of a case and the model of the cell that it was searched with.

    The first of these that applies: the model that the user asks for; the one that the cell's file was fitted with; the
    single particle, where good records are given; the one chosen by the records.

    wanted : model that the user asks for.  max_effects : most effects that may be named.
    """
    declared = reduction_of(problem)
    settled = wanted or problem.cell.fitted_with
    if settled:
        one = _fine(problem, "dfn" if settled == "dfn" else "espm")
        why = ", as asked" if wanted else ", with which the parameters of the cell were fitted"
        return _chosen(search(one, archive_of(one, None), max_effects), one.model, declared, why)
    reduced = _fine(problem, "espm")
    if declared is not None and not declared.notable:
        reduced = with_approximation_kept(reduced, declared.shift_v)
    single = _SingleParticle(reduced, archive_of(reduced, None), search, max_effects, declared)
    if problem.has_good:
        return _chosen(
            single.full_search(), "espm", declared, ", since its approximations act on the good records, too"
        )
    return _chosen_by_records(single, problem, archive_of)


@dataclass(frozen=True, eq=False)
class _FirstSearch:
    """The answer of the single particle.  complete : whether it was searched for as many effects as may be named."""

    answer: Answer
    complete: bool


@dataclass(frozen=True, eq=False)
class _SingleParticle:
    """The searches of a case with the single particle.

    declared : difference of the two models of the declared cell.
    """

    problem: InverseProblem
    archive: Archive
    search: Search
    max_effects: int
    declared: Reduction | None

    def full_search(self, shallower: Answer | None = None) -> Answer:
        """The search for as many effects as may be named.  shallower : the same for fewer."""
        return self.search(self.problem, self.archive, self.max_effects, shallower)

    def first_search(self) -> _FirstSearch:
        """The search for up to `FIRST_LOOK` effects where the two models differ notably, else for as many as may be
        named. The short search is continued where it finds an effect, and where it leaves more than the two models
        differ by."""
        few = min(FIRST_LOOK, self.max_effects) if _notable(self.declared) else self.max_effects
        first = self.search(self.problem, self.archive, few)
        if few == self.max_effects:
            return _FirstSearch(first, True)
        if first.verdict.word == "found" or not _explains(first, self.declared):
            return _FirstSearch(self.full_search(first), True)
        return _FirstSearch(first, False)

    def may_explain(self, answer: Answer) -> bool:
        """Whether an answer explains the data, or leaves no more than the two models may differ by. Where no effect was
        tried, since all effects together leave too much, a search that allows for this error decides."""
        if not _explains(answer, self.declared):
            return False
        if answer.paths["tight"].beyond_reach_v is None or not _notable(self.declared):
            return True
        beside = replace(self.problem, reduced_v=self.declared.shift_v)
        return _explains(self.search(beside, self.archive, self.max_effects), self.declared)


def _chosen_by_records(
    single: _SingleParticle, problem: InverseProblem, archive_of: ArchiveOf
) -> tuple[Evidence, ModelChoice]:
    """The single particle where the two models do not differ notably, for the declared cell and the one found, and
    where its error is far larger than their difference; else the one of the two whose search is believed."""
    first = single.first_search()
    explained = single.may_explain(first.answer)
    reduction = _larger(single.declared, first.answer.paths["tight"]) if explained else single.declared
    if not _notable(reduction):
        return _chosen(first.answer, "espm", reduction)
    if not explained:
        return _chosen(
            first.answer,
            "espm",
            reduction,
            ", whose error is far larger than the difference of the two models",
        )
    porous = _fine(problem, "dfn")
    return _compared(single, first, porous, archive_of(porous, single.archive), reduction)


def _compared(
    single: _SingleParticle,
    first: _FirstSearch,
    porous: InverseProblem,
    archive: Archive,
    reduction: Reduction,
) -> tuple[Evidence, ModelChoice]:
    """The model whose search is believed, after a search with each.

    porous, archive : of the porous electrode. Where that one needs effects, the single particle is searched for all.
    """
    needs_effects = not first.complete and single.search(porous, archive, 0).verdict.word == "unknown"
    by_single = single.full_search(first.answer) if needs_effects else first.answer
    by_porous = single.search(porous, archive, most_effects_of_dfn(by_single, single.max_effects))
    if second_is_believed((by_porous.path, by_porous.verdict), (by_single.path, by_single.verdict)):
        return _chosen(_of_both(by_single, by_porous), "espm", reduction, _likelier(by_single))
    return _chosen(_of_both(by_porous, by_single), "dfn", reduction)


def _fine(problem: InverseProblem, name: ModelName) -> InverseProblem:
    """The problem with one model of the cell, on fine numerics where that model needs them."""
    return with_fine_numerics(replace(problem, model=name))


def _of_both(believed_one: Answer, other: Answer) -> Answer:
    """The answer of the believed model, with the look-alikes of both searches."""
    return replace(believed_one, verdict=across_models(believed_one.verdict, other.verdict))


def _chosen(
    answer: Answer, name: ModelName, reduction: Reduction | None, why: str = ""
) -> tuple[Evidence, ModelChoice]:
    """(evidence from the answer of a search with one model, the choice of that model).  why : clause, the reason."""
    differ = "" if reduction is None else f"; {reduction.sentence}"
    words = f"all hypotheses use {MODEL_WORDS[name]}{why}{differ}."
    return answer.evidence_for(answer.verdict), ModelChoice(name, words, reduction)


def _likelier(answer: Answer) -> str:
    """Why the single particle is believed where both models were searched, a clause."""
    if answer.verdict.word == "unknown":  # the porous electrode's is unknown too, or it would be believed
        return ", because it scores as high with fewer or likelier effects, though neither model explains the data"
    return ", because it explains these data with fewer or likelier effects"


def _notable(reduction: Reduction | None) -> TypeGuard[Reduction]:
    return reduction is not None and reduction.notable


def _larger(declared: Reduction | None, path: Path) -> Reduction | None:
    """The larger difference between the two models: on the declared cell, or on the one that the search with the
    single particle ended with. A cell whose electrolyte or particles are not as declared may need the porous
    electrode where the declared one does not."""
    ended = reduction_of(path.problem, path.chosen.values)
    known = [one for one in (declared, ended) if one is not None]
    return max(known, key=lambda one: one.shift_v, default=None)


def most_effects_of_dfn(single: Answer, max_effects: int) -> int:
    """Most effects that a search with the porous electrode may name and still be believed over the single particle's.

    It is `max_effects`, unless the single particle explains the data with a model error no larger than the difference
    of two solvers. Nothing is left to explain then, and the porous electrode may name no more than the single particle.
    """
    chosen = single.path.chosen
    if single.verdict.word == "unknown" or chosen.score.delta_v > LEAST_V:
        return max_effects
    return len(chosen.hypothesis)


def _explains(single: Answer, reduction: Reduction | None) -> bool:
    """Whether a search with the single particle explains the data, or leaves an error beyond that of a right hypothesis
    no larger than the difference of the two models of the declared cell."""
    path = single.paths["tight"]
    if single.verdict.word != "unknown":
        return True
    allowed_v = tolerance_v(path.problem, Thresholds())
    left_v = structured_v(path, path.chosen) if path.beyond_reach_v is None else path.beyond_reach_v
    return left_v - (0.0 if reduction is None else reduction.shift_v) <= allowed_v
