import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aesi.conformal.online.tracker import AIM, LOG_RATIO_LIMIT, SHARED, adapt_log_ratio, replay
from aesi.conformal.registry import METHODS

ALPHA, RATE = 0.1, 0.05


def run(
    residuals: np.ndarray,
    rate: float = RATE,
    groups: np.ndarray | None = None,
    n_groups: int = 1,
    floor: float = 1e-6,
    start: float = 0.0,
):
    n = len(residuals)
    low, high = np.full(n, -1.0), np.full(n, 1.0)
    ready = np.ones(n, dtype=bool)
    groups = np.zeros(n, dtype=np.int64) if groups is None else groups
    replay(low, high, ready, residuals, groups, np.full(n_groups, start), rate, ALPHA, floor)
    return low, high, (residuals < low) | (residuals > high)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.2, 5.0))
def test_the_share_of_misses_is_bounded_whatever_the_residuals_do(seed: int, jump: float) -> None:
    rng = np.random.default_rng(seed)
    n = 2000
    residuals = rng.standard_normal(n) * np.exp(jump * np.sign(np.sin(np.arange(n) / rng.uniform(20, 400))))
    low, high, missed = run(residuals)
    # Equation (1) summed over n - 1 steps; the limit on log r is not reached at these sizes.
    moved = math.log((high[-1] - low[-1]) / 2)
    assert missed[:-1].mean() - AIM * ALPHA == pytest.approx(
        moved / (RATE * (1 + SHARED) * (n - 1)), abs=1e-9
    )


def test_a_miss_widens_and_a_hit_narrows() -> None:
    low, high, _ = run(np.array([5.0, 0.0, 0.0]))
    assert high[1] > high[0] > 0
    assert high[2] < high[1]
    np.testing.assert_allclose(low, -high)


def test_without_a_rate_nothing_moves() -> None:
    low, high, _ = run(np.array([5.0, -5.0, 5.0]), rate=0.0)
    np.testing.assert_array_equal(high, 1.0)
    np.testing.assert_array_equal(low, -1.0)


@pytest.mark.parametrize("name", ["split", "enbpi"])
def test_residuals_at_the_end_of_a_band_were_left_out_by_round_off(
    name: str, rng: np.random.Generator
) -> None:
    # In steps of 1 mV, a third of them at one end of the band: 55 and 49 % of the next ones were inside.
    calibration, later = 1e-3 * np.round(1.2 * rng.exponential(size=(2, 2000))) - 4e-4
    intervals = METHODS[name].fit([calibration], alpha=0.3, window=60).intervals(later)
    assert intervals.covers(later).mean() >= 0.7


def test_a_stuck_sensor_neither_collapses_nor_explodes_the_band() -> None:
    _, high, _ = run(np.zeros(50_000))
    assert high[-1] >= math.exp(-LOG_RATIO_LIMIT)
    _, high, _ = run(np.full(50_000, 1e12))
    assert high[-1] <= math.exp(LOG_RATIO_LIMIT)


def test_the_drive_after_a_rest_is_covered_as_if_there_had_been_none(rng: np.random.Generator) -> None:
    drive, rest = rng.standard_normal(1000), 3600
    residuals = np.concatenate([drive[:500], np.zeros(rest), drive[500:]])
    groups = np.concatenate([np.zeros(500), np.ones(rest), np.zeros(500)]).astype(np.int64)
    # At rest the band is at its floor from the start: a hit there would narrow nothing but the bands of the drive.
    low, high, _ = run(residuals, groups=groups, n_groups=2, floor=2.0, start=-1.0)
    assert np.ptp(high[500 : 500 + rest]) == 0
    drive_groups = np.zeros(1000, dtype=np.int64)
    alone_low, alone_high, _ = run(drive, groups=drive_groups, n_groups=2, floor=2.0, start=-1.0)
    assert (alone_high > 1).mean() > 0.5
    np.testing.assert_array_equal(low[500 + rest :], alone_low[500:])
    np.testing.assert_array_equal(high[500 + rest :], alone_high[500:])


def test_a_band_comes_back_from_its_floor_after_one_miss() -> None:
    _, high, _ = run(np.array([0.0] * 5000 + [5.0] + [0.0] * 3), floor=1.0)
    assert high[5000] == 0.5
    assert high[5001] > 0.5
    assert high[5002] > 0.5


def test_a_group_that_always_hits_does_not_let_another_miss_more(rng: np.random.Generator) -> None:
    n = 200_000
    groups = rng.integers(0, 2, n)
    _, _, missed = run(np.where(groups == 1, 0.0, rng.standard_normal(n)), groups=groups, n_groups=2)
    # Equation (2) with D log r of 7 at most over 100,000 steps at a rate of 0.05: within 0.002.
    assert missed[groups == 0].mean() == pytest.approx(AIM * ALPHA, abs=0.002)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 7))
def test_log_r_tells_the_share_of_misses_of_each_group(seed: int, n_groups: int) -> None:
    """Equation (2), through floors and limits: of the steps that moved anything."""
    rng = np.random.default_rng(seed)
    log_ratio, misses, steps = np.zeros(n_groups), np.zeros(n_groups), np.zeros(n_groups)
    often, held_often = rng.uniform(size=(2, n_groups))
    for _ in range(3000):
        group = int(rng.integers(n_groups))
        missed, held = bool(rng.uniform() < often[group]), bool(rng.uniform() < held_often[group])
        before = log_ratio.copy()
        adapt_log_ratio(log_ratio, group, missed, held, RATE, ALPHA)
        if not np.array_equal(log_ratio, before):
            assert missed or not held
            misses[group] += missed
            steps[group] += 1
    told = log_ratio - SHARED / (1 + SHARED * n_groups) * log_ratio.sum()
    np.testing.assert_allclose(misses - AIM * ALPHA * steps, told / RATE, atol=1e-6)


def test_groups_that_push_against_each_other_stay_within_a_few_times_the_limit(
    rng: np.random.Generator,
) -> None:
    log_ratio, furthest = np.zeros(7), 0.0
    for _ in range(500):
        misses, active = rng.uniform(size=(2, 7)) < rng.uniform(size=(2, 1))
        for group in rng.integers(0, 7, 200):
            if active[group]:
                adapt_log_ratio(log_ratio, int(group), bool(misses[group]), False, 0.5, 0.5)
        furthest = max(furthest, float(np.abs(log_ratio).max()))
    assert LOG_RATIO_LIMIT < furthest < 4 * LOG_RATIO_LIMIT


def test_a_group_calibrated_on_constant_residuals_widens_after_misses() -> None:
    _, high, _ = run(np.full(500, 5.0), start=-math.inf)
    assert high[-1] > 5.0


def test_each_group_is_held_at_the_level(rng: np.random.Generator) -> None:
    groups = rng.integers(0, 2, 20_000)
    residuals = np.where(groups == 1, 6.0, 1.0) * rng.standard_normal(20_000)
    _, _, missed = run(residuals, groups=groups, n_groups=2)
    for group in (0, 1):
        assert missed[groups == group].mean() == pytest.approx(AIM * ALPHA, abs=0.01)


def test_a_missing_residual_moves_nothing() -> None:
    _, high, _ = run(np.array([np.nan, np.nan, 0.0]))
    np.testing.assert_array_equal(high, 1.0)


def test_move_reaches_other_groups_with_the_shared_part() -> None:
    log_ratio = np.zeros(2)
    adapt_log_ratio(log_ratio, 0, True, False, RATE, ALPHA)
    np.testing.assert_allclose(log_ratio, RATE * (1 - AIM * ALPHA) * np.array([1 + SHARED, SHARED]))
