"""Intervals for the models that will be judged, calibrated on records that they were not fitted to.

Nothing here looks at `Split.test`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aesi.conformal import METHODS, Calibrated, FreeRunBands, Method
from aesi.conformal.free_run import WHOLE_DRIVE
from aesi.errors import FitError
from aesi.numerics.typing import Array, BoolArray
from aesi.pipeline.candidate import method
from aesi.pipeline.config import ExperimentConfig
from aesi.pipeline.fit import Fitted
from aesi.records import ErrorModel, ErrorSeries
from aesi.sparse import Candidate, Problem
from aesi.sparse.fold_models import fold_models
from aesi.sparse.yardsticks import Bare, Persistence

SEARCHED = ("AESI I", "AESI II")

_Unseen = tuple[ErrorModel, ErrorSeries]
"""A model and a record that it was not fitted to."""


def conformalise(
    models: Sequence[Fitted], problem: Problem, chosen: Candidate, config: ExperimentConfig
) -> tuple[Fitted, ...]:
    """The models with intervals and bands, calibrated on residuals of records they were not fitted to.

    All: the validation records. The ensembles also each training piece, by a model fitted without it. Models
    that were fitted to nothing also the training records.
    """
    unseen: list[_Unseen] = list(fold_models(problem, chosen))
    return tuple(_conformalised(one, unseen, problem, config) for one in models)


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
        bands = _bands(pairs, problem, config)
        if any(band.extrapolated for band in bands.horizons):
            notes.append(
                f"The bands of {one.model.name} in free run are calibrated on too few pieces inside the trained "
                "range, so rows outside of it were counted too; they are wide."
            )
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


def _bands(pairs: Sequence[_Unseen], problem: Problem, config: ExperimentConfig) -> FreeRunBands:
    conformal = config.conformal
    by_horizon = {
        horizon: [_ahead(model, series, horizon) for model, series in pairs]
        for horizon in conformal.horizons_s
    }
    by_horizon[WHOLE_DRIVE] = [_freely(model, series) for model, series in pairs]
    return FreeRunBands.fit(
        by_horizon,
        problem.dt_s,
        [series.current_a for _, series in pairs],
        [series.soc for _, series in pairs],
        conformal.alpha,
        [_inside(model, series, problem.split.train) for model, series in pairs],
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


def _inside(model: ErrorModel, series: ErrorSeries, train: Sequence[ErrorSeries]) -> BoolArray:
    """(n,) True where the model had been trained on such inputs.

    The models behind left-out pieces share the scaling of the whole training set and cannot tell by themselves:
    for a piece of a training record, the range is that of the training rows outside it.
    """
    if isinstance(model, Bare | Persistence):  # trained on nothing
        return np.ones(len(series), dtype=bool)
    others = [record.inputs[~_is_part(record, series)] for record in train]
    low = np.min([rows.min(axis=0) for rows in others if len(rows)], axis=0)
    high = np.max([rows.max(axis=0) for rows in others if len(rows)], axis=0)
    return np.asarray(((series.inputs >= low) & (series.inputs <= high)).all(axis=1))


def _is_part(record: ErrorSeries, piece: ErrorSeries) -> BoolArray:
    """(n,) True for the rows of `record` that `piece` was cut from; a piece keeps its record's name."""
    if record.name != piece.name:
        return np.zeros(len(record), dtype=bool)
    return np.asarray((record.time_s >= piece.time_s[0]) & (record.time_s <= piece.time_s[-1]))
