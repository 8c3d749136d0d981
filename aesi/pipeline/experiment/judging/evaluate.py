"""Judge models that are already chosen: each regime by itself, each figure beside its baseline.

This is the only place that reads `Split.test`.
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
from aesi.conformal.scores import scores_of
from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms, rmse
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.intervals.bands import error_ahead, reach
from aesi.pipeline.experiment.judging.reductions import AGAINST
from aesi.pipeline.experiment.physics_models import DECLARED
from aesi.pipeline.product.one_step import RowsAhead, rows_ahead
from aesi.pipeline.product.trained import outside_trained, trained_figures, trained_on
from aesi.pipeline.report.views import ModelVoltage, RecordTrace
from aesi.records import ROLES, ErrorSeries, FreeRun, Role, Split
from aesi.records.horizons import in_whole_steps
from aesi.sparse import SparseModel


@dataclass(frozen=True, eq=False)
class EvaluatedModels:
    """rows : one a model, as in summary.json.  traces : every record with every model's prediction."""

    rows: tuple[dict[str, Any], ...]
    traces: tuple[RecordTrace, ...]


@dataclass(frozen=True, eq=False)
class _Judged:
    """One model on one record, (n,) V each; bounds relative to the prediction, None where not calibrated.

    one_step : the measured rows, to which `intervals` and `compared` belong.
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
    """Figures of every model on train, validation and test records, and the traces that the report draws.

    validation : model -> reduction over drives that chose nothing, per cent (`judging.validation`).
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
    residual = ahead.left_v
    residual[0] = np.nan  # the first sample has no step before it
    return _Judged(
        series=series,
        free=free,
        one_step=ahead,
        intervals=None if one.intervals is None else one.intervals.intervals(residual, ahead.current_a),
        bands=None if one.bands is None else one.bands.intervals(series, free, reach(one.model, series)),
        compared={name: each.intervals(residual, ahead.current_a) for name, each in one.compared.items()}
        if role == "test"  # the tables show no other
        else {},
    )


def _row(one: Fitted, judged: Mapping[Role, Sequence[_Judged]], seconds: float) -> dict[str, Any]:
    """A model's row in summary.json: each regime on every part, all else on the test part alone."""
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
    """Figures in free run, by part: per cent taken off the squared error of each physics, and the error left, over
    the rows before a simulation ran out by itself; and how the test went."""
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
            runs = _joined(r.series.runs for r in records)
            if runs.any() and not runs.all():
                figures[f"{role}_until_ran_out_rmse_mv"] = MV_PER_V * rms((error - predicted)[runs])
    test = judged["test"]
    figures["diverged"] = sum(r.free.diverged_at is not None for r in test)
    figures["outside_pct"] = 100.0 * float(np.mean(_joined(r.free.outside for r in test)))
    return figures


def _one_step(judged: Mapping[Role, Sequence[_Judged]]) -> dict[str, float]:
    """Figures one step ahead, by part: the error left; and the error of holding the last one, on the test part."""
    figures = {}
    for role, records in judged.items():
        if records:
            figures[f"{role}_rmse_mv"] = _rms_mv(r.one_step.judged_v for r in records)
    figures["persistence_rmse_mv"] = _rms_mv(r.one_step.persistence_v for r in judged["test"])
    return figures


def _one_step_intervals(one: Fitted, test: Sequence[_Judged]) -> dict[str, Any]:
    """Scores of the model's intervals one step ahead and of the methods beside them; nothing where it has none."""
    if one.intervals is None:
        return {}
    rows = [r.one_step for r in test]
    residuals = [each.judged_v for each in rows]
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
    """Scores of the model's bands, over a whole drive and by horizon; nothing where it has none.  ahead : `_ahead`."""
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
    """What a standard deviation of the states of charge that the records start from is worth, V RMS; nothing where all
    of them are known."""
    worth = [np.zeros(len(r.series)) if r.series.start_v is None else r.series.start_v for r in test]
    start_v = rms(_joined(worth))
    return {"start_v": start_v} if start_v > 0.0 else {}


