import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from aesi.conformal import METHODS, Intervals
from aesi.conformal.bands.narrowest import level_pairs, narrowest
from aesi.errors import InputError


@pytest.fixture(scope="module")
def calibrated():
    return METHODS["spci_linear"].fit([1e-4 * np.random.default_rng(0).standard_normal(3000)])


def test_asking_twice_gives_the_same_interval(calibrated) -> None:
    stream = calibrated.stream()
    stream.update(1e-4)
    assert stream.interval() == stream.interval()


@pytest.mark.parametrize("wrong", ["0.1", None, np.array([1e-4]), [1e-4], True])
def test_an_error_that_is_no_number_moved_the_scale_before_it_failed(wrong) -> None:
    stream = METHODS["aci"].fit([1e-4 * np.random.default_rng(0).standard_normal(300)]).stream()
    stream.update(1e-4)
    before = stream.interval()
    with pytest.raises(InputError, match=r"error_v = .* is not a number; give that of one sample"):
        stream.update(wrong)
    assert stream.interval() == before


def test_a_current_that_is_no_number_ended_in_a_type_error() -> None:
    errors, currents = np.random.default_rng(0).standard_normal((2, 3000))
    stream = METHODS["spci_linear"].fit([1e-4 * errors], current_a=[currents]).stream()
    for wrong in ("3", [3.0]):
        with pytest.raises(InputError, match=r"current_a = .* is not a number; give that of one sample"):
            stream.interval(wrong)
    assert stream.interval(np.float32(3.0)) == stream.interval(np.array(3.0))


def test_a_stream_and_intervals_print_what_they_are(calibrated) -> None:
    stream = calibrated.stream()
    stream.update(1e-4)
    assert repr(stream) == "Stream(Calibrated(spci_linear, 90 %, window 200), 1 residuals known)"
    told = repr(Intervals(np.full(2000, -1e-3), np.full(2000, 2e-3), np.arange(2000) >= 10))
    assert told == "Intervals(2,000 samples, 3 mV wide in the mean, 10 not calibrated)"


def test_a_seed_for_a_generator_ended_in_an_attribute_error() -> None:
    residuals = [1e-4 * np.random.default_rng(0).standard_normal(300)]
    by_seed, by_generator = (
        METHODS["spci_forest"].fit(residuals, window=20, rng=rng).intervals(residuals[0])
        for rng in (5, np.random.default_rng(5))
    )
    np.testing.assert_array_equal(by_seed.lower_v, by_generator.lower_v)


def test_masked_residuals_were_calibrated_on() -> None:
    masked = np.ma.masked_array(1e-4 * np.random.default_rng(0).standard_normal(300), np.arange(300) == 4)
    with pytest.raises(InputError, match="residuals is masked in row 5, counted from 1"):
        METHODS["split"].fit([masked])


def test_a_gap_brings_back_the_marginal_interval(calibrated) -> None:
    stream = calibrated.stream()
    for error in 1e-4 * np.random.default_rng(1).standard_normal(300):
        stream.update(float(error))
    assert stream.interval() != calibrated.marginal_v
    assert stream.warm
    stream.gap()
    assert stream.interval() == calibrated.marginal_v
    assert not stream.warm


def test_a_stream_was_never_warm_once_a_sample_was_added(calibrated) -> None:
    record = 1e-4 * np.random.default_rng(4).standard_normal(60)
    stream, warm = calibrated.stream(), []
    assert not stream.warm
    for error in record:
        stream.interval()
        stream.update(float(error))
        warm.append(stream.warm)  # of the interval of this sample
    np.testing.assert_array_equal(warm, calibrated.intervals(record).warm)
    assert warm[-1]


def test_infinity_counts_as_missing(calibrated) -> None:
    record = 1e-4 * np.random.default_rng(2).standard_normal(60)
    broken, missing = record.copy(), record.copy()
    broken[30], missing[30] = np.inf, np.nan
    np.testing.assert_array_equal(calibrated.intervals(broken).lower_v, calibrated.intervals(missing).lower_v)
    stream = calibrated.stream()
    for error in broken[:31]:
        stream.update(float(error))
    assert stream.interval() == calibrated.marginal_v


def test_a_stream_takes_no_more_memory_as_it_goes_on(calibrated) -> None:
    stream = calibrated.stream()
    for _ in range(1000):
        stream.update(1e-4)
    tracemalloc.start()
    for k in range(3000):
        stream.update(1e-4 * (k % 7))
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 20_000


@pytest.mark.parametrize("name", ["spci_linear", "spci_boosted"])
def test_a_step_works_the_window_through_in_a_few_compiled_calls(name: str, calls_of) -> None:
    rng = np.random.default_rng(3)
    fitted = METHODS[name].fit([1e-4 * rng.standard_normal(2000)], window=200)
    stream = fitted.stream()
    errors = (1e-4 * rng.standard_normal(1000)).tolist()
    for error in errors[:300]:
        stream.update(error)

    def later() -> None:
        for error in errors[300:]:
            stream.interval()
            stream.update(error)

    assert calls_of(later) / 700 < 100  # half a window's


def test_the_narrowest_pair_wins_and_crossed_quantiles_do_not() -> None:
    quantiles = np.array([[-3.0, -1.0, 1.0, 2.0], [1.0, -2.0, -5.0, 2.0]])
    low, high = np.empty(2), np.empty(2)
    narrowest(quantiles, low, high)
    assert (low[0], high[0]) == (-1.0, 2.0)
    assert (low[1], high[1]) == (-2.0, 2.0)


def test_pairs_of_levels_hold_the_nominal_share() -> None:
    levels = level_pairs(0.1, 5)
    np.testing.assert_allclose(levels[5:] - levels[:5], 0.9)
    np.testing.assert_allclose(level_pairs(0.1, 1), [0.05, 0.95])


def test_a_rest_at_the_floor_is_streamed_as_it_is_replayed(calibrated) -> None:
    rng = np.random.default_rng(4)
    drive = 1e-4 * rng.standard_normal(400)
    record = np.concatenate([drive[:200], np.full(600, drive[199]), drive[200:]])
    fitted = replace(calibrated, floor_v=1e-4)
    replay = fitted.intervals(record)
    assert np.isclose(replay.width_v, fitted.floor_v, rtol=1e-9).mean() > 0.3
    stream = fitted.stream()
    for k, error in enumerate(record):
        assert stream.interval() == (replay.lower_v[k], replay.upper_v[k])
        stream.update(float(error))
