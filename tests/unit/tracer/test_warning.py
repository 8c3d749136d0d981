"""What the test part says against a verdict: more than a right model leaves, or worse than another model."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from aesi.tracer.decide.verdict import Verdict
from aesi.tracer.report.outcome import FileOutcome, rmse_difference
from aesi.tracer.report.warning import contradicted_by_v, warnings

NOISE_V = 1e-3
TOLERANCE_V = 0.6e-3


def outcome(after_v, part="test", before_v=9e-3, recalibrated_v=5e-3):
    time_s = np.arange(400.0)
    sign = np.where(time_s % 2, 1.0, -1.0)
    voltages = {"before": -before_v * sign, "recalibrated": -recalibrated_v * sign, "after": -after_v * sign}
    zeros = np.zeros(400)
    return FileOutcome("drive", part, time_s, zeros, zeros, zeros, NOISE_V, voltages, (0.0, 0.0, 0.0))


def verdict(word, *effects):
    return Verdict(word, effects, (), 0.7, 0.1e-3, TOLERANCE_V, "")


@pytest.mark.parametrize(("word", "effects"), [("found", ("series_resistance",)), ("none", ())])
def test_what_explains_the_data_and_not_the_test_part_is_contradicted(word, effects):
    right = NOISE_V * np.hypot(1.0, 0.5)
    wrong = NOISE_V * np.hypot(1.0, 2.0)
    said = verdict(word, *effects)
    assert contradicted_by_v([outcome(wrong, part="fit"), outcome(right)], said) is None
    assert warnings([outcome(wrong, part="fit"), outcome(right)], said) == ()
    assert contradicted_by_v([outcome(right, part="fit"), outcome(wrong)], said) == pytest.approx(2.0e-3)
    (sentence,) = warnings([outcome(wrong)], said)
    assert "2.00 mV" in sentence
    assert "0.60 mV" in sentence
    assert ("the finding" in sentence) == bool(effects)


def test_a_test_record_without_its_temperature_was_said_to_lack_an_effect():
    """A cell that warms by 2 K under load: 2.49 mV beyond the noise, 0.2 with its thermocouple given."""
    right, wrong = NOISE_V * np.hypot(1.0, 0.5), NOISE_V * np.hypot(1.0, 2.0)
    fitted, test = outcome(right, part="fit"), outcome(wrong)
    for at_its, advised in (((True, False), True), ((False, False), False), ((True, True), False)):
        files = [replace(f, at_its_temperature=has) for f, has in zip((fitted, test), at_its, strict=True)]
        (sentence,) = warnings(files, verdict("found", "series_resistance"))
        assert ("drive at that of the cell's file: give its own first" in sentence) == advised
        assert ("Another effect is missing" in sentence) != advised


def test_a_finding_that_is_not_written_was_contradicted_by_the_declared_model():
    right, wrong = NOISE_V * np.hypot(1.0, 0.5), NOISE_V * np.hypot(1.0, 2.0)
    said = verdict("found", "series_resistance")
    assert any("contradicts" in sentence for sentence in warnings([outcome(wrong)], said))
    told = warnings([outcome(wrong)], said, explained=[outcome(right)])
    assert not any("contradicts" in sentence for sentence in told)


def test_nothing_contradicts_an_unknown_or_a_discovery_without_a_test_part():
    assert contradicted_by_v([outcome(4e-3)], verdict("unknown")) is None
    assert contradicted_by_v([outcome(4e-3, part="fit")], verdict("found", "film_growth")) is None
    assert warnings([outcome(4e-3, part="fit")], verdict("found", "film_growth")) == ()


def test_a_test_record_that_started_under_load_contradicted_what_was_right():
    rng = np.random.default_rng(0)
    noise_v, slope_v = (
        NOISE_V * rng.normal(size=400),
        np.full(400, 15e-3),
    )  # of a state of charge read under load
    found = verdict("found", "series_resistance")
    started = replace(outcome(0.0), voltages={"after": -noise_v - 0.2 * slope_v}, start_slope_v=slope_v)
    assert contradicted_by_v([replace(started, start_slope_v=None)], found) is not None
    assert contradicted_by_v([started], found) is None
    wave_v = 3e-3 * np.sin(np.arange(400.0))
    wrong = replace(started, voltages={"after": -noise_v - 0.2 * slope_v - wave_v})
    assert contradicted_by_v([wrong], found) == pytest.approx(3e-3 / np.sqrt(2.0), rel=0.1)


def test_a_test_part_on_which_the_model_runs_empty_is_not_said_to_lack_physics():
    emptied = replace(outcome(0.9), emptied_s={"after": 320.0})
    first, *_ = warnings([emptied], verdict("found", "series_resistance"))
    assert "The model runs empty or full on drive at 320 s: check capacity" in first
    assert "Another effect" not in first
    since_1970 = replace(outcome(0.9), emptied_s={"after": 1.7e9 + 320.0})
    first, *_ = warnings([since_1970], verdict("found", "series_resistance"))
    assert "on drive at 1700000320 s" in first


def test_three_models_that_cannot_be_simulated_were_told_as_one():
    why = dict.fromkeys(("before", "recalibrated", "after"), "the electrolyte ran out of salt.")
    (told,) = warnings([replace(outcome(0.0), unsimulated=why)], verdict("unknown"))
    assert told == (
        "the declared model, the recalibrated model and the written model have no figures on the test part of drive, "
        "where they cannot be simulated: the electrolyte ran out of salt."
    )


def test_a_written_model_that_does_worse_than_others_is_told_with_each_of_them():
    (one,) = warnings([outcome(7e-3)], verdict("unknown"))
    assert (
        "is 7.00 mV with the written model and 5.00 mV with the recalibrated model: do not use the model in model/ on"
        in one
    )
    (both,) = warnings([outcome(12e-3)], verdict("unknown"))
    assert "and 9.00 mV with the declared model and 5.00 mV with the recalibrated model" in both
    assert warnings([outcome(5e-3)], verdict("unknown")) == ()
    (hardly,) = warnings([outcome(5.02e-3)], verdict("unknown"))
    assert hardly == (
        "the RMSE on the test part is 5.02 mV with the written model and 5.00 mV with the recalibrated model."
    )


def test_a_written_model_that_is_worse_than_declared_on_what_was_fitted_was_not_told_of():
    fitted = outcome(9.4e-3, part="fit")
    (sentence,) = warnings([fitted, outcome(4e-3)], verdict("unknown"))
    assert sentence == (
        "the RMSE on the fitted part, of the rows as measured, is 9.40 mV with the written model and 9.00 mV with the "
        "declared model and 5.00 mV with the recalibrated model."
    )
    (refit,) = warnings([outcome(7e-3, part="fit"), outcome(4e-3)], verdict("unknown"))
    assert "is 7.00 mV with the written model and 5.00 mV with the recalibrated model." in refit
    assert warnings([outcome(5.2e-3, part="fit"), outcome(4e-3)], verdict("found", "film_growth"))[1:] == ()
    assert warnings([outcome(9e-3, part="fit"), outcome(4e-3)], verdict("unknown")) == ()


def test_a_test_part_at_rest_was_taken_for_one_that_says_something_of_a_load():
    resting = outcome(4e-3)
    (sentence,) = warnings([resting], verdict("unknown"), rest_a=0.05)
    assert "the cell rests throughout the test part" in sentence
    loaded = replace(resting, current_a=np.full(400, 1.0))
    assert warnings([resting, loaded], verdict("unknown"), rest_a=0.05) == ()
    assert warnings([replace(resting, part="fit")], verdict("unknown"), rest_a=0.05) == ()


def test_resampled_blocks_of_steady_errors_have_the_gain_of_all_rows():
    time = np.arange(2000.0)
    first, second = 3e-3 * np.where(time % 2, 1.0, -1.0), np.full(len(time), 1e-3)
    gain = rmse_difference(first, second, np.random.default_rng(0))
    assert gain == pytest.approx((2e-3, 2e-3, 2e-3))


def test_the_interval_of_a_gain_holds_it_on_a_part_that_is_short_beside_the_memory_of_the_errors():
    # 15 min at 1 Hz, errors correlated over 20 s; 95 % are so, of 200 draws 0.95 +- 0.016. In 80 % with plain
    # percentiles of four blocks.
    rng, true = np.random.default_rng(0), 1e-3 * (1.0 - np.sqrt(2.0))
    keep = np.exp(-1.0 / 20.0)
    within = []
    for _ in range(200):
        noise = 1e-3 * np.sqrt(1.0 - keep**2) * rng.standard_normal((1100, 2))
        after, beside = lfilter([1.0], [1.0, -keep], noise, axis=0)[200:].T
        _, low, high = rmse_difference(after, after + beside, rng)
        within.append(low <= true <= high)
    assert 0.9 < np.mean(within) < 0.99


def test_a_single_row_has_no_gain_with_an_interval():
    assert np.isnan(rmse_difference(np.array([1e-3]), np.array([2e-3]), np.random.default_rng(0))).all()


def test_a_declared_model_that_is_written_unchanged_was_warned_of_as_if_it_were_another():
    (sentence,) = warnings([outcome(9e-3)], verdict("unknown"))
    assert sentence == (
        "the RMSE on the test part is 9.00 mV with the declared model, which model/ holds, and 5.00 mV with the "
        "recalibrated model."
    )
    (refitted,) = warnings([outcome(5e-3, before_v=4e-3)], verdict("unknown"))
    assert "is 5.00 mV with the recalibrated model, which model/ holds," in refitted
    assert refitted.endswith("do not use the model in model/ on such data.")
