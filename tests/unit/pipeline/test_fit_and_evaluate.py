"""Load, fit, conformalise, judge: on a record whose answer is known (1.5 mohm too little declared)."""

from dataclasses import replace

import numpy as np
import pytest
from small_experiment import NOISE_V, experiment, fitted, write_record

from aesi.errors import DataError
from aesi.pipeline.experiment.judging.evaluate import evaluate_models
from aesi.pipeline.experiment.load import load
from aesi.pipeline.report.tables import free_run_band_table, record_table


@pytest.fixture(scope="module")
def evaluation(record):
    loaded, _, models = fitted(record)
    return evaluate_models(models, loaded.split)


def row(evaluation, name):
    return next(each for each in evaluation.rows if each["name"] == name)


def test_the_error_is_the_missing_resistance(record):
    split = load(experiment(record)).split
    assert [series.name for series in split.train] == ["repeat 1", "repeat 3", "repeat 5"]
    assert not split.valid
    for series in (*split.train, *split.test):
        rest = series.error_v + 1.5e-3 * series.current_a
        assert np.std(rest) == pytest.approx(NOISE_V, rel=0.1)


def test_each_test_record_has_the_figures_that_were_pooled(evaluation):
    figures = row(evaluation, "AESI I")
    assert list(figures["test_records"]) == ["repeat 2", "repeat 4"]
    each = figures["test_records"].values()
    pooled = np.sqrt(np.mean([one["rmse_mv"] ** 2 for one in each]))  # they are equally long
    assert figures["free_run"]["test_rmse_mv"] == pytest.approx(pooled)
    outside = np.mean([one["outside_pct"] for one in each])
    assert figures["free_run"]["outside_pct"] == pytest.approx(outside)
    assert {one["kept_pct"] for one in each} == {None}  # it does not fade
    table = record_table(evaluation.rows)
    assert [cells[0] for cells in table.rows][2:4] == ["AESI I, repeat 2", "AESI I, repeat 4"]
    assert not record_table([figures | {"test_records": {"alone": next(iter(each))}}]).rows


def test_the_error_of_a_record_on_which_the_model_ran_empty_was_told_without_a_time(record):
    loaded, _, models = fitted(record)
    first, second = loaded.split.test
    at_s = float(first.time_s[400])
    tests = (replace(first, ran_out_s=at_s), second)
    (figures,) = evaluate_models(models[:1], replace(loaded.split, test=tests)).rows
    of_first, of_second = figures["test_records"].values()
    before_v = first.error_v[:400]
    assert of_first["ran_out_s"] == at_s
    assert of_first["until_ran_out_mv"] == pytest.approx(1e3 * np.sqrt(np.mean(before_v**2)))
    assert "ran_out_s" not in of_second
    pooled_v = np.concatenate([before_v, second.error_v])
    left_mv = figures["free_run"]["test_until_ran_out_rmse_mv"]
    assert left_mv == pytest.approx(1e3 * np.sqrt(np.mean(pooled_v**2)))
    emptied = replace(first, ran_out_s=float(first.time_s[0]))  # no row before
    (none,) = evaluate_models(models[:1], replace(loaded.split, test=(emptied,))).rows
    assert "test_until_ran_out_rmse_mv" not in none["free_run"]
    assert none["test_records"][first.name]["ran_out_s"] == 0.0 + first.time_s[0]


def test_a_record_that_is_trained_on_may_not_judge(record, tmp_path):
    same = tmp_path / "the_same.csv"
    same.write_bytes(record.read_bytes())
    other = write_record(tmp_path, "other.csv", 3)
    for train, valid, test in (([record], [], [record]), ([record], [], [same]), ([other], [same], [record])):
        roles = {"train": train, "valid": valid, "test": test}
        data = {"kind": "files", **{role: [str(path) for path in paths] for role, paths in roles.items()}}
        with pytest.raises(DataError, match="among the data and the tests; what is fitted cannot judge"):
            load(experiment(record, data=data))


