import numpy as np
import pytest

from aesi.numerics.windows import N_LAGS, history_features, n_features, raw_lags, runs_before, spans


def expected_row(past: np.ndarray, window: int) -> np.ndarray:
    row = list(past[::-1][:N_LAGS])
    for length in spans(window):
        tail = past[-length:]
        row += [tail.mean(), tail.std(), np.abs(np.diff(tail)).mean()]
    return np.array([*row, abs(past[-1])])


def test_rows_agree_with_their_definition(rng: np.random.Generator) -> None:
    series = rng.standard_normal(120)
    rows, ready = history_features(series, 30)
    assert rows.shape == (120, n_features(30))
    np.testing.assert_array_equal(ready, np.arange(120) >= N_LAGS)
    for k in (N_LAGS, 29, 30, 31, 119):
        np.testing.assert_allclose(rows[k], expected_row(series[max(0, k - 30) : k], 30), rtol=1e-12)


def test_a_missing_value_starts_the_history_again(rng: np.random.Generator) -> None:
    series = rng.standard_normal(80)
    series[40] = np.nan
    rows, ready = history_features(series, 20)
    assert ready[40]
    assert not ready[41 : 41 + N_LAGS].any()
    np.testing.assert_array_equal(rows[51:], history_features(series[41:], 20)[0][10:])
    np.testing.assert_array_equal(runs_before(series)[39:43], [39, 40, 0, 1])


def test_twice_the_series_is_twice_the_features(rng: np.random.Generator) -> None:
    series = rng.standard_normal(60)
    np.testing.assert_allclose(history_features(2 * series, 25)[0], 2 * history_features(series, 25)[0])


def test_raw_lags_are_the_window_backwards() -> None:
    rows, ready = raw_lags(np.arange(6.0), 3)
    np.testing.assert_array_equal(ready, [False, False, False, True, True, True])
    np.testing.assert_array_equal(rows[3:], [[2, 1, 0], [3, 2, 1], [4, 3, 2]])


@pytest.mark.parametrize("window", [10, 20, 60, 200])
def test_the_window_is_the_longest_span(window: int) -> None:
    assert spans(window)[-1] == window
    assert np.all(np.diff(spans(window)) > 0)
