"""Fits of the models that an experiment compares: the search problem, the chosen ensembles, the baselines.

This module does not read `Split.test`.
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
from aesi.sparse.bare import Bare
from aesi.sparse.baselines import BASELINES, Judge, Tuning


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fitted model, ready for the evaluation.

    terms : number of terms of a sparse model, 0 for others.  seconds : wall time of its own fit, s.
    intervals : prediction intervals one step ahead.  bands : bands of the free run. Both are None if they could not be
    calibrated; `notes` say why.  compared : method -> intervals one step ahead, of the ensembles alone.
    trials : one row for each candidate of the model's own search.
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
"""Function of a model's name and its fit that returns the fitted model. It may return that of an earlier fit to the
same data."""


@dataclass(frozen=True, eq=False)
class FinalModels:
    """The models of an experiment.

    fitted : in the order of the experiment file.  unfitted : a sentence on each baseline that could not be fitted.
    """

    fitted: tuple[Fitted, ...]
    unfitted: tuple[str, ...]


def build_problem(loaded: Loaded, config: ExperimentConfig) -> Problem:
    """The search problem of an experiment on its training records: the library, the bootstrap resamples and their
    factors, from the sections `library` and `search`."""
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
        cuts=cuts(loaded.config.data),  # those of the loaded data, which a fallback replaces
        regime=search.regime,
        feedback=library.feedback,
        fade=library.fade,
        seed=config.seed,
    )
    return Problem.build(loaded.split, options, left_out=loaded.left_out.parts)


def _fit_again(name: str, fit: Callable[[], Fitted]) -> Fitted:
    """The `KeepModel` that keeps none."""
    return fit()


def final_models(
    problem: Problem,
    chosen: Candidate,
    config: ExperimentConfig,
    keep: KeepModel = _fit_again,
    begins: Callable[[str], None] = lambda part: None,
) -> FinalModels:
    """The models that the experiment names, in its order: physics, the two ensembles of the chosen candidate,
    baselines.

    keep : called with the fit of each baseline, whose result it may take from an earlier run. The others need no fit.
    begins : called with the name of each model that is fitted: a fit takes minutes where records are long.
    A baseline that cannot be fitted is left out, so that the result of the search is not lost for it.
    Raises FitError if no model is left.
    """
    fitted, unfitted = [], []
    for name in config.models:
        fit = partial(_fit, name, problem, chosen, config, begins)
        try:
            fitted.append(keep(name, fit) if name in BASELINES else fit())
        except FitError as error:
            unfitted.append(f"{name} could not be fitted and is left out: {error}")
    if not fitted:
        raise FitError(" ".join(unfitted))
    return FinalModels(tuple(fitted), tuple(unfitted))


def _fit(
    name: str,
    problem: Problem,
    chosen: Candidate,
    config: ExperimentConfig,
    begins: Callable[[str], None],
) -> Fitted:
    if name in BASELINES:
        begins(name)
    started = time.monotonic()
    trials: list[Mapping[str, Any]] = []
    model, terms = _model(
        name, problem, chosen, replace(_tuning(problem, config), on_candidate=trials.append)
    )
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