def test_a_validation_share_is_cut_from_the_end_of_every_training_repeat(record):
    config = experiment(record)
    repeats = config.data.repeats.model_copy(update={"valid_share": 0.25})
    split = load(
        config.model_copy(update={"data": config.data.model_copy(update={"repeats": repeats})})
    ).split
    assert [len(series) for series in split.train] == [450, 450, 450]
    assert [len(series) for series in split.valid] == [150, 150, 150]


def test_a_repeat_the_record_does_not_have_is_named(record):
    config = experiment(record)
    repeats = config.data.repeats.model_copy(update={"test": (9,)})
    with pytest.raises(DataError, match="has no repeat 9 of 600 s"):
        load(config.model_copy(update={"data": config.data.model_copy(update={"repeats": repeats})}))


def test_a_period_of_a_row_was_told_as_a_repeat_that_is_not_there(record):
    config = experiment(record)
    repeats = config.data.repeats.model_copy(update={"period_s": 1.0})
    with pytest.raises(DataError, match="a repeat of 1 s holds no two rows 1 s apart"):
        load(config.model_copy(update={"data": config.data.model_copy(update={"repeats": repeats})}))


def test_a_repeat_that_the_record_ends_in_passed_for_a_whole_one(record):
    config = experiment(record)
    assert not any("the record ends" in note for note in load(config).notes)
    repeats = config.data.repeats.model_copy(update={"period_s": 700.0})  # of a record of 3,000 s
    loaded = load(config.model_copy(update={"data": config.data.model_copy(update={"repeats": repeats})}))
    assert "repeat 5 has 199 s of the 700 s of a period: the record ends in it." in loaded.notes
    assert len(loaded.split.train[-1]) == 200


def test_the_correction_finds_the_ohmic_drop_in_free_run(evaluation):
    assert row(evaluation, "ESPM")["free_run"]["test_mser_pct"] == pytest.approx(0.0, abs=1e-9)
    # What is left is the noise: of about 45 mV of drop, 1 mV.
    for name in ("AESI I", "AESI II"):
        assert row(evaluation, name)["free_run"]["test_rmse_mv"] < 2.5


def test_one_step_stands_beside_persistence(evaluation):
    step = row(evaluation, "AESI I")["one_step"]
    assert step["test_rmse_mv"] < step["persistence_rmse_mv"]
    horizons = row(evaluation, "AESI I")["k_step"]
    assert set(horizons) == {"1", "10", "60"}


LAGS = 60
"""Samples, three times what the current is held for."""


def independent_share(records) -> float:
    """Of samples that come after each other, as far as the count of those beyond a limit on either side tells.

    Where two normal variables correlate by r, whether each lies within such a limit correlates by at most r**2 (the
    expansion in Hermite polynomials has even orders alone), so n of them say as much as n / (1 + 2 sum r_k**2).
    """
    centred = [each - each.mean() for each in records]
    square = sum(each @ each for each in centred)
    r = [sum(each[k:] @ each[:-k] for each in centred) / square for k in range(1, LAGS + 1)]
    return 1.0 / (1.0 + 2.0 * float(np.sum(np.square(r))))


def test_samples_that_follow_each_other_were_counted_as_independent():
    rng = np.random.default_rng(0)
    shares, means = [], []
    for _ in range(300):
        each = rng.standard_normal(1200)
        for k in range(1, len(each)):
            each[k] = 0.9 * each[k - 1] + np.sqrt(1 - 0.9**2) * each[k]
        shares.append(independent_share([each]))
        means.append(np.mean(np.abs(each) < 1.645))
    of_all, of_the_independent = (np.sqrt(0.09 / (1200 * share)) for share in (1.0, np.mean(shares)))
    # A standard deviation from 300 draws is known to 4 %.
    assert 1.5 * of_all < np.std(means) < 1.1 * of_the_independent


