"""From a loaded experiment to the models that will be judged, and their intervals.

Nothing here looks at `Split.test`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from aesi.conformal import METHODS, Calibrated, FreeRunBands, Method
from aesi.conformal.free_run import WHOLE_DRIVE
from aesi.errors import FitError
from aesi.numerics.typing import Array
from aesi.pipeline.candidate import genome_space, method
from aesi.pipeline.config import ExperimentConfig
from aesi.pipeline.load import Loaded
from aesi.records import ErrorModel, ErrorSeries
from aesi.sparse import Candidate, Options, Problem
from aesi.sparse.baselines import BASELINES, Tuning
from aesi.sparse.fold_models import fold_models
from aesi.sparse.yardsticks import Bare, Persistence

SEARCHED = ("AESI I", "AESI II")

_Unseen = tuple[ErrorModel, ErrorSeries]
"""A model and a record that it was not fitted to."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model ready to be judged.

    terms : active terms (0 where counting them makes no sense).  seconds : what its own fit took.
    intervals, bands : one step ahead, and in free run; None where they could not be calibrated (`notes`).
    compared : the same intervals by other methods, by name (of the ensembles alone).
    """

    model: ErrorModel
    terms: int
    seconds: float
    intervals: Calibrated | None = None
    bands: FreeRunBands | None = None
    compared: Mapping[str, Calibrated] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


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
        seed=config.seed,
    )
    return Problem.build(loaded.split, options)


def final_models(problem: Problem, chosen: Candidate, config: ExperimentConfig) -> tuple[Fitted, ...]:
    """The chosen candidate's two ensembles, and the baselines that the experiment names, in its order."""
    fitted = []
    for name in config.models:
        started = time.monotonic()
        model, terms = _model(name, problem, chosen, config)
        fitted.append(Fitted(model, terms, time.monotonic() - started))
    return tuple(fitted)


def conformalise(
    models: Sequence[Fitted], problem: Problem, chosen: Candidate, config: ExperimentConfig
) -> tuple[Fitted, ...]:
    """The models with intervals and bands, calibrated on residuals of records they were not fitted to.

    All: the validation records. The ensembles also each training piece, by a model fitted without it. Models
    that were fitted to nothing also the training records.
    """
    unseen: list[_Unseen] = list(fold_models(problem, chosen))
    return tuple(_conformalised(one, unseen, problem, config) for one in models)


def _model(
    name: str, problem: Problem, chosen: Candidate, config: ExperimentConfig
) -> tuple[ErrorModel, int]:
    if name == "AESI I":
        return chosen.bagging, len(chosen.bagging.terms)
    if name == "AESI II":
        return chosen.stability, len(chosen.stability.terms)
    if name == "ESPM":
        return Bare(), 0
    if name == "persistence":
        return Persistence(), 0
    baseline = BASELINES[name](problem, _tuning(problem, config))
    return baseline, len(getattr(baseline, "terms", ()))


def _tuning(problem: Problem, config: ExperimentConfig) -> Tuning:
    search = config.search
    return Tuning(config.seed, search.candidates, search.population, genome_space(problem, config))


def _conformalised(
    one: Fitted, unseen: Sequence[_Unseen], problem: Problem, config: ExperimentConfig
) -> Fitted:
    pairs: list[_Unseen] = [(one.model, series) for series in problem.split.valid]
    if one.model.name in SEARCHED:
        pairs += unseen
    elif isinstance(one.model, Bare | Persistence):
        pairs += [(one.model, series) for series in problem.split.train]
    if not pairs:
        return replace(one, notes=(f"{one.model.name} saw every record, so it has no calibrated intervals.",))
    intervals, bands, notes = None, None, []
    compared: dict[str, Calibrated] = {}
    try:
        intervals = _intervals(pairs, config, method(config))
        if one.model.name in SEARCHED:
            compared = {name: _intervals(pairs, config, METHODS[name]) for name in config.conformal.compare}
    except FitError as error:
        notes.append(f"{one.model.name} has no intervals one step ahead: {error}")
    try:
        bands = _bands(pairs, problem.dt_s, config)
    except FitError as error:
        notes.append(f"{one.model.name} has no bands in free run: {error}")
    return replace(one, intervals=intervals, bands=bands, compared=compared, notes=tuple(notes))


def _intervals(pairs: Sequence[_Unseen], config: ExperimentConfig, chosen: Method) -> Calibrated:
    conformal = config.conformal
    return chosen.fit(
        [(series.error_v - model.one_step(series))[1:] for model, series in pairs],
        conformal.alpha,
        conformal.window,
        np.random.default_rng(config.seed),
        current_a=[series.current_a[1:] for _, series in pairs],
    )


def _bands(pairs: Sequence[_Unseen], dt_s: float, config: ExperimentConfig) -> FreeRunBands:
    conformal = config.conformal
    by_horizon = {
        horizon: [_ahead(model, series, horizon) for model, series in pairs]
        for horizon in conformal.horizons_s
    }
    by_horizon[WHOLE_DRIVE] = [_freely(model, series) for model, series in pairs]
    return FreeRunBands.fit(
        by_horizon,
        dt_s,
        conformal.alpha,
        current_a=[series.current_a for _, series in pairs],
        soc=[series.soc for _, series in pairs],
    )


def _ahead(model: ErrorModel, series: ErrorSeries, horizon_s: float) -> Array:
    """(n,) V left by predictions from a measurement `horizon_s` earlier; NaN where there is none so early."""
    steps = max(1, round(horizon_s / series.dt_s))
    left = series.error_v - model.k_step(series, steps)
    left[:steps] = np.nan
    return left


def _freely(model: ErrorModel, series: ErrorSeries) -> Array:
    """(n,) V left by a free run from the first sample; NaN from a divergence on."""
    run = model.free_run(series)
    left = series.error_v - run.error_v
    if run.diverged_at is not None:
        left[run.diverged_at :] = np.nan
    return left
