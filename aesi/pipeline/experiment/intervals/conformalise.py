"""Calibration of the prediction intervals and bands of the fitted models, on rows that the models were not fitted to.

This module does not read `Split.test`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import overload

import numpy as np

from aesi.conformal import COMPARED, Calibrated, FreeRunBands, Method, RefittedForest, RefittedIntervals
from aesi.errors import FitError
from aesi.pipeline.experiment.candidate import method
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.intervals.bands import (
    ALL_BUT_FIRST,
    OutOfSampleErrors,
    Unseen,
    bands_of_horizons,
)
from aesi.pipeline.product.one_step import rows_ahead
from aesi.records import ErrorModel, LeftOutDrives
from aesi.records.horizons import in_whole_steps
from aesi.sparse import ENSEMBLES, Candidate, Problem, SparseModel
from aesi.sparse.bare import Bare
from aesi.sparse.search.fold_models import fold_models, with_leverage


def conformalise(
    models: Sequence[Fitted],
    problem: Problem,
    chosen: Candidate,
    config: ExperimentConfig,
    left_out: LeftOutDrives | None = None,
    begins: Callable[[str], None] = lambda part: None,
) -> tuple[Fitted, ...]:
    """The models with intervals one step ahead and bands of the free run.

    All models are calibrated on the validation records; the ensembles also on each training piece, predicted by a model
    fitted without it; the physics models also on the training records.
    left_out : the training drives under physics that was fitted without some of their rows; by default they are under
    the physics as it is. Bands are calibrated on left-out parts of drives and on whole left-out drives.
    begins : called with the name of each model whose turn it is: one takes minutes where records are long.
    """
    calibrated = []
    for one in models:
        begins(one.model.name)
        calibrated.append(_conformalised(one, problem, chosen, config, left_out or LeftOutDrives()))
    return tuple(calibrated)


def _conformalised(
    one: Fitted,
    problem: Problem,
    chosen: Candidate,
    config: ExperimentConfig,
    left_out: LeftOutDrives,
) -> Fitted:
    pairs, drives, model = _unseen_predictions(one.model, problem, chosen, left_out)
    one = replace(one, model=model)
    if not pairs:
        return replace(one, notes=(f"{one.model.name} saw every record, so it has no calibrated intervals.",))
    return _calibrated(one, pairs, drives, problem, config)


def _unseen_predictions(
    model: ErrorModel, problem: Problem, chosen: Candidate, left_out: LeftOutDrives
) -> tuple[list[Unseen], list[Unseen], ErrorModel]:
    """(validation records and left-out parts; whole left-out drives; the model as it is served). Each record or part is
    paired with a model that has not seen it."""
    pairs: list[Unseen] = []
    drives: list[Unseen] = []
    if isinstance(model, SparseModel) and model.name in ENSEMBLES:
        pairs += fold_models(problem, chosen, model, left_out.parts)
        if left_out.drives and problem.folds_are_drives:
            drives += fold_models(problem, chosen, model, left_out.drives, problem.spans)
        model = with_leverage(model, problem, chosen.ridge)
    elif isinstance(model, Bare):
        pairs += [(model, each.series, each.rows) for each in left_out.parts]
        drives += [(model, each.series, each.rows) for each in left_out.drives]
        if not left_out.parts:
            pairs += [(model, series, ALL_BUT_FIRST) for series in problem.split.train]
    # Validation records are predicted by the served model, whose leverage determines how its correction fades.
    return [(model, series, ALL_BUT_FIRST) for series in problem.split.valid] + pairs, drives, model


def _calibrated(
    one: Fitted, pairs: Sequence[Unseen], drives: Sequence[Unseen], problem: Problem, config: ExperimentConfig
) -> Fitted:
    """The model with the intervals and bands that can be calibrated, and a note on each that cannot.

    pairs : for intervals and bands.  drives : whole left-out drives, for the bands alone.
    """
    intervals, bands, notes = None, None, []
    compared: dict[str, Calibrated | RefittedIntervals] = {}
    try:
        intervals = _intervals(pairs, config, method(config))
    except FitError as error:
        notes.append(f"{one.model.name} has no intervals one step ahead: {error}")
    for name in config.conformal.compare if one.model.name in ENSEMBLES else ():
        try:
            compared[name] = _intervals(pairs, config, COMPARED[name])
        except FitError as error:
            notes.append(f"{one.model.name} has no intervals by {name} to compare with: {error}")
    try:
        bands, too_long = _bands([*pairs, *drives], len(pairs), problem, config)
        notes += [f"{one.model.name} has no band in free run at one horizon: {reason}" for reason in too_long]
        if any(band.extrapolated for band in bands.horizons):
            notes.append(
                f"The bands of {one.model.name} in free run are calibrated on too few pieces inside the trained "
                "range, so rows outside of it were counted too; they are wide."
            )
    except FitError as error:
        notes.append(f"{one.model.name} has no bands in free run: {error}")
    return replace(one, intervals=intervals, bands=bands, compared=compared, notes=tuple(notes))


def _bands(
    unseen: Sequence[Unseen], stretches: int, problem: Problem, config: ExperimentConfig
) -> tuple[FreeRunBands, tuple[str, ...]]:
    """(bands of the free run; a sentence on each horizon without one).

    stretches : number of stretches of `unseen` with independent errors. Whole drives do not count, since they have the
    same rows as their parts.
    """
    train, horizons_s = problem.split.train, config.conformal.horizons_s
    errors = OutOfSampleErrors.of(
        unseen, train, in_whole_steps(train[0].dt_s) if horizons_s is None else horizons_s
    )
    return bands_of_horizons(errors, config.conformal.alpha, stretches)


@overload
def _intervals(pairs: Sequence[Unseen], config: ExperimentConfig, chosen: Method) -> Calibrated: ...


@overload
def _intervals(
    pairs: Sequence[Unseen], config: ExperimentConfig, chosen: Method | RefittedForest
) -> Calibrated | RefittedIntervals: ...


def _intervals(
    pairs: Sequence[Unseen], config: ExperimentConfig, chosen: Method | RefittedForest
) -> Calibrated | RefittedIntervals:
    conformal = config.conformal
    ahead = [(rows_ahead(model, series), rows) for model, series, rows in pairs]
    return chosen.fit(
        [each.residual_v[each.of(rows)] for each, rows in ahead],
        conformal.alpha,
        conformal.window,
        np.random.default_rng(config.seed),
        current_a=[each.current_a[each.of(rows)] for each, rows in ahead],
    )
