"""From a loaded experiment to the models that will be judged, and their intervals.

Nothing here looks at `Split.test`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from aesi.conformal import Calibrated, FreeRunBands
from aesi.conformal.free_run import WHOLE_DRIVE
from aesi.errors import FitError
from aesi.numerics.typing import Array
from aesi.pipeline.candidate import method
from aesi.pipeline.config import ExperimentConfig
from aesi.pipeline.load import Loaded
from aesi.records import ErrorModel, ErrorSeries
from aesi.sparse import Candidate, HonestResiduals, Options, Problem
from aesi.sparse.yardsticks import Bare, Persistence

SEARCHED = ("AESI I", "AESI II")


@dataclass(frozen=True, eq=False)
class Fitted:
    """A model ready to be judged.

    terms : active terms (0 where counting them makes no sense).  seconds : what its own fit took.
    intervals, bands : one step ahead, and in free run; None where they could not be calibrated (`notes`).
    """

    model: ErrorModel
    terms: int
    seconds: float
    intervals: Calibrated | None = None
    bands: FreeRunBands | None = None
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
    """The models with intervals and bands, calibrated on residuals of records it was not fitted to.

    The ensembles: each training piece by a model fitted without it, and the validation records. The others:
    the validation records, which they were not fitted to either.
    """
    return tuple(_conformalised(one, problem, chosen, config) for one in models)


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
    from aesi.sparse.baselines import BASELINES

    baseline = BASELINES[name](problem, config.seed)
    return baseline, len(getattr(baseline, "terms", ()))


def _conformalised(one: Fitted, problem: Problem, chosen: Candidate, config: ExperimentConfig) -> Fitted:
    conformal = config.conformal
    residuals = [_one_step_residual(one.model, series) for series in problem.split.valid]
    pieces = [_piece(one.model, series, conformal.horizons_s) for series in problem.split.valid]
    if one.model.name in SEARCHED:
        residuals += [honest.one_step_v for honest in chosen.residuals]
        for honest, series in zip(chosen.residuals, problem.split.train, strict=True):
            pieces += _left_out(honest, series)
    intervals, bands, notes = None, None, []
    try:
        rng = np.random.default_rng(config.seed)
        intervals = method(config).fit(residuals, conformal.alpha, conformal.window, rng)
    except FitError as error:
        notes.append(f"{one.model.name} has no intervals one step ahead: {error}")
    try:
        bands = _bands(pieces, problem.dt_s, config)
    except FitError as error:
        notes.append(f"{one.model.name} has no bands in free run: {error}")
    return replace(one, intervals=intervals, bands=bands, notes=tuple(notes))


@dataclass(frozen=True, eq=False)
class _Piece:
    """Honest prediction errors over a continuous stretch: in free run from its first sample, and by horizon."""

    series: ErrorSeries
    free_run_v: Array
    by_horizon: dict[float, Array]


def _piece(model: ErrorModel, series: ErrorSeries, horizons_s: Sequence[float]) -> _Piece:
    by_horizon = {}
    for horizon in horizons_s:
        steps = max(1, round(horizon / series.dt_s))
        error = series.error_v - model.k_step(series, steps)
        error[:steps] = np.nan
        by_horizon[horizon] = error
    return _Piece(series, series.error_v - model.free_run(series).error_v, by_horizon)


def _left_out(honest: HonestResiduals, series: ErrorSeries) -> list[_Piece]:
    """The free runs of the fold models over the pieces they were not fitted to; a divergence is left out."""
    edges = [*honest.starts, len(honest.free_run_v)]
    pieces = []
    for start, stop in pairwise(edges):
        error = honest.free_run_v[start:stop]
        pieces.append(
            _Piece(series.take(slice(start + 1, stop + 1)), np.where(np.isfinite(error), error, np.nan), {})
        )
    return pieces


def _bands(pieces: Sequence[_Piece], dt_s: float, config: ExperimentConfig) -> FreeRunBands:
    conformal = config.conformal
    by_horizon: dict[float, list[Array]] = {
        horizon: [piece.by_horizon.get(horizon, np.full(len(piece.series), np.nan)) for piece in pieces]
        for horizon in conformal.horizons_s
    }
    by_horizon[WHOLE_DRIVE] = [piece.free_run_v for piece in pieces]
    return FreeRunBands.fit(
        by_horizon,
        dt_s,
        conformal.alpha,
        current_a=[piece.series.current_a for piece in pieces],
        soc=[piece.series.soc for piece in pieces],
    )


def _one_step_residual(model: ErrorModel, series: ErrorSeries) -> Array:
    return (series.error_v - model.one_step(series))[1:]