def test_intervals_cover_about_what_they_claim(evaluation):
    tests, training = (
        [trace for trace in evaluation.traces if trace.role == role] for role in ("test", "train")
    )
    rows, calibrated = (sum(len(trace.time_s) - 1 for trace in traces) for traces in (tests, training))
    for name in ("ESPM", "AESI I", "AESI II"):
        intervals = row(evaluation, name)["intervals"]
        said = [trace.predictions[name] for trace in tests]
        # What is left within the interval, which follows the residuals before it: in half-widths from its middle.
        left = [
            ((2 * trace.measured_v - one.one_step_upper_v - one.one_step_lower_v)
             / (one.one_step_upper_v - one.one_step_lower_v))[1:]
            for trace, one in zip(tests, said, strict=True)
        ]  # fmt: skip
        # Of 1,198 test samples, and of 1,797 training samples by which the calibration varies.
        scatter = np.sqrt(0.1 * 0.9 * (1 / rows + 1 / calibrated) / independent_share(left))
        assert scatter < 0.02
        assert abs(intervals["coverage_pct"] - 90.0) < 3 * 100.0 * scatter
        assert intervals["average_width_v"] > 0


def test_bands_of_a_free_run_cover(evaluation):
    bands = row(evaluation, "AESI I")["free_run_intervals"]
    assert bands["coverage_pct"] > 80.0
    assert bands["average_width_v"] < 0.05


def test_what_an_uncertain_start_is_worth_stands_beside_the_width_of_the_band(record):
    loaded, _, models = fitted(record)
    judged = next(one for one in models if one.bands is not None)
    for worth_v in (None, 2e-3):
        tests = tuple(
            replace(one, start_v=None if worth_v is None else np.full(len(one), worth_v))
            for one in loaded.split.test
        )
        (figures,) = evaluate_models([judged], replace(loaded.split, test=tests)).rows
        assert figures["free_run_intervals"].get("start_v") == pytest.approx(worth_v)


def test_bands_are_judged_at_every_horizon(evaluation):
    found = row(evaluation, "AESI I")
    assert list(found["bands_by_horizon"]) == ["1", "10", "60"]
    for figures in (*found["bands_by_horizon"].values(), found["free_run_intervals"]):
        assert figures["coverage_pct"] > 75.0
        assert figures["winkler_v"] >= figures["average_width_v"] > 0
        assert figures["pieces"] >= 3
        assert 0 < figures["worst_piece_coverage_pct"] <= 100


def test_two_seconds_ahead_were_called_one_second(record):
    loaded, _, models = fitted(record, 2.0)
    bands = models[1].bands
    assert [band.horizon_s for band in bands.horizons] == [10.0, 60.0, np.inf]
    espm, aesi, _ = evaluate_models(models, loaded.split).rows
    for figures in (espm["k_step"], espm["k_step_persistence"], aesi["bands_by_horizon"]):
        assert list(figures) == ["10", "60"]
    held = []
    for (
        one
    ) in loaded.split.test:  # rows of a second: the last of each step, 10 s or 5 steps after what is repeated
        last = one.own.error_v[np.searchsorted(one.own.time_s, one.time_s)]
        held.append(last[5:] - one.with_known_error.error_v[:-5])
    assert espm["k_step_persistence"]["10"] == pytest.approx(1e3 * np.sqrt(np.mean(np.square(held))))


def test_the_table_of_bands_has_a_row_for_each_horizon(evaluation):
    table = free_run_band_table([row(evaluation, "AESI I")])
    assert [cells[0] for cells in table.rows] == [
        "AESI I, 1 s",
        "AESI I, 10 s",
        "AESI I, 60 s",
        "AESI I, whole drive",
    ]
    assert {"coverage, %", "average width, mV", "Winkler, mV", "pieces"} <= set(table.header)


def test_every_record_has_a_trace_of_every_model(evaluation):
    assert [trace.role for trace in evaluation.traces] == ["train"] * 3 + ["test"] * 2
    for trace in evaluation.traces:
        assert set(trace.predictions) == {"ESPM", "AESI I", "AESI II"}
        assert len(trace.measured_v) == len(trace.predictions["AESI I"].free_run_v)


def test_other_methods_stand_beside_the_chosen_one(evaluation):
    by_method = row(evaluation, "AESI I")["intervals_by_method"]
    assert set(by_method) == {"split", "enbpi", "spci_refitted", "spci_linear"}
    assert all(figures["average_width_v"] > 0 for figures in by_method.values())
    assert row(evaluation, "ESPM")["intervals_by_method"] == {}
