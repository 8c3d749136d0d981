import json
import math

import numpy as np
import pytest

from aesi.conformal import WHOLE_DRIVE, FreeRunBands
from aesi.errors import FitError, InputError
from aesi.numerics.quantiles import grouped_conformal_quantile
from aesi.records import ErrorSeries, FreeRun

DT = 1.0
N = 4000


def drive(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(error, current, soc): an error whose size follows the current, correlated over a minute."""
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.choice([0.0, 5.0, 20.0], N // 50), 50)
    soc = 0.9 - 0.7 * np.arange(N) / N
    noise = np.zeros(N)
    for k in range(1, N):
        noise[k] = 0.97 * noise[k - 1] + rng.standard_normal() * math.sqrt(1 - 0.97**2)
    return (1e-3 + 4e-4 * current) * noise, current, soc


def fitted(**options) -> FreeRunBands:
    errors, currents, socs = zip(*(drive(seed) for seed in range(4)), strict=True)
    return FreeRunBands.fit(
        {10.0: [0.5 * e for e in errors], WHOLE_DRIVE: errors},
        DT,
        current_a=currents if options.get("scaled") else None,
        soc=socs if options.get("scaled") else None,
    )


@pytest.mark.parametrize("scaled", [False, True])
def test_covers_a_fresh_drive(scaled: bool) -> None:
    bands = fitted(scaled=scaled)
    covered = []
    for seed in range(10, 20):
        error, current, soc = drive(seed)
        low, high = bands.along(N, DT, *((current, soc) if scaled else ()))
        covered.append(np.mean((error >= low) & (error <= high)))
    # Ten drives of some 60 independent stretches each: the mean coverage has a standard deviation near 1.5 %.
    assert 0.86 < np.mean(covered) < 0.95


def test_scaling_by_current_narrows_the_band_and_holds_at_high_current() -> None:
    plain, scaled = fitted(), fitted(scaled=True)
    error, current, soc = drive(30)
    low, high = scaled.along(N, DT, current, soc)
    wide_low, wide_high = plain.along(N, DT)
    assert np.mean(high - low) < 0.9 * np.mean(wide_high - wide_low)
    busy = current == 20.0
    assert np.mean(((error >= wide_low) & (error <= wide_high))[busy]) < 0.85
    assert np.mean(((error >= low) & (error <= high))[busy]) > 0.8


def test_the_band_grows_from_the_shortest_horizon_to_the_whole_drive() -> None:
    bands = fitted()
    low, high = bands.along(2000, DT)
    short, whole = bands.horizons
    np.testing.assert_array_equal(low, -high)
    assert high[0] == high[10] == short.half_v
    assert high[100] == pytest.approx(whole.half_v)
    assert np.all(np.diff(high) >= 0)
    assert bands.at(10.0, 3, DT)[1] == pytest.approx(np.full(3, short.half_v))


def test_survives_json() -> None:
    bands = fitted(scaled=True)
    text = json.dumps(bands.to_dict(), default=lambda a: a.tolist(), allow_nan=False)
    restored = FreeRunBands.from_dict(json.loads(text))
    _, current, soc = drive(31)
    np.testing.assert_array_equal(restored.along(N, DT, current, soc)[0], bands.along(N, DT, current, soc)[0])


def test_a_record_outside_the_trained_range_is_flagged() -> None:
    error, current, soc = drive(32)
    series = ErrorSeries("x", DT, DT * np.arange(N), error, current[:, None], soc, error, ("I",))
    outside = np.arange(N) > 100
    intervals = fitted(scaled=True).intervals(series, FreeRun(error, None, outside))
    np.testing.assert_array_equal(intervals.warm, ~outside)


def test_too_few_blocks_are_refused() -> None:
    with pytest.raises(FitError, match="at least 9 are needed"):
        FreeRunBands.fit({1.0: [np.ones(300)]}, DT, alpha=0.1)


def test_errors_that_are_all_zero_are_refused() -> None:
    with pytest.raises(FitError, match="are zero"):
        FreeRunBands.fit({1.0: [np.zeros(3000)]}, DT)


def test_covariates_of_another_length_are_refused() -> None:
    with pytest.raises(InputError, match="differ in length"):
        FreeRunBands.fit({1.0: [np.ones(3000)]}, DT, current_a=[np.ones(10)], soc=[np.ones(10)])


def test_missing_predictions_are_left_out() -> None:
    error = drive(1)[0]
    late = error.copy()
    late[:60] = np.nan
    shorter = FreeRunBands.fit({60.0: [late]}, DT).horizons[0].half_v
    assert shorter == FreeRunBands.fit({60.0: [error[60:]]}, DT).horizons[0].half_v


def test_each_block_has_one_vote() -> None:
    # Nine blocks of one score, one of a thousand, and the unseen one: eleven votes. The 0.9 quantile needs 9.9
    # of them, which only the largest block reaches.
    groups = [np.array([float(j)]) for j in range(9)] + [np.full(1000, 100.0)]
    assert grouped_conformal_quantile(groups, 0.1) == 100.0
    # 8.8 votes are reached at the ninth.
    assert grouped_conformal_quantile(groups, 0.2) == 8.0


def test_one_sample_a_block_is_split_conformal() -> None:
    from aesi.numerics.quantiles import conformal_quantile

    scores = np.random.default_rng(0).standard_normal(99)
    assert grouped_conformal_quantile([scores[[j]] for j in range(99)], 0.1) == conformal_quantile(
        scores, 0.1
    )
