"""What bands are calibrated on: rows that the model which predicted them had been trained around."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.conformal import WHOLE_DRIVE
from aesi.errors import FitError
from aesi.pipeline.experiment.intervals.bands import ALL_BUT_FIRST, OutOfSampleErrors, bands_of_horizons
from aesi.records import ErrorSeries, FreeRun
from aesi.sparse.bare import Bare

N, DT = 400, 1.0


class Held:
    """Holds the measured error it was given."""

    name = "held"

    def one_step(self, series):
        return self.k_step(series, 1)

    def free_run(self, series, error0_v=None):
        return FreeRun(np.full(len(series), series.error_v[0]), None, np.zeros(len(series), dtype=bool))

    def k_step(self, series, steps):
        return np.concatenate([np.full(steps, series.error_v[0]), series.error_v[:-steps]])


@pytest.fixture
def drive() -> ErrorSeries:
    """A discharge: the second input falls all along, the current swings."""
    time = DT * np.arange(N)
    inputs = np.column_stack([np.sin(time), 1 - time / N])
    return ErrorSeries("drive", DT, time, 1e-5 * time, inputs, 1 - time / N, time, ("I", "c_sp"))


def test_a_piece_at_either_end_was_extrapolated(drive) -> None:
    pieces = [slice(a, a + 100) for a in (0, 100, 200, 300)]
    errors = OutOfSampleErrors.of([(Held(), drive, piece) for piece in pieces], (drive,), (10.0,))
    inside = [rows[piece] for rows, piece in zip(errors.inside, pieces, strict=True)]
    assert [bool(rows.any()) for rows in inside] == [False, True, True, False]
    assert inside[1].mean() > 0.95


def test_only_what_a_model_has_not_seen_counts(drive) -> None:
    errors = OutOfSampleErrors.of([(Held(), drive, slice(100, 200))], (drive,), (10.0,))
    for (left,) in errors.by_horizon.values():
        np.testing.assert_array_equal(np.flatnonzero(np.isfinite(left)), np.arange(100, 200))
    # The measurement 10 s before the piece is there, and a free run enters it with what it has drifted by.
    assert errors.by_horizon[10.0][0][100] == pytest.approx(1e-4)
    assert errors.by_horizon[WHOLE_DRIVE][0][100] == pytest.approx(1e-3)


def test_another_record_is_inside_where_the_training_went(drive) -> None:
    other = drive.take(slice(0, N), "validation")
    beyond = ErrorSeries(
        "validation",
        DT,
        drive.time_s,
        drive.error_v,
        1.5 * drive.inputs,
        drive.soc,
        drive.model_v,
        drive.input_names,
    )
    errors = OutOfSampleErrors.of(
        [(Held(), other, ALL_BUT_FIRST), (Held(), beyond, ALL_BUT_FIRST)], (drive,), ()
    )
    assert errors.inside[0].all()
    assert 0 < errors.inside[1].mean() < 0.7


def test_errors_are_those_of_the_horizon(drive) -> None:
    errors = OutOfSampleErrors.of(
        [(Held(), drive, ALL_BUT_FIRST)], (drive.take(slice(0, N), "other"),), (10.0,)
    )
    (ahead,) = errors.by_horizon[10.0]
    assert np.isnan(ahead[:10]).all()
    np.testing.assert_allclose(ahead[10:], 1e-4)
    np.testing.assert_allclose(errors.by_horizon[WHOLE_DRIVE][0][1:], drive.error_v[1:])


def test_a_model_that_holds_nothing_at_an_edge_reaches_nowhere(drive) -> None:
    errors = OutOfSampleErrors.of([(Held(), drive, ALL_BUT_FIRST)], (drive,), (10.0,))
    assert errors.reach.keys() == errors.by_horizon.keys()
    assert not any(each[0].any() for each in errors.reach.values())


def test_a_left_out_piece_is_as_open_as_the_other_rows_leave_it(drive) -> None:
    half = slice(N // 2, N)
    # One parameter moves the first half's voltage, another that of the second.
    first = np.arange(N) < N // 2
    slopes = 5e-3 * np.column_stack([first, ~first])
    train = replace(drive, slopes_v=slopes)
    errors = OutOfSampleErrors.of([(Held(), drive, half), (Held(), drive, slice(1, 1))], (train,), (10.0,))
    left, nothing = errors.spread
    np.testing.assert_allclose(left[half], 5e-3)
    # 200 rows of 1 s, 100 s of which count as one of 10 mV: 1 / (1 + 0.5) is left of the variance.
    np.testing.assert_allclose(left[: N // 2], 5e-3 / np.sqrt(1.5))
    np.testing.assert_allclose(nothing, 5e-3 / np.sqrt(1.5))
    assert errors.root.shape == (2, 2)


def test_physics_is_as_open_in_calibration_as_in_use_where_one_drive_trains(drive) -> None:
    """It was fitted to all rows of that drive: taken away in calibration alone, they made its band too narrow."""
    train = replace(drive, slopes_v=5e-3 * np.ones((N, 1)))
    errors = OutOfSampleErrors.of([(Bare(), train, slice(0, N))], (train,), (10.0,))
    np.testing.assert_allclose(errors.spread[0], 5e-3 * errors.root[0, 0])
    # 400 rows of 1 s, 100 s of which count as one of two deviations.
    np.testing.assert_allclose(errors.root, [[1 / np.sqrt(1 + 4 / 2**2)]])
    # A second drive can be fitted without the first.
    other = replace(train, name="other")
    apart = OutOfSampleErrors.of([(Bare(), train, slice(0, N))], (train, other), (10.0,))
    np.testing.assert_allclose(apart.spread[0], 5e-3 / np.sqrt(1 + 4 / 2**2))
    np.testing.assert_allclose(apart.root, [[1 / np.sqrt(1 + 8 / 2**2)]])


def test_rows_are_as_open_as_the_error_that_their_fit_allowed_for_leaves_them(drive) -> None:
    slopes = 5e-3 * np.ones((N, 1))
    train = replace(drive, slopes_v=slopes, missed_v=0.02)
    # A fit without the second half missed 40 mV, that to all rows 20.
    left_out = replace(drive, missed_v=0.04)
    errors = OutOfSampleErrors.of([(Held(), left_out, slice(N // 2, N))], (train,), (10.0,))
    # 200 and 400 rows of 1 s, 100 s of which count as one of 8 and 4 deviations.
    np.testing.assert_allclose(errors.spread[0], 5e-3 / np.sqrt(1 + 2 / 8**2))
    np.testing.assert_allclose(errors.root, [[1 / np.sqrt(1 + 4 / 4**2)]])


@pytest.mark.parametrize("model", [Held(), Bare()])
def test_rows_hotter_than_those_of_the_fit_calibrate_no_band(drive, model) -> None:
    """Nor colder ones: of neither does the calibrated width tell."""
    warm = replace(drive, name="warm", temperature_degc=np.linspace(20.0, 30.0, N))
    hot = replace(drive, name="hot", temperature_degc=np.linspace(26.0, 36.0, N))
    every = slice(0, N)
    alone = OutOfSampleErrors.of([(model, hot, every), (model, warm, every)], (warm, hot), (10.0,))
    np.testing.assert_array_equal(alone.inside[0], hot.temperature_degc <= 30.0)
    np.testing.assert_array_equal(alone.inside[1], warm.temperature_degc >= 26.0)
    # Where a search leaves out a whole record, its samples begin with the first that is predicted.
    colder = replace(hot, name="colder", temperature_degc=np.linspace(0.0, 10.0, N))
    predicted = OutOfSampleErrors.of([(model, colder, slice(1, N))], (warm, colder), (10.0,))
    assert not predicted.inside[0].any()
    unmeasured = replace(hot, temperature_degc=None)
    assert OutOfSampleErrors.of([(model, unmeasured, every)], (warm, unmeasured), (10.0,)).inside[0].all()


def test_a_horizon_that_records_are_too_short_for_takes_no_band_from_the_others(drive) -> None:
    rng = np.random.default_rng(0)
    drives = [replace(drive, name=f"{i}", error_v=rng.normal(0.0, 1e-3, N)) for i in range(4)]
    pairs = [(Held(), each, ALL_BUT_FIRST) for each in drives]
    alone, nothing = bands_of_horizons(OutOfSampleErrors.of(pairs, drives, (1.0,)), 0.1)
    beside, told = bands_of_horizons(OutOfSampleErrors.of(pairs, drives, (1.0, 390.0)), 0.1)
    assert [band.horizon_s for band in beside.horizons] == [1.0, WHOLE_DRIVE]
    assert np.array_equal(beside.at(1.0, np.zeros(5)), alone.at(1.0, np.zeros(5)))
    assert (len(told), nothing) == (1, ())
    assert "0 pieces of 30 or more predictions 390 s ahead" in told[0]
    assert "or a shorter horizon" in told[0]
    with pytest.raises(FitError, match=r"over a whole drive cannot calibrate a band: .* give longer records"):
        bands_of_horizons(OutOfSampleErrors.of([(Held(), drives[0], slice(1, 50))], drives, ()), 0.1)
