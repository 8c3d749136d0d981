import numpy as np
import pytest

from aesi.conformal import Intervals
from aesi.conformal.scores import interval_score, low_minute_share, scores_of, worst_bin_coverage


def band(low: list[float], high: list[float]) -> Intervals:
    return Intervals(np.array(low), np.array(high), np.ones(len(low), dtype=bool))


def test_coverage_width_and_score_of_a_case_worked_by_hand() -> None:
    # Widths 2; one residual 1 below its band at alpha = 0.1 costs 20: (2 + 2 + 22 + 2) / 4 = 7.
    residuals = np.array([0.0, 0.5, -2.0, 1.0])
    scores = scores_of(band([-1] * 4, [1] * 4), residuals, 0.1)
    assert scores.coverage == 0.75
    assert scores.mean_width_v == 2.0
    assert scores.interval_score_v == pytest.approx(7.0)
    assert np.isnan(scores.worst_bin_coverage)


def test_a_missing_residual_counts_neither_way() -> None:
    scores = scores_of(band([-1] * 3, [1] * 3), np.array([0.0, np.nan, 5.0]), 0.1)
    assert scores.coverage == 0.5


def test_no_residual_at_all_has_no_score() -> None:
    scores = scores_of(band([-1], [1]), np.array([np.nan]), 0.1)
    assert np.isnan([scores.coverage, scores.mean_width_v, scores.interval_score_v]).all()
    assert np.isnan(low_minute_share([np.full(60, np.nan)], 1.0))


def test_the_true_quantiles_score_best(rng: np.random.Generator) -> None:
    draws = rng.standard_normal(100_000)
    best = interval_score(np.full(100_000, -1.645), np.full(100_000, 1.645), draws, 0.1)
    for factor in (0.8, 1.2):
        assert (
            interval_score(np.full(100_000, -1.645 * factor), np.full(100_000, 1.645 * factor), draws, 0.1)
            > best
        )


def test_bins_of_few_samples_are_joined_to_their_neighbours() -> None:
    current = np.array([0.0] * 300 + [8.0] * 300 + [4.0] * 200)
    covered = np.array([1.0] * 300 + [1.0] * 240 + [0.0] * 60 + [0.0] * 200)
    soc = np.full(800, 0.55)
    assert worst_bin_coverage(covered, current, soc) == pytest.approx(300 / 500)
    assert np.isnan(worst_bin_coverage(covered[:100], current[:100], soc[:100]))


def test_the_worst_bin_is_no_better_than_the_average(rng: np.random.Generator) -> None:
    current, soc = rng.normal(3.0, 4.0, 3000), np.linspace(0.9, 0.4, 3000)
    covered = (np.abs(current - 3.0) < 6.0).astype(float)  # what fails is spread over bins of few samples
    assert worst_bin_coverage(covered, current, soc) <= covered.mean()
    assert worst_bin_coverage(covered[:250], current[:250], soc[:250]) <= covered[:250].mean()


def test_bins_separate_state_of_charge() -> None:
    covered = np.array([1.0] * 250 + [0.5] * 250)
    soc = np.array([0.55] * 250 + [0.65] * 250)
    assert worst_bin_coverage(covered, np.zeros(500), soc) == 0.5


def test_low_minutes_are_the_windows_that_cover_too_little() -> None:
    # Three minutes at 1 Hz; the middle one is missed altogether. A window of 60 is under 70 % where it holds
    # 19 or more of the misses: starts 19 - 60 + 60 = 19 to 119 - 18 = 101, 83 of the 121 windows.
    covered = np.ones(180)
    covered[60:120] = 0.0
    assert low_minute_share([covered], 1.0) == pytest.approx(83 / 121)
    assert low_minute_share([np.ones(180)], 1.0) == 0.0
    assert np.isnan(low_minute_share([np.ones(59)], 1.0))


def test_no_minute_spans_two_records() -> None:
    # Each record misses its first and last 15 seconds: no window of a record, and every one over the border, is low.
    covered = np.ones(180)
    covered[:15] = covered[-15:] = 0.0
    assert low_minute_share([covered], 1.0) == 0.0
    assert low_minute_share([covered, covered], 1.0) == 0.0
    assert low_minute_share([np.append(covered, covered)], 1.0) > 0.0
    assert low_minute_share([covered, np.zeros(59)], 1.0) == 0.0


def test_exactly_seventy_per_cent_is_not_low() -> None:
    covered = np.array(([1.0] * 7 + [0.0] * 3) * 6)
    assert low_minute_share([covered], 1.0) == 0.0
