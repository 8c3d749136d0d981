"""Baselines on the same features and splits as the search, each a function of problem and tuning.

Those with several settings judge them as the search does: by losses in its regime, its weights and its constraints.
While they are judged, SINDy-C and ridge (where no term holds the error) and boosted trees fade as the search's
candidates do. None has the leverage in its fade, which the ensembles get only once they are chosen. The constant,
PySINDy's median and DMD do not fade.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from aesi.records import ErrorModel
from aesi.sparse.baselines.boosting import gradient_boosting
from aesi.sparse.baselines.constant import constant
from aesi.sparse.baselines.dmd_c import dmd_with_control
from aesi.sparse.baselines.pysindy_ensemble import pysindy_ensemble
from aesi.sparse.baselines.ridge import plain_ridge
from aesi.sparse.baselines.sindy_c import tuned_sindy_c
from aesi.sparse.baselines.single import Judge
from aesi.sparse.search.genome_space import GenomeSpace
from aesi.sparse.search.problem import Problem


@dataclass(frozen=True)
class Tuning:
    """Budget and judgement of a baseline, the same as of the search.

    candidates : number of evaluations.  population : size of a generation.  space : ranges of the genes; None takes the
    widest.  judge : weights of the fitness, and constraints.  on_candidate : called with each candidate, a row of plain
    values.
    """

    seed: int = 0
    candidates: int = 200
    population: int = 20
    space: GenomeSpace | None = None
    judge: Judge = field(default_factory=Judge)
    on_candidate: Callable[[dict[str, Any]], None] | None = None


BASELINES: dict[str, Callable[[Problem, Tuning], ErrorModel]] = {
    "constant": lambda problem, _: constant(problem),
    "SINDy-C": lambda problem, tuning: tuned_sindy_c(
        problem,
        tuning.seed,
        tuning.candidates,
        tuning.population,
        tuning.space,
        tuning.judge,
        tuning.on_candidate,
    ),
    "PySINDy ensemble": lambda problem, tuning: pysindy_ensemble(problem, tuning.seed, tuning.judge),
    "DMD with control": lambda problem, _: dmd_with_control(problem),
    "ridge": lambda problem, tuning: plain_ridge(problem, tuning.judge),
    "gradient boosting": lambda problem, tuning: gradient_boosting(problem, tuning.seed, tuning.judge),
}
"""Name -> function of the problem and the tuning."""

__all__ = ["BASELINES", "Judge", "Tuning", "gradient_boosting", "plain_ridge", "tuned_sindy_c"]
