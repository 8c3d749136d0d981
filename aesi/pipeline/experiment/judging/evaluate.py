"""Evaluation of the chosen models, in free run and one step ahead, with the baseline of each figure beside it.

This is the only module that reads `Split.test`.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, cast

import numpy as np

from aesi.conformal import FreeRunBands, Intervals
from aesi.conformal.horizon_band import HorizonBand
from aesi.conformal.scores import low_minute_share, scores_of
from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms, rmse
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.intervals.bands import error_ahead, reach
from aesi.pipeline.experiment.judging.reductions import AGAINST
from aesi.pipeline.experiment.physics_models import DECLARED
from aesi.pipeline.product.one_step import LEAST_ROWS, RowsAhead, rows_ahead
from aesi.pipeline.product.trained import outside_trained, trained_figures, trained_on
from aesi.pipeline.report.views import ModelVoltage, RecordTrace
from aesi.records import ROLES, ErrorSeries, FreeRun, Role, Split
from aesi.records.horizons import in_whole_steps
from aesi.sparse import SparseModel


@dataclass(frozen=True, eq=False)
class EvaluatedModels:
    """The evaluation of all models.

    rows : one per model, as in summary.json.  traces : one per record, with the predictions of all models.
    """

    rows: tuple[dict[str, Any], ...]
    traces: tuple[RecordTrace, ...]


@dataclass(frozen=True, eq=False)
class _Judged:
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
        judged = {role: [_judge(one, series, role) for series in getattr(split, role)] for role in ROLES}
        seconds = one.seconds + time.monotonic() - started
        row = _row(one, judged, seconds)
        if validation and one.model.name in validation:
            row["validation_mser_pct"] = validation[one.model.name]
        rows.append(row)
        for role, records in judged.items():
            for record in records:
                key = (role, record.series.name)
                traces.setdefault(key, {})[one.model.name] = _prediction(record)
    return EvaluatedModels(
        rows=tuple(rows),
        traces=tuple(
            _trace(role, series, traces[role, series.name])
            for role in ROLES
            for series in cast("tuple[ErrorSeries, ...]", getattr(split, role))
        ),
    )


def _judge(one: Fitted, series: ErrorSeries, role: Role) -> _Judged:
    free = one.model.free_run(series)
    free = replace(free, outside=outside_trained(free.outside, series, trained_on(one.model, one.bands)))
    ahead = rows_ahead(one.model, series)
    residual = ahead.residual_v
    return _Judged(
        series=series,
        free=free,
        one_step=ahead,
        intervals=None if one.intervals is None else one.intervals.intervals(residual, ahead.current_a),
        bands=None if one.bands is None else one.bands.intervals(series, free, reach(one.model, series)),
        compared={name: each.intervals(residual, ahead.current_a) for name, each in one.compared.items()}
        if role == "test"  # tables show these methods on the test records alone
        else {},
    )


def _row(one: Fitted, judged: Mapping[Role, Sequence[_Judged]], seconds: float) -> dict[str, Any]:
    """The row of a model in summary.json: the errors in free run and one step ahead by role, and all other figures on
    the test records alone."""
    test = judged["test"]
    ahead = _ahead(one, test)
    return {
        "name": one.model.name,
        "terms": one.terms,
        "seconds": round(seconds, 3),
        "free_run": _free_run(judged),
        "one_step": _one_step(judged),
        **_k_step(one, test),
        "test_records": {r.series.name: _record_figures(one, r) for r in test},
        **_one_step_intervals(one, test),
        **_free_run_intervals(one, test, ahead),
    }


def _free_run(judged: Mapping[Role, Sequence[_Judged]]) -> dict[str, float]:
    """Figures in free run.

    By role, over all its records: the reduction of the mean squared error of the declared and of the recalibrated
    physics, per cent; the RMSE, mV; and, if a simulation ran out of lithium or salt, the RMSE over the rows before.
    Of the test records also the number of diverged runs and the share of rows outside the trained range, per cent.
    """
    figures: dict[str, float] = {}
    for role, records in judged.items():
        if records:
            error = _joined(r.series.error_v for r in records)
            predicted = _joined(r.free.error_v for r in records)
            for key, against in AGAINST.items():
                physics = _joined(r.series.left_by(against) for r in records)
                left_share = np.mean((error - predicted) ** 2) / np.mean(physics**2)
                figures[f"{role}_{key}"] = 100.0 * (1.0 - float(left_share))
            figures[f"{role}_rmse_mv"] = MV_PER_V * rmse(error, predicted)
            before = _joined(r.series.before_depletion for r in records)
            if before.any() and not before.all():
                figures[f"{role}_until_ran_out_rmse_mv"] = MV_PER_V * rms((error - predicted)[before])
    test = judged["test"]
    figures["diverged"] = sum(r.free.diverged_at is not None for r in test)
    figures["outside_pct"] = 100.0 * float(np.mean(_joined(r.free.outside for r in test)))
    return figures


def _one_step(judged: Mapping[Role, Sequence[_Judged]]) -> dict[str, float]:
    """RMSE one step ahead, mV, by role, and that of persistence (repeating the last error) on the test records."""
    figures = {}
    for role, records in judged.items():
        if records:
            figures[f"{role}_rmse_mv"] = _rms_mv(r.one_step.scored_v for r in records)
    figures["persistence_rmse_mv"] = _rms_mv(r.one_step.persistence_v for r in judged["test"])
    return figures


def _one_step_intervals(one: Fitted, test: Sequence[_Judged]) -> dict[str, Any]:
    """Scores of the model's intervals one step ahead and of other methods, on the test records; empty if it has
    none."""
    if one.intervals is None:
        return {}
    rows = [r.one_step for r in test]
    residuals = [each.scored_v for each in rows]
    return {
        "intervals": _interval_figures(rows, [r.intervals for r in test], residuals, one.intervals.alpha),
        "intervals_by_method": {
            name: _interval_figures(rows, [r.compared[name] for r in test], residuals, each.alpha)
            for name, each in one.compared.items()
        },
    }


def _free_run_intervals(
    one: Fitted, test: Sequence[_Judged], ahead: Mapping[float, Sequence[Array]]
) -> dict[str, Any]:
    """Scores of the model's bands on the test records, over whole drives and by horizon; empty if it has none.

    ahead : the errors of `_ahead`.
    """
    if one.bands is None:
        return {}
    residuals = [r.series.error_v - r.free.error_v for r in test]
    bands = [r.bands for r in test]
    whole = _interval_figures([r.series for r in test], bands, residuals, one.bands.alpha) | _start_figures(
        test
    )
    return {
        "free_run_intervals": whole | _inside_coverage(bands, residuals) | _left_out(one.bands.horizons[-1]),
        "bands_by_horizon": {
            _seconds(band.horizon_s): _horizon_figures(one, one.bands, band, test, ahead[band.horizon_s])
            for band in one.bands.horizons
            if band.horizon_s in ahead
        },
    }


def _start_figures(test: Sequence[_Judged]) -> dict[str, float]:
    """RMS change of the voltage, V, by one standard deviation of the initial states of charge of the test records;
    empty if all of these are known."""
    worth = [np.zeros(len(r.series)) if r.series.start_v is None else r.series.start_v for r in test]
    start_v = rms(_joined(worth))
    return {"start_v": start_v} if start_v > 0.0 else {}


def _record_figures(one: Fitted, record: _Judged) -> dict[str, float | None]:
    """Figures of one record in free run, and how far it lies outside the range that a correction was trained on."""
    series, model = record.series, one.model
    left, declared = series.error_v - record.free.error_v, series.left_by(DECLARED)
    kept = model.kept(series) if isinstance(model, SparseModel) else np.ones(len(series))
    visited, before = trained_on(model, one.bands), series.before_depletion
    ran_out = {} if before.all() else {"ran_out_s": series.ran_out_s}
    if ran_out and before.any():
        ran_out["until_ran_out_mv"] = MV_PER_V * rms(left[before])
    return {
        "rmse_mv": MV_PER_V * rms(left),
        **ran_out,
        "mser_pct": 100.0 * (1.0 - float(np.mean(left**2) / np.mean(declared**2))),
        **trained_figures(record.free.outside, series.temperature_degc, model, visited, kept),
    }


def _ahead(one: Fitted, test: Sequence[_Judged]) -> dict[float, list[Array]]:
    """Horizon of each band, s -> errors along each test record, (n,) V, of predictions from the voltage measured that
    long before; NaN at the beginning (`error_ahead`)."""
    finite = () if one.bands is None else (b.horizon_s for b in one.bands.horizons if isfinite(b.horizon_s))
    return {h: [error_ahead(one.model, r.series, h) for r in test] for h in finite}


def _k_step(one: Fitted, test: Sequence[_Judged]) -> dict[str, dict[str, float]]:
    """RMSE on the test records by horizon, mV, at the rows as measured, and that of persistence. The horizons are those
    of the tables that are multiples of the records' time step."""
    ours, held = {}, {}
    for horizon in in_whole_steps(test[0].series.dt_s):
        rows = [rows_ahead(one.model, r.series, r.series.steps(horizon)) for r in test]
        ours[_seconds(horizon)] = _rms_mv(each.scored_v for each in rows)
        held[_seconds(horizon)] = _rms_mv(each.persistence_v for each in rows)
    return {"k_step": ours, "k_step_persistence": held}


