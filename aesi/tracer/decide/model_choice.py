"""Single particle or porous electrode: settled before an effect is blamed on the cell.

Where the two models of the declared cell differ by a notable share of the noise, all hypotheses use the fuller one.
What was measured may still be a single particle's (a thin electrode, a file made with one): where that says more of
the data as declared, it is searched too, and kept only if it explains them to the noise and says more there as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from aesi.physics.simulation import MODEL_WORDS, ModelName
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.reduction import Reduction, reduction_of, with_fine_numerics
from aesi.tracer.decide.archive import Archive
from aesi.tracer.decide.evidence import Evidence
from aesi.tracer.decide.search import base_of

Search = Callable[[InverseProblem, Archive], Evidence]
"""All that is searched and judged with one model of the cell."""
Kept = Callable[[InverseProblem], Archive]
"""The fits of a problem that are known already."""


@dataclass(frozen=True)
class ModelChoice:
    """model : that every hypothesis used.  sentence : which one and why, and by how much the two differ.
    reduction : that difference, None where one of them cannot be simulated on these records."""

    model: ModelName
    sentence: str
    reduction: Reduction | None


def with_model(
    problem: InverseProblem, wanted: ModelName | None, search: Search, kept: Kept
) -> tuple[Evidence, ModelChoice]:
    """The search with the model that the user named, or else with the one that the records ask for."""
    reduction = reduction_of(problem)
    name: ModelName = wanted or ("dfn" if reduction is not None and reduction.notable else "espm")
    problems = {name: with_fine_numerics(replace(problem, model=name))}
    evidence = search(problems[name], kept(problems[name]))
    differ = "" if reduction is None else f"; {reduction.sentence}"
    if wanted is not None:
        return evidence, ModelChoice(
            name, f"all hypotheses use {MODEL_WORDS[name]}, as asked{differ}.", reduction
        )
    if name == "dfn":
        single = with_fine_numerics(replace(problem, model="espm"))
        other = _better(evidence, problems[name], single, search, kept)
        if other is not None:
            ahead = other.path.chosen.score.total - evidence.path.chosen.score.total
            why = f"which explains these data to the noise and says {ahead:.0f} nats more of them"
            return other, ModelChoice(
                "espm", f"all hypotheses use {MODEL_WORDS['espm']}, {why}{differ}.", reduction
            )
    return evidence, ModelChoice(name, f"all hypotheses use {MODEL_WORDS[name]}{differ}.", reduction)


def _better(
    full: Evidence, problem: InverseProblem, single: InverseProblem, search: Search, kept: Kept
) -> Evidence | None:
    """The search with the single particle where it explains the data and says more of them, else None."""
    bases = [base_of(one, kept(one)) for one in (single, problem)]
    if bases[0] is None or (bases[1] is not None and bases[0][2].score.total <= bases[1][2].score.total):
        return None
    other = search(single, kept(single))
    explains = other.verdict.word != "unknown"
    says_more = other.path.chosen.score.total > full.path.chosen.score.total
    return other if explains and (says_more or full.verdict.word == "unknown") else None
