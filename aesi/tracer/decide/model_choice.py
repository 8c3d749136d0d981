"""Single particle or porous electrode: settled before an effect is blamed on the cell.

Parameters that were fitted with one of the two hold what it approximates, and are of that one.
Where the two models of the declared cell, or of what the single particle ends with, differ by a notable share of the
noise, all hypotheses use the fuller one; but not where the single particle cannot explain the data, and could not
though all of that difference were taken off what it leaves: what is missing is something else then, and a search takes
ten times as long.
What was measured may still be a single particle's (a thin electrode, a file made with one): what the two searches end
with is weighed as any two hypotheses are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from aesi.physics.simulation import MODEL_WORDS, ModelName
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.reduction import Reduction, let_stand, reduction_of, with_fine_numerics
from aesi.tracer.decide.evidence import Evidence, believed
from aesi.tracer.decide.verdict import Thresholds, structured_v, tolerance_v
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.path import Path, lowers_error, unseen_rmse_v

Search = Callable[[InverseProblem, Archive, int], Evidence]
"""All that is searched and judged with one model of the cell, with at most so many names."""
FIRST_LOOK = 1
"""Names that the single particle is tried with before the porous electrode, where the declared cell asks for that one:
what it approximates, no names explain, and looking for two and three of them takes most of the time. They are looked
for where one explains the data, where none could, or where the porous electrode needs names, too."""
ArchiveOf = Callable[[InverseProblem, Archive | None], Archive]
"""The archive of a problem with one model of the cell, beside that of the same case with the other one."""


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
    """The search with the model that the user named, or else with the one that the parameters of the cell were fitted
    with, or else with the one that the records ask for.

    max_effects : names that may be given.
    """
    reduction = reduction_of(problem)

    def fine(name: ModelName) -> InverseProblem:
        return with_fine_numerics(replace(problem, model=name))

    def told(evidence: Evidence, name: ModelName, why: str = "") -> tuple[Evidence, ModelChoice]:
        differ = "" if reduction is None else f"; {reduction.sentence}"
        words = f"all hypotheses use {MODEL_WORDS[name]}{why}{differ}."
        return evidence, ModelChoice(name, words, reduction)

    settled = wanted or problem.cell.fitted_with
    if settled:
        one = fine("dfn" if settled == "dfn" else "espm")
        why = ", as asked" if wanted else ", with which the parameters of the cell were fitted"
        return told(search(one, archive_of(one, None), max_effects), one.model, why)
    single = fine("espm")
    if reduction is not None and not reduction.notable:
        single = let_stand(single, reduction.shift_v)
    archive = archive_of(single, None)
    if problem.has_good:
        return told(
            search(single, archive, max_effects),
            "espm",
            ", since the good records share what it approximates",
        )
    most = max_effects if reduction is None or not reduction.notable else min(FIRST_LOOK, max_effects)
    first = search(single, archive, most)
    explained = _explains(first, reduction)
    if most < max_effects and (not explained or first.verdict.word == "found"):
        most = max_effects
        first = search(single, archive, most)
        explained = _explains(first, reduction)
    if explained:
        reduction = _larger(reduction, first.paths["tight"])
    if reduction is None or not reduction.notable:
        return told(first, "espm")
    if not explained:
        return told(first, "espm", ", which leaves far more than the two differ by")
    full = fine("dfn")
    second = search(full, archive_of(full, archive), most_names(first, max_effects))
    unknown = "unknown" in (first.verdict.word, second.verdict.word)
    if most < max_effects and unknown and second.verdict.word != "none":
        first = search(single, archive, max_effects)
    if believed((second.path, second.verdict), (first.path, first.verdict)):
        return told(first, "espm", ", which explains the data with fewer or more usual effects")
    return told(second, "dfn")


def _larger(declared: Reduction | None, path: Path) -> Reduction | None:
    """Of what both models differ by on the declared cell and on what the search with the single particle ended with: a
    cell whose electrolyte or particles are not as declared may need the porous electrode where the declared one does
    not."""
    ended = reduction_of(path.problem, path.chosen.values)
    known = [one for one in (declared, ended) if one is not None]
    return max(known, key=lambda one: one.shift_v, default=None)


def most_names(single: Evidence, max_effects: int) -> int:
    """Names with which the porous electrode could still be believed rather than a search with the single particle: no
    more than that has, where it leaves nothing that further ones could lower."""
    path = single.path
    left_v = unseen_rmse_v(path.blocks, path.chosen)
    if single.verdict.word == "unknown" or lowers_error(left_v, path.problem.noise_v):
        return max_effects
    return len(path.chosen.hypothesis)


def _explains(single: Evidence, reduction: Reduction | None) -> bool:
    """Does a search with the single particle explain the data, or could what the two models of the declared cell differ
    by be all that it leaves beyond what a right hypothesis may?"""
    path = single.paths["tight"]
    if single.verdict.word != "unknown":
        return True
    allowed_v = tolerance_v(path.problem, Thresholds())
    left_v = structured_v(path, path.chosen) if path.beyond_reach_v is None else path.beyond_reach_v
    return left_v - (0.0 if reduction is None else reduction.shift_v) <= allowed_v