def _horizon_figures(
    one: Fitted, bands: FreeRunBands, band: HorizonBand, test: Sequence[_Judged], left: Sequence[Array]
) -> dict[str, float]:
    intervals = [
        bands.intervals(r.series, r.free, reach(one.model, r.series, band.horizon_s), band.horizon_s)
        for r in test
    ]
    figures = _interval_figures([r.series for r in test], intervals, left, bands.alpha)
    return figures | _inside_coverage(intervals, left) | _left_out(band)


def _inside_coverage(intervals: Sequence[Intervals | None], residuals: Sequence[Array]) -> dict[str, float]:
    """Coverage over the rows within the trained range, per cent, for which alone the band is calibrated; NaN without
    such rows."""
    covered = [
        each.covers(residual)[each.warm & np.isfinite(residual)]
        for each, residual in zip(intervals, residuals, strict=True)
        if each is not None
    ]
    inside = _joined(covered)
    return {"inside_coverage_pct": 100.0 * float(np.mean(inside)) if inside.size else float("nan")}


def _left_out(band: HorizonBand) -> dict[str, float]:
    """Number of calibration pieces, and the lowest coverage of one of them, per cent, with bands scaled by the others.
    It says what to expect of a single drive."""
    return {
        "pieces": len(band.by_piece),
        "worst_piece_coverage_pct": 100.0 * min(band.by_piece),
    }


