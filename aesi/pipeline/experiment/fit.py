"""From a loaded experiment to the models that will be judged.

Nothing here looks at `Split.test`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from aesi.conformal import Calibrated, FreeRunBands, RefittedIntervals
from aesi.errors import FitError
from aesi.pipeline.experiment.candidate import genome_space, weights
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.drives import cuts
from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.experiment.physics_models import PHYSICS_NAMES
from aesi.records import ErrorModel
from aesi.sparse import Candidate, Options, Problem
from aesi.sparse.baselines import BASELINES, Judge, Tuning
from aesi.sparse.yardsticks import Bare


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model ready to be judged.

    terms : active terms (0 where counting them makes no sense).  seconds : what its own fit took.
    intervals, bands : one step ahead, and in free run; None where they could not be calibrated (`notes`).
    trials : the candidates of its own search, a row each.
    compared : the same intervals by other methods, by name (of the ensembles alone).
    """

    model: ErrorModel
    terms: int
    seconds: float
    intervals: Calibrated | None = None
    bands: FreeRunBands | None = None
    compared: Mapping[str, Calibrated | RefittedIntervals] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    trials: tuple[Mapping[str, Any], ...] = ()


KeepModel = Callable[[str, Callable[[], Fitted]], Fitted]
"""Name of a model and its fit -> the model, from an earlier fit to the same where there is one."""


@dataclass(frozen=True, eq=False)
class FinalModels:
    """fitted : in the experiment's order.  unfitted : a sentence each baseline that could not be fitted."""

    fitted: tuple[Fitted, ...]
    unfitted: tuple[str, ...] = ()


def build_problem(loaded: Loaded, config: ExperimentConfig) -> Problem:
    """The search problem over the training records: library, resamples, factors."""
    library, search = config.library, config.search
    options = Options(
        inputs=library.inputs,
        p_c=library.p_c[1],
        d=library.d[1],
        factors=library.factors,
        special=library.special,
        mixed=library.mixed,
        resamples=search.resamples,
        block=search.block,
        best=search.top_share,
        horizon=search.horizon,
        fold=search.fold,
        cuts=cuts(loaded.config.data),  # a fallback has drives of its own
        regime=search.regime,
        feedback=library.feedback,
        fade=library.fade,
        seed=config.seed,
    )
    return Problem.build(loaded.split, options, left_out=loaded.left_out.parts)


def _anew(name: str, fit: Callable[[], Fitted]) -> Fitted:
    return fit()


def final_models(
    problem: Problem, chosen: Candidate, config: ExperimentConfig, keep: KeepModel = _anew
) -> FinalModels:
    """The chosen candidate's two ensembles, and the baselines that the experiment names, in its order.

    keep : called for each baseline; the ensembles need no fit.
    A baseline that cannot be fitted is left out, since it only serves to compare: the search is not lost for it. Raises
    FitError where nothing else is left to judge.
    """
    fitted, unfitted = [], []
    for name in config.models:
        fit = partial(_fit, name, problem, chosen, config)
        try:
            fitted.append(keep(name, fit) if name in BASELINES else fit())
        except FitError as error:
            unfitted.append(f"{name} could not be fitted and is left out: {error}")
    if not fitted:
        raise FitError(" ".join(unfitted))
    return FinalModels(tuple(fitted), tuple(unfitted))


def _fit(name: str, problem: Problem, chosen: Candidate, config: ExperimentConfig) -> Fitted:
    started = time.monotonic()
    trials: list[Mapping[str, Any]] = []
    model, terms = _model(name, problem, chosen, replace(_tuning(problem, config), told=trials.append))
    return Fitted(model, terms, time.monotonic() - started, trials=tuple(trials))


def _model(name: str, problem: Problem, chosen: Candidate, tuning: Tuning) -> tuple[ErrorModel, int]:
    ensemble = chosen.named(name)
    if ensemble is not None:
        return ensemble, len(ensemble.terms)
    if name in PHYSICS_NAMES:
        return Bare(name), 0
    baseline = BASELINES[name](problem, tuning)
    return baseline, len(getattr(baseline, "terms", ()))


def _tuning(problem: Problem, config: ExperimentConfig) -> Tuning:
    search = config.search
    judge = Judge(weights(config), search.pearson_train, search.pearson_valid)
    return Tuning(config.seed, search.candidates, search.population, genome_space(problem, config), judge)
