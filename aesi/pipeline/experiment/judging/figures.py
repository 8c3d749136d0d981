"""The figures of a model on the records of an experiment: a row of summary.json, which tables and reports read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from aesi.conformal import FreeRunBands, Intervals
from aesi.conformal.horizon_band import HorizonBand
from aesi.conformal.scores import low_minute_share, scores_of
from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms, rmse
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.intervals.bands import error_ahead, reach
from aesi.pipeline.experiment.judging.predictions import RecordPredictions
from aesi.pipeline.experiment.judging.reductions import AGAINST
from aesi.pipeline.experiment.physics_models import DECLARED
from aesi.pipeline.product.one_step import LEAST_ROWS, RowsAhead, rows_ahead
from aesi.pipeline.product.trained import trained_figures, trained_on
from aesi.records import ErrorSeries, Role
from aesi.records.horizons import in_whole_steps
from aesi.sparse import SparseModel


def model_figures(
    one: Fitted, by_role: Mapping[Role, Sequence[RecordPredictions]], seconds: float
) -> dict[str, Any]:
    """The row of a model in summary.json: the errors in free run and one step ahead by role, and all other figures on
    the test records alone.

    by_role : the predictions of the model on the records of each role.  seconds : wall time of fit and evaluation, s.
    """
    test = by_role["test"]
    return {
        "name": one.model.name,
        "terms": one.terms,
        "seconds": round(seconds, 3),
        "free_run": _free_run_figures(by_role),
        "one_step": _one_step_figures(by_role),
        **_k_step_figures(one, test),
        "test_records": {r.series.name: _record_figures(one, r) for r in test},
        **_one_step_interval_figures(one, test),
        **_band_figures(one, test),
    }


def _free_run_figures(by_role: Mapping[Role, Sequence[RecordPredictions]]) -> dict[str, float]:
    """Figures in free run.

    By role, over all its records: the reduction of the mean squared error of the declared and of the recalibrated
    physics, per cent; the RMSE, mV; and, if a simulation ran out of lithium or salt, the RMSE over the rows before.
    Of the test records also the number of diverged runs and the share of rows outside the trained range, per cent.
    """
    figures: dict[str, float] = {}
    for role, records in by_role.items():
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
    test = by_role["test"]
    figures["diverged"] = sum(r.free.diverged_at is not None for r in test)
    figures["outside_pct"] = 100.0 * float(np.mean(_joined(r.free.outside for r in test)))
    return figures


def _one_step_figures(by_role: Mapping[Role, Sequence[RecordPredictions]]) -> dict[str, float]:
    """RMSE one step ahead, mV, by role, and that of persistence (repeating the last error) on the test records."""
    figures = {}
    for role, records in by_role.items():
        if records:
            figures[f"{role}_rmse_mv"] = _rms_mv(r.one_step.scored_v for r in records)
    figures["persistence_rmse_mv"] = _rms_mv(r.one_step.persistence_v for r in by_role["test"])
    return figures


def _k_step_figures(one: Fitted, test: Sequence[RecordPredictions]) -> dict[str, dict[str, float]]:
    """RMSE on the test records by horizon, mV, at the rows as measured, and that of persistence. The horizons are those
    of the tables that are multiples of the records' time step."""
    ours, held = {}, {}
    for horizon in in_whole_steps(test[0].series.dt_s):
        rows = [rows_ahead(one.model, r.series, r.series.steps(horizon)) for r in test]
        ours[_seconds(horizon)] = _rms_mv(each.scored_v for each in rows)
        held[_seconds(horizon)] = _rms_mv(each.persistence_v for each in rows)
    return {"k_step": ours, "k_step_persistence": held}


def _record_figures(one: Fitted, record: RecordPredictions) -> dict[str, float | None]:
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


def _one_step_interval_figures(one: Fitted, test: Sequence[RecordPredictions]) -> dict[str, Any]:
    """Scores of the model's intervals one step ahead and of other methods, on the test records; empty if it has
    none."""
    if one.intervals is None:
        return {}
    rows = [r.one_step for r in test]
    intervals = [r.intervals for r in test if r.intervals is not None]  # each has them where the model has
    residuals = [each.scored_v for each in rows]
    return {
        "intervals": _interval_figures(rows, intervals, residuals, one.intervals.alpha),
        "intervals_by_method": {
            name: _interval_figures(rows, [r.compared[name] for r in test], residuals, each.alpha)
            for name, each in one.compared.items()
        },
    }


