import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aesi.conformal.online.tracker import AIM, LOG_RATIO_LIMIT, SHARED, move, replay

ALPHA, RATE = 0.1, 0.05


def run(residuals: np.ndarray, rate: float = RATE, groups: np.ndarray | None = None, n_groups: int = 1):
    n = len(residuals)
    low, high = np.full(n, -1.0), np.full(n, 1.0)
    ready = np.ones(n, dtype=bool)
    groups = np.zeros(n, dtype=np.int64) if groups is None else groups
    replay(low, high, ready, residuals, groups, np.zeros(n_groups), rate, ALPHA, 1e-6)
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


def test_a_stuck_sensor_neither_collapses_nor_explodes_the_band() -> None:
    _, high, _ = run(np.zeros(50_000))
    assert high[-1] >= math.exp(-LOG_RATIO_LIMIT)
    _, high, _ = run(np.full(50_000, 1e12))
    assert high[-1] <= math.exp(LOG_RATIO_LIMIT)


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
    move(log_ratio, 0, True, RATE, ALPHA)
    np.testing.assert_allclose(log_ratio, RATE * (1 - AIM * ALPHA) * np.array([1 + SHARED, SHARED]))