def _record_figures(one: Fitted, record: _Judged) -> dict[str, float | None]:
    """Figures of one record in free run, and how far it lies from what a correction was trained on."""
    series, model = record.series, one.model
    left, declared = series.error_v - record.free.error_v, series.left_by(DECLARED)
    kept = model.kept(series) if isinstance(model, SparseModel) else np.ones(len(series))
    visited, runs = trained_on(model, one.bands), series.runs
    ran_out = {} if runs.all() else {"ran_out_s": series.ran_out_s}
    if ran_out and runs.any():
        ran_out["until_ran_out_mv"] = MV_PER_V * rms(left[runs])
    return {
        "rmse_mv": MV_PER_V * rms(left),
        **ran_out,
        "mser_pct": 100.0 * (1.0 - float(np.mean(left**2) / np.mean(declared**2))),
        **trained_figures(record.free.outside, series.temperature_degc, model, visited, kept),
    }


def _ahead(one: Fitted, test: Sequence[_Judged]) -> dict[float, list[Array]]:
    """Horizon of each band in s -> (n,) V a test record: what a prediction from a measurement that long before left of
    the error; NaN where there is none so early."""
    finite = () if one.bands is None else (b.horizon_s for b in one.bands.horizons if isfinite(b.horizon_s))
    return {h: [error_ahead(one.model, r.series, h) for r in test] for h in finite}


def _k_step(one: Fitted, test: Sequence[_Judged]) -> dict[str, dict[str, float]]:
    """Errors of measured rows on the test part by horizon, and those of holding the last error for so long, at the
    horizons of the tables that the records' step divides."""
    ours, held = {}, {}
    for horizon in in_whole_steps(test[0].series.dt_s):
        rows = [rows_ahead(one.model, r.series, r.series.steps(horizon)) for r in test]
        ours[_seconds(horizon)] = _rms_mv(each.judged_v for each in rows)
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
    """Coverage of the rows inside the trained range, where alone the band is calibrated; NaN without such rows."""
    covered = [
        each.covers(residual)[each.warm & np.isfinite(residual)]
        for each, residual in zip(intervals, residuals, strict=True)
        if each is not None
    ]
    inside = _joined(covered)
    return {"inside_coverage_pct": 100.0 * float(np.mean(inside)) if inside.size else float("nan")}


def _left_out(band: HorizonBand) -> dict[str, float]:
    """Scores of the calibration pieces, each with the scale of the others: what to expect of one drive."""
    return {
        "pieces": len(band.by_piece),
        "worst_piece_coverage_pct": 100.0 * min(band.by_piece),
    }


def _rms_mv(left_v: Iterable[Array]) -> float:
    """mV, RMS over all records of what is scored of them; NaN where nothing is."""
    joined = _joined(left_v)
    scored = joined[np.isfinite(joined)]
    return MV_PER_V * rms(scored) if scored.size else float("nan")


def _interval_figures(
    test: Sequence[ErrorSeries | RowsAhead],
    intervals: Sequence[Intervals | None],
    residuals: Sequence[Array],
    alpha: float,
) -> dict[str, float]:
    """Scores over all test records together, so that a bin spread over records is one bin."""
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
        dt_s=test[0].dt_s,
    )
    return {
        "nominal_pct": 100.0 * (1.0 - alpha),
        "coverage_pct": 100.0 * scores.coverage,
        "average_width_v": scores.mean_width_v,
        "winkler_v": scores.interval_score_v,
        "worst_bin_coverage_pct": 100.0 * scores.worst_bin_coverage,
        "low_minutes_pct": 100.0 * scores.low_minutes,
    }


def _prediction(record: _Judged) -> ModelVoltage:
    model_v, ahead = record.series.model_v, record.one_step
    # What is drawn at a stamp is what was said of the next measured row.
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
