"""One step ahead, judged on what was measured: neither what was filled in between rows, nor averages over a step."""

from dataclasses import replace

import numpy as np
import pytest
from small_experiment import SOC0, fitted, write_record

import aesi
from aesi.pipeline.experiment.judging.evaluate import evaluate_models
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.product.one_step import rows_ahead
from aesi.records import ErrorSeries
from aesi.sparse.bare import Bare

NOISE_V = 10e-3
FEW_ROWS = 0.05
"""Noise of some 1,000 rows tells its own deviation to 2 %; what a fit of so few adds is as much."""


class Held:
    """Repeats the last error."""

    name = "held"

    def k_step(self, series, steps):
        return np.concatenate([series.error_v[:steps], series.error_v[:-steps]])


def series_of(time_s, stamps_s, error_v):
    def of(times_s, errors_v):
        n = len(times_s)
        values = np.zeros((n, 1)), np.full(n, 0.5), np.full(n, 3.7)
        return ErrorSeries("drive", 1.0, times_s, errors_v, *values, ("I",))

    filled_v = np.interp(stamps_s, time_s, error_v)
    return replace(of(stamps_s, filled_v), own=of(time_s, error_v))


def test_every_row_is_predicted_from_rows_before_it_alone():
    error_v = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    series = series_of(np.array([0.0, 1.2, 2.4, 3.6, 4.8]), np.arange(5.0), error_v)
    ahead = rows_ahead(Held(), series)
    np.testing.assert_array_equal(ahead.stamps, [0, 2, 3, 4])
    np.testing.assert_array_equal(
        ahead.error_v, [1.0, 2.0, 3.0, 5.0]
    )  # the last stands behind the last stamp
    np.testing.assert_array_equal(ahead.predicted_v, [1.0, 1.0, 2.0, 3.0])
    np.testing.assert_array_equal(ahead.scored_v, [np.nan, 1.0, 1.0, np.nan])
    np.testing.assert_array_equal(ahead.persistence_v, ahead.scored_v)
    np.testing.assert_array_equal(ahead.of(slice(2, 4)), [False, True, True, False])


def test_of_rows_denser_than_a_step_the_last_is_predicted_from_the_mean_of_those_before():
    error_v = np.array([1.0, 2.0, 4.0, 6.0, 9.0])
    ahead = rows_ahead(Held(), series_of(0.5 * np.arange(5), np.arange(3.0), error_v))
    np.testing.assert_array_equal(ahead.error_v, [1.0, 4.0, 9.0])
    np.testing.assert_array_equal(ahead.scored_v, [np.nan, 3.0, 6.0])


def test_a_row_with_none_a_step_before_it_is_no_prediction_one_step_ahead():
    ahead = rows_ahead(Held(), series_of(np.array([0.0, 1.0, 4.0, 5.0]), np.arange(6.0), np.arange(4.0)))
    np.testing.assert_array_equal(ahead.scored_v, [np.nan, 1.0, np.nan, 1.0])
    np.testing.assert_array_equal(rows_ahead(Held(), SEVERAL, 2).scored_v, [np.nan, np.nan, 2.0, 2.0])


def test_rows_some_steps_after_a_gap_were_judged_by_what_was_known_before_it():
    time_s = np.concatenate([np.arange(20.0), np.arange(50.0, 70.0)])
    series = series_of(time_s, np.arange(70.0), time_s)  # an error that grows by one each second
    ahead = rows_ahead(Held(), series, 5)
    assert np.array_equal(ahead.stamps, time_s)
    scored = np.isfinite(ahead.persistence_v)
    # From 50 s on a measured error is known, so that 55 s is the first row that is five steps ahead of one.
    np.testing.assert_array_equal(time_s[scored], [*range(5, 20), *range(55, 70)])
    np.testing.assert_array_equal(ahead.persistence_v[scored], 5.0)


SEVERAL = replace(series_of(np.arange(4.0), np.arange(4.0), np.arange(4.0)), own=None)


def test_physics_alone_is_judged_at_its_own_current_of_the_row():
    series = series_of(np.array([0.0, 0.9, 1.8]), np.arange(2.0), np.array([1.0, 2.0, 4.0]))
    own = replace(series.own, physics={"other": np.array([3.7, 3.8, 3.9])})
    ahead = rows_ahead(Bare("other"), replace(series, own=own))
    np.testing.assert_allclose(ahead.residual_v[1:], own.left_by("other")[2:])
    np.testing.assert_allclose(rows_ahead(Bare("another"), replace(series, own=own)).residual_v[1:], [4.0])


@pytest.fixture(scope="module", params=[1.0, 1.2, 0.25])
def noisy(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("rows")
    record = write_record(folder, every_s=request.param, noise_v=NOISE_V)
    loaded, _, models = fitted(record)
    return request.param, folder, loaded, models, evaluate_models(models, loaded.split)


def test_errors_one_step_ahead_came_out_below_the_noise_of_what_is_measured(noisy):
    every_s, _, _, _, evaluation = noisy
    figures = next(each for each in evaluation.rows if each["name"] == "AESI I")
    noise_mv = 1e3 * NOISE_V
    known_mv = noise_mv * np.sqrt(min(every_s, 1.0))  # of the rows of a step, averaged
    assert noise_mv * (1 - FEW_ROWS) < figures["one_step"]["test_rmse_mv"] < 1.2 * noise_mv
    assert figures["one_step"]["persistence_rmse_mv"] > np.hypot(noise_mv, known_mv) * (1 - FEW_ROWS)
    assert figures["k_step"]["1"] == figures["one_step"]["test_rmse_mv"]
    assert figures["intervals"]["coverage_pct"] == pytest.approx(90.0, abs=3.0)
    # Of normal noise a band of 90 % is 3.29 deviations wide.
    assert figures["intervals"]["average_width_v"] > 3.29 * NOISE_V * (1 - FEW_ROWS)


def test_single_rows_of_another_record_are_covered_as_often_as_is_said(noisy):
    every_s, folder, loaded, models, _ = noisy
    one = next(each for each in models if each.model.name == "AESI I")
    hybrid = HybridModel(
        loaded.cell, correction=one.model, intervals=one.intervals, dt_s=1.0, hold="backward", soc0=SOC0
    )
    data = aesi.read_measurement(write_record(folder, "other.csv", 1, every_s, NOISE_V))
    said = hybrid.predict_record(data, SOC0, one_step=True)
    covered = (data.voltage_v >= said.lower_v) & (data.voltage_v <= said.upper_v)
    assert np.mean(covered[np.isfinite(said.lower_v)]) == pytest.approx(0.9, abs=0.03)


def test_rows_further_apart_than_steps_were_judged_one_step_ahead(noisy):
    _, _, loaded, models, _ = noisy
    test = loaded.split.test[0]
    seldom = replace(test, own=test.take(slice(0, len(test), 10)))
    rows = evaluate_models(models, replace(loaded.split, test=(seldom,))).rows
    for each in rows:
        assert np.isnan([each["one_step"]["test_rmse_mv"], each["intervals"]["coverage_pct"]]).all()
        assert np.isfinite(each["free_run"]["test_rmse_mv"])


def test_rows_five_steps_apart_were_drawn_as_predicted_one_step_ahead(record):
    loaded, _, models = fitted(record)
    slow, dense = loaded.split.test
    slow = replace(slow, own=slow.take(slice(None, None, 5)))
    traces = evaluate_models(models[:1], replace(loaded.split, test=(slow, dense))).traces
    drawn = {trace.name: trace.predictions["ESPM"].one_step_v is not None for trace in traces}
    assert not drawn[slow.name]
    assert drawn[dense.name]
