"""The predictions of a fitted model on a record, with its intervals and bands."""

from __future__ import annotations

from dataclasses import dataclass, replace

from aesi.conformal import Intervals
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.intervals.bands import reach
from aesi.pipeline.product.one_step import RowsAhead, rows_ahead
from aesi.pipeline.product.trained import outside_trained, trained_on
from aesi.records import ErrorSeries, FreeRun


@dataclass(frozen=True, eq=False)
class RecordPredictions:
    """The predictions of one model on one record.

    free : the free run.  one_step : the predictions one step ahead, at the rows as measured.
    intervals, compared : intervals one step ahead of the model and of other methods, at the rows of `one_step`.
    bands : of the free run. Bounds are relative to the prediction, V; None if they were not calibrated.
    """

    series: ErrorSeries
    free: FreeRun
    one_step: RowsAhead
    intervals: Intervals | None
    bands: Intervals | None
    compared: dict[str, Intervals]


def predictions_of(one: Fitted, series: ErrorSeries, *, compares: bool) -> RecordPredictions:
    """The predictions of a model on a record.

    compares : whether its intervals by other methods are asked for as well; else `compared` is empty.
    """
    free = one.model.free_run(series)
    free = replace(free, outside=outside_trained(free.outside, series, trained_on(one.model, one.bands)))
    ahead = rows_ahead(one.model, series)
    residual = ahead.residual_v
    return RecordPredictions(
        series=series,
        free=free,
        one_step=ahead,
        intervals=None if one.intervals is None else one.intervals.intervals(residual, ahead.current_a),
        bands=None if one.bands is None else one.bands.intervals(series, free, reach(one.model, series)),
        compared={name: each.intervals(residual, ahead.current_a) for name, each in one.compared.items()}
        if compares
        else {},
    )
