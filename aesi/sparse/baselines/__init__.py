"""What a user would pick instead, on the same features, splits and regimes; each a function of problem and tuning."""

from collections.abc import Callable
from dataclasses import dataclass

from aesi.records import ErrorModel
from aesi.sparse.baselines.boosting import gradient_boosting
from aesi.sparse.baselines.dmd_c import dmd_with_control
from aesi.sparse.baselines.pysindy_ensemble import pysindy_ensemble
from aesi.sparse.baselines.ridge import plain_ridge
from aesi.sparse.baselines.sindy_c import tuned_sindy_c
from aesi.sparse.search.evaluate import FitnessWeights
from aesi.sparse.search.genome_space import GenomeSpace
from aesi.sparse.search.problem import Problem


@dataclass(frozen=True)
class Tuning:
    """What a baseline may spend, the same as the search: candidates, generation size, ranges (None: the widest), the
    weights of the losses (None: the default), and the least correlation on validation."""

    seed: int = 0
    candidates: int = 200
    population: int = 20
    space: GenomeSpace | None = None
    weights: FitnessWeights | None = None
    least_pearson: float = -1.0


BASELINES: dict[str, Callable[[Problem, Tuning], ErrorModel]] = {
    "SINDy-C": lambda problem, tuning: tuned_sindy_c(
        problem,
        tuning.seed,
        tuning.candidates,
        tuning.population,
        tuning.space,
        tuning.weights,
        tuning.least_pearson,
    ),
    "PySINDy ensemble": lambda problem, tuning: pysindy_ensemble(problem, tuning.seed),
    "DMD with control": lambda problem, _: dmd_with_control(problem),
    "ridge": lambda problem, _: plain_ridge(problem),
    "gradient boosting": lambda problem, tuning: gradient_boosting(problem, tuning.seed),
}
"""Name -> function of the problem and the tuning."""

__all__ = ["BASELINES", "Tuning", "gradient_boosting", "plain_ridge", "tuned_sindy_c"]