def _rms_mv(left_v: Iterable[Array]) -> float:
    """RMS over all finite errors of all records, mV; NaN for fewer than `LEAST_ROWS`.  left_v : (n_i,) V per record."""
    joined = _joined(left_v)
    scored = joined[np.isfinite(joined)]
    return MV_PER_V * rms(scored) if scored.size >= LEAST_ROWS else float("nan")


def _interval_figures(
    test: Sequence[ErrorSeries | RowsAhead],
    intervals: Sequence[Intervals | None],
    residuals: Sequence[Array],
    alpha: float,
) -> dict[str, float]:
    """Scores of intervals over all test records together: coverages in per cent, widths and scores in V; NaN for fewer
    rows than `LEAST_ROWS`. A bin of current and state of charge can have samples of several records, a minute cannot.
    """
    if np.count_nonzero(np.isfinite(_joined(residuals))) < LEAST_ROWS:
        residuals = [np.full(len(left_v), np.nan) for left_v in residuals]
    known = [each for each in intervals if each is not None]
    together = Intervals(
        lower_v=_joined(each.lower_v for each in known),
        upper_v=_joined(each.upper_v for each in known),
        warm=_joined(each.warm for each in known),
    )
    scores = scores_of(
        together,
        _joined(residuals),
        alpha,
        current_a=_joined(r.current_a for r in test),
        soc=_joined(r.soc for r in test),
    )
    covered = [_covered_on_grid(*of_record) for of_record in zip(test, intervals, residuals, strict=True)]
    return {
        "nominal_pct": 100.0 * (1.0 - alpha),
        "coverage_pct": 100.0 * scores.coverage,
        "average_width_v": scores.mean_width_v,
        "winkler_v": scores.interval_score_v,
        "worst_bin_coverage_pct": 100.0 * scores.worst_bin_coverage,
        "low_minutes_pct": 100.0 * low_minute_share(covered, test[0].dt_s),
    }


def _covered_on_grid(record: ErrorSeries | RowsAhead, intervals: Intervals | None, left_v: Array) -> Array:
    """(steps,) 1 where an interval holds the error left_v (n,) V, 0 where not, at each step of the even grid; NaN for a
    step without a scored row."""
    at = record.stamps if isinstance(record, RowsAhead) else np.arange(len(left_v))
    out = np.full(int(at.max(initial=-1)) + 1, np.nan)
    if intervals is not None:
        out[at] = np.where(np.isfinite(left_v), intervals.covers(left_v), np.nan)
    return out


def _prediction(record: _Judged) -> ModelVoltage:
    model_v, ahead = record.series.model_v, record.one_step
    # A time of the even grid shows the prediction of the next measured row.
    at = np.minimum(np.searchsorted(ahead.stamps, np.arange(len(model_v))), len(ahead.stamps) - 1)
    free_v, step_v = model_v + record.free.error_v, model_v + ahead.predicted_v[at]
    bands, intervals = record.bands, record.intervals
    return ModelVoltage(
        free_run_v=free_v,
        free_run_lower_v=None if bands is None else free_v + bands.lower_v,
        free_run_upper_v=None if bands is None else free_v + bands.upper_v,
        one_step_v=step_v,
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


def _seconds(horizon_s: float) -> str:
    return f"{horizon_s:g}"


def _joined(arrays: Iterable[Any]) -> Any:
    return np.concatenate(list(arrays))
