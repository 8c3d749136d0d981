"""The flattened forest against quantile-forest's own prediction with Meinshausen's weights."""

import numpy as np
import pytest

from aesi.conformal.regressors.forest import ForestQuantiles
from aesi.conformal.regressors.model import FitTask

LEVELS = np.array([0.05, 0.25, 0.75, 0.95])


@pytest.mark.parametrize(
    "options",
    [{"n_estimators": 10, "max_depth": 2}, {"n_estimators": 8, "min_samples_leaf": 20, "max_samples": 0.4}],
)
def test_the_forest_gives_the_quantiles_of_quantile_forest(
    rng: np.random.Generator, options: dict[str, float]
) -> None:
    from quantile_forest import RandomForestQuantileRegressor

    rows = rng.standard_normal((1500, 6))
    targets = rows[:, 0] + np.exp(0.5 * rows[:, 1]) * rng.standard_normal(1500)
    ours = ForestQuantiles.fit(FitTask(rows, targets, LEVELS, 6, 1e-9, np.random.default_rng(5)), **options)
    seed = int(np.random.default_rng(5).integers(2**31))
    theirs = RandomForestQuantileRegressor(max_samples_leaf=None, random_state=seed, **options).fit(
        rows, targets
    )
    probe = rng.standard_normal((300, 6))
    expected = theirs.predict(probe, quantiles=LEVELS.tolist(), weighted_leaves=True)
    # Ours reads the distribution from a grid of 512 values, which lie within 0.03 of each other here but for
    # the extremes; theirs interpolates between samples, which in the tail are as far apart as 0.3.
    gap = np.abs(ours.quantiles(probe) - expected)
    assert np.mean(gap) < 0.02
    assert np.quantile(gap, 0.99) < 0.3


@pytest.mark.parametrize("step", [0.2, 0.5, 1.0])
def test_quantiles_of_rounded_targets_lay_between_them_and_left_out_the_outer_ones(
    rng: np.random.Generator, step: float
) -> None:
    from quantile_forest import RandomForestQuantileRegressor

    def drawn(n: int) -> tuple[np.ndarray, np.ndarray]:
        rows = rng.standard_normal((n, 6))
        return rows, step * np.round((0.5 * rows[:, 0] + rng.standard_normal(n)) / step)

    (rows, targets), (probe, fresh) = drawn(3000), drawn(4000)
    ours = ForestQuantiles.fit(
        FitTask(rows, targets, LEVELS, 6, 1e-9, np.random.default_rng(5)), n_estimators=10, max_depth=2
    )
    theirs = RandomForestQuantileRegressor(
        10, max_depth=2, max_samples_leaf=None, random_state=int(np.random.default_rng(5).integers(2**31))
    ).fit(rows, targets)
    found = ours.quantiles(probe)
    expected = theirs.predict(probe, quantiles=LEVELS.tolist(), weighted_leaves=True)
    # The rest are levels next to the end of a jump of the distribution function.
    assert np.mean(found == expected) > 0.98
    within = (fresh >= found[:, 0]) & (fresh <= found[:, -1])
    # An inverse distribution function holds its level or more; between the atoms 82 to 91 % were held.
    assert within.mean() > 0.9


def test_a_forest_saved_without_atoms_keeps_the_quantiles_that_it_had(rng: np.random.Generator) -> None:
    rows, levels = rng.standard_normal((1000, 3)), np.array([0.1, 0.25])
    targets = np.repeat([0.0, 1.0], 500)
    fitted = ForestQuantiles.fit(
        FitTask(rows, targets, levels, 3, 1e-9, rng), n_estimators=4, max_depth=1, min_samples_leaf=400
    )
    assert (fitted.quantiles(rows) == 0.0).all()
    state = fitted.to_state()
    del state["start"]
    state["grid"], state["leaf_cdf"] = np.array([0.0, 1.0]), np.tile([0.1, 1.0], (len(state["leaf_cdf"]), 1))
    restored = ForestQuantiles.from_state(state, {})
    np.testing.assert_allclose(restored.quantiles(rows), np.tile([0.0, 0.15 / 0.9], (1000, 1)))