def _band_figures(one: Fitted, test: Sequence[RecordPredictions]) -> dict[str, Any]:
    """Scores of the model's bands on the test records, over whole drives and by horizon; empty if it has none."""
    if one.bands is None:
        return {}
    residuals = [r.series.error_v - r.free.error_v for r in test]
    bands = [r.bands for r in test if r.bands is not None]  # each has them where the model has
    whole = _interval_figures([r.series for r in test], bands, residuals, one.bands.alpha)
    whole |= _start_figures(test) | _inside_coverage(bands, residuals)
    return {
        "free_run_intervals": whole | _piece_figures(one.bands.horizons[-1]),
        "bands_by_horizon": {
            _seconds(band.horizon_s): _horizon_figures(one, one.bands, band, test)
            for band in one.bands.horizons
            if isfinite(band.horizon_s)
        },
    }


def _start_figures(test: Sequence[RecordPredictions]) -> dict[str, float]:
    """RMS change of the voltage, V, by one standard deviation of the initial states of charge of the test records;
    empty if all of these are known."""
    worth = [np.zeros(len(r.series)) if r.series.start_v is None else r.series.start_v for r in test]
    start_v = rms(_joined(worth))
    return {"start_v": start_v} if start_v > 0.0 else {}


def _horizon_figures(
    one: Fitted, bands: FreeRunBands, band: HorizonBand, test: Sequence[RecordPredictions]
) -> dict[str, float]:
    """Scores of the band at one horizon on predictions from the voltage measured that long before."""
    left = [error_ahead(one.model, r.series, band.horizon_s) for r in test]
    intervals = [
        bands.intervals(r.series, r.free, reach(one.model, r.series, band.horizon_s), band.horizon_s)
        for r in test
    ]
    figures = _interval_figures([r.series for r in test], intervals, left, bands.alpha)
    return figures | _inside_coverage(intervals, left) | _piece_figures(band)


def _inside_coverage(intervals: Sequence[Intervals], residuals: Sequence[Array]) -> dict[str, float]:
    """Coverage over the rows within the trained range, per cent, for which alone the band is calibrated; NaN without
    such rows."""
    covered = [
        each.covers(residual)[each.warm & np.isfinite(residual)]
        for each, residual in zip(intervals, residuals, strict=True)
    ]
    inside = _joined(covered)
    return {"inside_coverage_pct": 100.0 * float(np.mean(inside)) if inside.size else float("nan")}


def _piece_figures(band: HorizonBand) -> dict[str, float]:
    """Number of calibration pieces, and the lowest coverage of one of them, per cent, with bands scaled by the others.
    It says what to expect of a single drive."""
    return {
        "pieces": len(band.by_piece),
        "worst_piece_coverage_pct": 100.0 * min(band.by_piece),
    }


def _interval_figures(
    test: Sequence[ErrorSeries | RowsAhead],
    intervals: Sequence[Intervals],
    residuals: Sequence[Array],
    alpha: float,
) -> dict[str, float]:
    """Scores of intervals over all test records together: coverages in per cent, widths and scores in V; NaN for fewer
    rows than `LEAST_ROWS`. A bin of current and state of charge can have samples of several records, a minute cannot.
    """
    if np.count_nonzero(np.isfinite(_joined(residuals))) < LEAST_ROWS:
        residuals = [np.full(len(left_v), np.nan) for left_v in residuals]
    together = Intervals(
        lower_v=_joined(each.lower_v for each in intervals),
        upper_v=_joined(each.upper_v for each in intervals),
        warm=_joined(each.warm for each in intervals),
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


def _covered_on_grid(record: ErrorSeries | RowsAhead, intervals: Intervals, left_v: Array) -> Array:
    """(steps,) 1 where an interval holds the error left_v (n,) V, 0 where not, at each step of the even grid; NaN for a
    step without a scored row."""
    at = record.stamps if isinstance(record, RowsAhead) else np.arange(len(left_v))
    out = np.full(int(at.max(initial=-1)) + 1, np.nan)
    out[at] = np.where(np.isfinite(left_v), intervals.covers(left_v), np.nan)
    return out


def _rms_mv(left_v: Iterable[Array]) -> float:
    """RMS over all finite errors of all records, mV; NaN for fewer than `LEAST_ROWS`.  left_v : (n_i,) V per record."""
    joined = _joined(left_v)
    scored = joined[np.isfinite(joined)]
    return MV_PER_V * rms(scored) if scored.size >= LEAST_ROWS else float("nan")


def _seconds(horizon_s: float) -> str:
    return f"{horizon_s:g}"


def _joined(arrays: Iterable[Any]) -> Any:
    return np.concatenate(list(arrays))
