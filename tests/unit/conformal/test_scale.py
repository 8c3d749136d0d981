"""Which currents share a factor: those of like use, and a current that is held for long with no other."""

import numpy as np
import pytest

from aesi.conformal.online.scale import Scale
from aesi.conformal.online.tracker import replay

ALPHA = 0.1


def currents(rng: np.random.Generator, n: int, driven: float) -> np.ndarray:
    return np.where(rng.random(n) < driven, rng.normal(0.0, 5.0, n), 0.0)


@pytest.mark.parametrize("driven", [0.9, 0.5, 0.1, 0.02])
def test_rest_was_in_one_group_with_charging(rng: np.random.Generator, driven: float) -> None:
    current = currents(rng, 20_000, driven)
    scale = Scale.fit(np.abs(rng.standard_normal(20_000)), ALPHA, current)
    charging, resting, discharging = (
        set(scale.groups(current[s])) for s in (current < 0, current == 0, current > 0)
    )
    assert len(resting) == 1
    assert max(charging) < min(resting) <= max(resting) < min(discharging)


def test_currents_beside_those_that_are_held_are_in_no_group_with_them() -> None:
    current = np.repeat([0.0, 2.0], 1000)
    scale = Scale.fit(np.ones(2000), ALPHA, current)
    np.testing.assert_array_equal(scale.groups(np.array([-1.0, 0.0, 1.0, 2.0, 3.0])), [0, 1, 2, 3, 4])


def test_residuals_that_equal_that_of_the_factor_were_left_out_by_round_off(rng: np.random.Generator) -> None:
    calibration, later = 1e-3 * np.round(1.5 * rng.standard_normal((2, 2000))) + 4e-4
    low, high = np.full(2000, -1.4e-3), np.full(2000, 6e-4)
    scale = Scale.fit(np.abs(calibration - 0.5 * (low + high)) / (0.5 * (high - low)), 0.3, None)
    everywhere, group = np.ones(2000, dtype=bool), np.zeros(2000, dtype=np.int64)
    replay(low, high, everywhere, later, group, scale.log_ratio, 0.0, 0.3, 1e-6)
    assert np.mean((low <= later) & (later <= high)) >= 0.7


def test_rest_paid_for_the_misses_of_charging(rng: np.random.Generator) -> None:
    n = 40_000
    current = currents(rng, n, 0.1)
    residual = np.where(current == 0.0, 0.0, rng.standard_normal(n))
    scale = Scale.fit(np.abs(residual), ALPHA, current)
    low, high = np.full(n, -1.0), np.full(n, 1.0)
    groups, ready = scale.groups(current), np.ones(n, dtype=bool)
    replay(low, high, ready, residual, groups, scale.log_ratio, 0.02, ALPHA, 1e-6)
    covered = (low <= residual) & (residual <= high)
    for use in (current < 0.0, current > 0.0):
        # A standard deviation of some 2,000 rows is 0.7 %.
        assert covered[use].mean() == pytest.approx(0.905, abs=0.02)
