"""Evaluation of the chosen models, in free run and one step ahead, with the baseline of each figure beside it.

This is the only module that reads `Split.test`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.judging.figures import model_figures
from aesi.pipeline.experiment.judging.predictions import RecordPredictions, predictions_of
from aesi.pipeline.report.views import ModelVoltage, RecordTrace
from aesi.records import ROLES, ErrorSeries, Role, Split


@dataclass(frozen=True, eq=False)
class EvaluatedModels:
    """The evaluation of all models.

    rows : one per model, as in summary.json.  traces : one per record, with the predictions of all models.
    """

    rows: tuple[dict[str, Any], ...]
    traces: tuple[RecordTrace, ...]


def evaluate_models(
    fitted: Sequence[Fitted], split: Split, validation: Mapping[str, float] | None = None
) -> EvaluatedModels:
    """The figures of every model on the training, validation and test records, and the traces for the report.

    validation : model -> reduction of the declared model's mean squared error on left-out training drives, per cent
    (`judging.validation`).
    """
    traces: dict[tuple[Role, str], dict[str, ModelVoltage]] = {}
    rows = []
    for one in fitted:
        started = time.monotonic()
        # Tables show the other methods for intervals on the test records alone.
        by_role = {
            role: [predictions_of(one, series, compares=role == "test") for series in getattr(split, role)]
            for role in ROLES
        }
        seconds = one.seconds + time.monotonic() - started
        row = model_figures(one, by_role, seconds)
        if validation and one.model.name in validation:
            row["validation_mser_pct"] = validation[one.model.name]
        rows.append(row)
        for role, records in by_role.items():
            for record in records:
                key = (role, record.series.name)
                traces.setdefault(key, {})[one.model.name] = _voltages(record)
    return EvaluatedModels(
        rows=tuple(rows),
        traces=tuple(
            _trace(role, series, traces[role, series.name])
            for role in ROLES
            for series in cast("tuple[ErrorSeries, ...]", getattr(split, role))
        ),
    )


def _voltages(record: RecordPredictions) -> ModelVoltage:
    """The predicted voltages of a record on its even grid, as the report draws them."""
    model_v, ahead = record.series.model_v, record.one_step
    # A time of the even grid shows the prediction of the next measured row.
    at = np.minimum(np.searchsorted(ahead.stamps, np.arange(len(model_v))), len(ahead.stamps) - 1)
    free_v, step_v = model_v + record.free.error_v, model_v + ahead.predicted_v[at]
    drawn = not ahead.unscored.all()  # else each row is more than a step after the one before
    bands, intervals = record.bands, record.intervals if drawn else None
    return ModelVoltage(
        free_run_v=free_v,
        free_run_lower_v=None if bands is None else free_v + bands.lower_v,
        free_run_upper_v=None if bands is None else free_v + bands.upper_v,
        one_step_v=step_v if drawn else None,
        one_step_lower_v=None if intervals is None else step_v + intervals.lower_v[at],
        one_step_upper_v=None if intervals is None else step_v + intervals.upper_v[at],
        diverged_at=record.free.diverged_at,
        outside=record.free.outside,
    )


def _trace(role: Role, series: ErrorSeries, predictions: dict[str, ModelVoltage]) -> RecordTrace:
    return RecordTrace(
        name=series.name,
        role=role,
        time_s=series.time_s,
        current_a=series.current_a,
        soc=series.soc,
        measured_v=series.model_v + series.error_v,
        physics_v=series.model_v,
        predictions=predictions,
        all_physics_v=series.physics,
    )
