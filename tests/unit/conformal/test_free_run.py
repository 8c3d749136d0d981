import json
import math
from dataclasses import replace

import numpy as np
import pytest

from aesi.conformal import WHOLE_DRIVE, FreeRunBands, Intervals
from aesi.conformal.free_run import SCHEMA
from aesi.errors import FitError, InputError
from aesi.numerics.visited import Visited
from aesi.records import ErrorSeries, FreeRun

DT = 1.0
N = 4000


def drive(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(error, spread): an error whose size follows what is left open of the physics, correlated over a minute."""
    rng = np.random.default_rng(seed)
    spread = np.repeat(rng.choice([0.0, 1e-3, 4e-3], N // 50), 50)
    noise = np.zeros(N)
    for k in range(1, N):
        noise[k] = 0.97 * noise[k - 1] + rng.standard_normal() * math.sqrt(1 - 0.97**2)
    return (1e-3 + 2 * spread) * noise, spread


def fitted() -> FreeRunBands:
    errors, spreads = zip(*(drive(seed) for seed in range(4)), strict=True)
    return FreeRunBands.fit({10.0: [0.5 * e for e in errors], WHOLE_DRIVE: list(errors)}, DT, spreads)


def test_covers_fresh_drives_about_as_often_as_it_says() -> None:
    bands = fitted()
    covered = []
    for seed in range(10, 20):
        error, spread = drive(seed)
        low, high = bands.at(WHOLE_DRIVE, spread)
        covered.append(np.mean((error >= low) & (error <= high)))
    # Ten drives of some 60 independent stretches each: the mean coverage has a standard deviation near 1.5 %,
    # the calibration on four such drives one of 2.4 %.
    assert 0.84 < np.mean(covered) < 0.96


def test_the_band_is_as_wide_as_what_the_fitted_rows_leave_open() -> None:
    bands = fitted()
    error, spread = drive(30)
    low, high = bands.at(WHOLE_DRIVE, spread)
    known, open_ = spread == 0.0, spread == 4e-3
    # The error's size is 1 mV where nothing is left open, 9 mV where most is; its 90 % point 1.64 times that.
    assert np.mean(high[open_]) > 6 * np.mean(high[known])
    for where in (known, open_):
        assert np.mean(((error >= low) & (error <= high))[where]) > 0.75


def test_the_band_grows_from_the_shortest_horizon_to_the_whole_drive() -> None:
    bands = fitted()
    constant = np.full(2000, 1e-3)
    low, high = bands.along(DT, constant)
    short, whole = (bands.at(h, constant)[1] for h in (10.0, WHOLE_DRIVE))
    np.testing.assert_array_equal(low, -high)
    assert high[0] == high[10] == pytest.approx(short[0])
    assert high[100] == pytest.approx(whole[100])
    assert np.all(np.diff(high) >= -1e-15)


def test_between_the_longest_horizon_and_ten_times_it_the_width_runs_with_the_logarithm_of_time() -> None:
    bands = fitted()
    constant = np.full(200, 1e-3)
    short, whole = (bands.at(h, constant)[1][0] for h in (10.0, WHOLE_DRIVE))
    high = bands.along(DT, constant)[1]
    for after_s in (20, 50):
        share = math.log10(after_s / 10.0)
        assert high[after_s] == pytest.approx((1 - share) * short + share * whole)


def test_a_piece_is_judged_by_a_scale_that_has_not_seen_it() -> None:
    # Eight pieces, seven that err by 1 mV and one by 10 mV: a scale that had seen that one would be of its size.
    errors = [1e-3 * np.tile([1.0, -1.0], 50) for _ in range(7)] + [1e-2 * np.tile([1.0, -1.0], 50)]
    (band,) = FreeRunBands.fit({WHOLE_DRIVE: errors}, DT).horizons
    assert len(band.scales) == 8
    np.testing.assert_allclose(band.scores[-1], 10.0)
    np.testing.assert_allclose(band.scales[-1](np.array([[1.0, 0.0, 0.0]])), 1e-3)


def test_bands_read_back_from_json_have_the_same_edges() -> None:
    bands = replace(fitted(), root=np.tri(3))
    text = json.dumps(bands.to_dict(), default=lambda a: a.tolist(), allow_nan=False)
    restored = FreeRunBands.from_dict(json.loads(text))
    _, spread = drive(31)
    np.testing.assert_array_equal(restored.along(DT, spread)[0], bands.along(DT, spread)[0])
    np.testing.assert_array_equal(restored.root, bands.root)
    assert restored.horizons[0].by_piece == bands.horizons[0].by_piece


def test_bands_of_an_earlier_schema_are_refused() -> None:
    with pytest.raises(InputError, match=r"free_run_bands/2.*free_run_bands/8.*run the experiment again"):
        FreeRunBands.from_dict(fitted().to_dict() | {"schema": "aesi.free_run_bands/2"})


@pytest.mark.parametrize("content", [{"schema": SCHEMA}, [], None, {"schema": SCHEMA, "alpha": "x"}])
def test_bands_of_a_schema_alone_ended_in_a_key(content) -> None:
    with pytest.raises(
        InputError, match=r"the saved bands of a free run cannot be read back: .*; save the model"
    ):
        FreeRunBands.from_dict(content)


def test_bands_whose_horizons_fall_were_interpolated_between() -> None:
    state = fitted().to_dict()
    with pytest.raises(InputError, match=r"horizons are \[inf, 10\.0\] s, and not one or more that increase"):
        FreeRunBands.from_dict(state | {"horizons": state["horizons"][::-1]})


def test_a_record_outside_the_trained_range_is_flagged() -> None:
    error, _ = drive(32)
    series = record(error)
    outside = np.arange(N) > 100
    run = FreeRun(error, None, outside)
    np.testing.assert_array_equal(fitted().intervals(series, run).warm, ~outside)
    ahead = fitted().intervals(series, run, horizon_s=10.0)
    np.testing.assert_array_equal(ahead.upper_v, fitted().at(10.0, np.zeros(N))[1])
    # Of physics, which has no range of inputs, that of the temperature is left.
    bands = replace(fitted(), seen=Visited(np.array([0.5]), (25.0, 30.0)))
    heated = replace(series, temperature_degc=np.linspace(26.0, 34.0, N))
    inside = FreeRun(error, None, np.zeros(N, dtype=bool))
    np.testing.assert_array_equal(bands.intervals(heated, inside).warm, heated.temperature_degc <= 30.0)


def test_at_a_temperature_that_no_fitted_row_had_what_is_open_of_the_energies_widens_the_band():
    error, _ = drive(34)
    seen = Visited(np.array([0.5]), (25.0, 30.0))
    bands = replace(fitted(), seen=seen, energies_j_mol=np.array([30e3, 40e3]))
    slopes = 1e-3 * np.column_stack([np.ones(N), np.zeros(N)])
    run = FreeRun(error, None, np.zeros(N, dtype=bool))

    def width(degc, horizon_s=None):
        measured = None if degc is None else np.full(N, degc)
        series = replace(record(error), slopes_v=slopes, temperature_degc=measured)
        return bands.intervals(series, run, horizon_s=horizon_s).upper_v

    np.testing.assert_array_equal(width(28.0), width(None))
    # 1 mV times 30 kJ/mol / R (1 / 283.15 K - 1 / 298.15 K), by hand 0.6411, and the 95 % quantile of a normal error.
    cold = 1.645 * 0.6411e-3
    np.testing.assert_allclose(width(10.0, WHOLE_DRIVE), np.hypot(width(28.0, WHOLE_DRIVE), cold), rtol=1e-3)
    # From 30 to 45 degC 0.5612.
    hot = 1.645 * 0.5612e-3
    np.testing.assert_allclose(width(45.0, WHOLE_DRIVE), np.hypot(width(28.0, WHOLE_DRIVE), hot), rtol=1e-3)
    # A measurement 10 s ago takes off as much of it as of the rest.
    grown = width(10.0, WHOLE_DRIVE) / width(28.0, WHOLE_DRIVE)
    np.testing.assert_allclose(width(10.0, 10.0), grown * width(28.0, 10.0), rtol=1e-12)
    again = FreeRunBands.from_dict(json.loads(json.dumps(bands.to_dict(), default=lambda a: a.tolist())))
    np.testing.assert_array_equal(again.energies_j_mol, bands.energies_j_mol)


def test_a_record_brings_the_slopes_that_the_band_asks_for() -> None:
    error, _ = drive(33)
    root = np.array([[2.0, 0.0], [0.0, 0.5]])
    bands, run = replace(fitted(), root=root), FreeRun(error, None, np.zeros(N, dtype=bool))
    slopes = 1e-3 * np.column_stack([np.ones(N), np.arange(N) / N])
    # 2 mV of the first parameter, up to 0.5 mV of the second.
    spread = 1e-3 * np.hypot(2.0, 0.5 * np.arange(N) / N)
    with_slopes = replace(record(error), slopes_v=slopes)
    np.testing.assert_allclose(bands.spread(with_slopes), spread)
    np.testing.assert_allclose(bands.intervals(with_slopes, run).upper_v, bands.along(DT, spread)[1])
    for without in (record(error), replace(record(error), slopes_v=slopes[:, :1])):
        with pytest.raises(InputError, match="asks for 2 slopes of the physics; run the experiment again"):
            bands.intervals(without, run)


def record(error: np.ndarray) -> ErrorSeries:
    flat = np.zeros(N)
    return ErrorSeries("x", DT, DT * np.arange(N), error, flat[:, None], flat, error, ("I",))


def test_the_band_reaches_as_far_as_the_model_would_go_on() -> None:
    _, spread = drive(32)
    reach = np.where(np.arange(N) > 100, 7e-3, 0.0)
    bands = fitted()
    for held, wide in (
        (bands.at(10.0, spread), bands.at(10.0, spread, reach_v=reach)),
        (bands.along(DT, spread), bands.along(DT, spread, reach_v=reach)),
    ):
        np.testing.assert_allclose(wide[1] - held[1], reach)
        np.testing.assert_allclose(held[0] - wide[0], reach)


def test_a_whole_drive_does_not_scale_its_own_half() -> None:
    # Six quiet drives and one with ten times the error, of which a half is left out too: rows of its own.
    rng = np.random.default_rng(3)
    errors = [size * rng.standard_normal(600) for size in (1e-3,) * 6 + (1e-2,)]
    half = np.where(np.arange(600) < 300, errors[-1], np.nan)
    names = [f"drive {k}" for k in range(7)]
    flat = [np.zeros(600)] * 8
    (told,) = FreeRunBands.fit({1.0: [*errors, half]}, DT, flat, records=[*names, names[-1]]).horizons
    (alone,) = FreeRunBands.fit({1.0: errors}, DT, flat[:-1]).horizons
    here = np.array([[1.0, 0.0, 0.0]])
    for scale in (told.scales[-1], told.scales[-2]):
        np.testing.assert_array_equal(scale(here), alone.scales[-1](here))


def test_each_piece_is_scored_with_the_scale_of_the_others() -> None:
    # Seven quiet records and one with ten times the error: the quiet ones' scale covers next to nothing of it,
    # and that shows.
    rng = np.random.default_rng(0)
    errors = [(10.0 if i == 3 else 1.0) * 1e-3 * rng.standard_normal(400) for i in range(8)]
    flat = [np.zeros(400)] * 8
    (band,) = FreeRunBands.fit({1.0: errors}, DT, flat).horizons
    assert len(band.by_piece) == 8
    assert np.argmin(band.by_piece) == 3
    assert band.by_piece[3] < 0.6
    assert np.mean(band.by_piece) == pytest.approx(0.9, abs=0.01)


def test_equal_scales_give_the_quantile_of_all_errors() -> None:
    rng = np.random.default_rng(3)
    errors = [rng.permutation(np.linspace(1e-4, 1e-3, 1000)) for _ in range(5)]
    flat = [np.zeros(1000)] * 5
    bands = FreeRunBands.fit({1.0: errors}, DT, flat)
    # 90 % of numbers evenly spread from 0.1 to 1 mV lie below 0.91 mV; each record is ten stretches of a hundred
    # horizons, and Student's t of 49 degrees of freedom is 1.0193 times as wide as the normal at 95 %.
    assert bands.at(1.0, flat[0])[1][0] == pytest.approx(1.0193 * 0.91e-3, rel=0.005)


def test_few_pieces_widen_the_band_as_student_t_does() -> None:
    rng = np.random.default_rng(3)
    errors = [rng.permutation(np.linspace(1e-4, 1e-3, 1000)) for _ in range(5)]
    flat = [np.zeros(1000)] * 5
    bands = FreeRunBands.fit({1.0: errors, WHOLE_DRIVE: errors}, DT, flat)
    short, whole = (bands.at(h, flat[0])[1][0] for h in (1.0, WHOLE_DRIVE))
    # Each record is cut in two pieces: 1.8331 at 9 degrees of freedom, 1.6766 at 49.
    assert whole / short == pytest.approx(1.8331 / 1.6766, rel=1e-3)


def test_the_band_is_wide_far_from_the_fitted_rows() -> None:
    rng = np.random.default_rng(4)
    flat = [np.zeros(1000)] * 6
    excess = [np.where(np.arange(1000) < 100, 4.0, 0.0)] * 6
    errors = [1e-3 * (1 + 4 * np.log1p(x) / np.log(5)) * rng.standard_normal(1000) for x in excess]
    bands = FreeRunBands.fit({WHOLE_DRIVE: errors}, DT, flat, excess=excess)
    high = bands.at(WHOLE_DRIVE, flat[0], excess[0])[1]
    # Errors five times as large; six pieces of 100 such rows know their 90 % point to about 10 %.
    assert high[0] / high[-1] == pytest.approx(5.0, rel=0.25)
    near = bands.along(DT, flat[0])[1]
    np.testing.assert_array_equal(near, np.full(1000, high[-1]))


def test_rows_outside_the_trained_range_do_not_count() -> None:
    rng = np.random.default_rng(1)
    errors = [1e-3 * rng.standard_normal(600) for _ in range(4)]
    flat, inside = [np.zeros(600)] * 4, [np.arange(600) >= 200] * 4
    wild = [np.where(i, e, 50 * e) for e, i in zip(errors, inside, strict=True)]
    band = FreeRunBands.fit({1.0: wild}, DT, flat, inside=inside)
    only = FreeRunBands.fit({1.0: [e[200:] for e in errors]}, DT, [np.zeros(400)] * 4)
    assert band.at(1.0, flat[0])[1][0] == only.at(1.0, flat[0])[1][0]
    assert not band.horizons[0].extrapolated
    nowhere = FreeRunBands.fit({1.0: wild}, DT, flat, inside=[np.zeros(600, dtype=bool)] * 4)
    assert nowhere.horizons[0].extrapolated


def test_too_few_pieces_are_refused() -> None:
    with pytest.raises(FitError, match="at least 3 are needed; give longer records"):
        FreeRunBands.fit({1.0: [np.ones(70)]}, DT, [np.zeros(70)])


@pytest.mark.parametrize(
    ("horizon_s", "words"), [(1.0, "errors 1 s ahead"), (WHOLE_DRIVE, "errors over a whole drive")]
)
def test_errors_that_are_all_zero_are_refused(horizon_s, words) -> None:
    with pytest.raises(FitError, match=f"the {words} are zero"):
        FreeRunBands.fit({horizon_s: [np.zeros(3000)]}, DT, [np.zeros(3000)])


def test_constant_errors_get_a_band_of_their_size() -> None:
    flat = [np.zeros(3000)]
    bands = FreeRunBands.fit({1.0: [np.full(3000, 2e-3)]}, DT, flat)
    (band,) = bands.horizons
    assert bands.at(1.0, flat[0])[1] == pytest.approx(np.full(3000, 2e-3 * band.widening), rel=0.02)


def test_covariates_of_another_length_are_refused() -> None:
    with pytest.raises(InputError, match="differ in length"):
        FreeRunBands.fit({1.0: [np.ones(3000)]}, DT, [np.ones(10)])


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"excess": [np.zeros(40)]}, "the errors and excess differ in length"),
        ({"excess": [np.zeros(40), None, np.zeros(39)]}, "the errors and excess differ in length"),
        ({"records": ["a"]}, "1 names of records for the errors of 3"),
    ],
)
def test_an_excess_or_a_name_too_few_was_no_sentence(given, sentence) -> None:
    with pytest.raises(InputError, match=sentence):
        FreeRunBands.fit({1.0: [np.ones(40)] * 3}, DT, **given)


@pytest.mark.parametrize(
    "alpha", [0.0, 1.0, -0.1, 1.5, pytest.param(10**400, id="vast"), math.nan, "a tenth"]
)
def test_bands_of_an_impossible_level_were_calibrated(alpha) -> None:
    with pytest.raises(InputError, match=f"alpha = {alpha} is not a share of misses"):
        FreeRunBands.fit({1.0: [np.ones(40)] * 3}, DT, alpha=alpha)


@pytest.mark.parametrize("horizon_s", [0.0, -1.0, pytest.param(10**400, id="vast"), math.nan])
def test_a_horizon_that_lies_nowhere_ahead_was_calibrated_or_ended_in_an_index(horizon_s) -> None:
    words = f"a horizon of {horizon_s} s is no time ahead; give a positive number of seconds"
    with pytest.raises(InputError, match=words):
        FreeRunBands.fit({horizon_s: [np.ones(40)] * 3}, DT)
    with pytest.raises(InputError, match=words):
        fitted().at(horizon_s, np.zeros(2))


@pytest.mark.parametrize("dt_s", [0.0, -1.0, math.nan, math.inf])
def test_a_step_of_no_length_was_counted_by(dt_s) -> None:
    with pytest.raises(InputError, match=f"dt_s = {dt_s} has to be a positive number of seconds"):
        FreeRunBands.fit({1.0: [np.ones(40)] * 3}, dt_s)
    with pytest.raises(InputError, match=f"dt_s = {dt_s} has to be a positive number of seconds"):
        fitted().along(dt_s, np.zeros(2))


def test_rows_of_one_array_were_no_list_of_arrays() -> None:
    errors = 1e-3 * np.random.default_rng(5).standard_normal((4, 600))
    spread = np.abs(errors)
    inside, names = np.ones((4, 600), dtype=bool), np.array(["a", "b", "c", "d"])
    listed = FreeRunBands.fit(
        {1.0: list(errors)}, DT, list(spread), inside=list(inside), excess=list(spread), records=list(names)
    )
    whole = FreeRunBands.fit({1.0: errors}, DT, spread, inside=inside, excess=spread, records=names)
    np.testing.assert_array_equal(whole.at(1.0, spread[0])[1], listed.at(1.0, spread[0])[1])


def test_pieces_of_the_same_rows_alone_ended_in_an_empty_array() -> None:
    with pytest.raises(FitError, match="no piece is left that shares no row with one of a"):
        FreeRunBands.fit({1.0: [np.ones(40)] * 3}, DT, records=["a"] * 3)


def test_the_band_of_errors_that_are_mostly_zero_was_no_number() -> None:
    error = np.where(np.arange(3000) % 20 == 0, 1e-3, 0.0)
    bands = FreeRunBands.fit({1.0: [error]}, DT)
    np.testing.assert_array_equal(Intervals(*bands.at(1.0, np.zeros(2)), np.ones(2, dtype=bool)).width_v, 0.0)
    np.testing.assert_allclose(bands.at(1.0, np.zeros(2), open_v=1e-3)[1], 1.645e-3, rtol=1e-3)


def test_missing_predictions_are_left_out() -> None:
    error, spread = drive(1)
    late = error.copy()
    late[:60] = np.nan
    bands = FreeRunBands.fit({60.0: [late]}, DT, [spread])
    inside = np.arange(N) >= 60
    other = FreeRunBands.fit({60.0: [error]}, DT, [spread], inside=[inside])
    np.testing.assert_array_equal(bands.horizons[0].scores, other.horizons[0].scores)


def test_the_band_of_a_whole_drive_allows_for_as_few_stretches_as_it_is_told_of() -> None:
    errors, spreads = zip(*(drive(seed) for seed in range(4)), strict=True)
    by_horizon = {10.0: list(errors), WHOLE_DRIVE: list(errors)}
    pieces, four, two = (FreeRunBands.fit(by_horizon, DT, spreads, stretches=n) for n in (None, 4, 2))
    # Student's t with three degrees of freedom at 0.95, by its printed table, over the normal quantile.
    assert four.horizons[-1].widening == pytest.approx(2.353 / 1.645, rel=1e-3)
    assert pieces.horizons[-1].widening < four.horizons[-1].widening
    # Two cannot be told apart: their pieces stand for them. Short horizons forget within a stretch.
    assert two.horizons[-1].widening == pieces.horizons[-1].widening
    assert four.horizons[0].widening == pieces.horizons[0].widening


def test_a_stretch_outside_the_trained_range_tells_nothing_of_how_drives_differ() -> None:
    errors, spreads = zip(*(drive(seed) for seed in range(5)), strict=True)
    within, beyond = np.ones(N, dtype=bool), np.zeros(N, dtype=bool)

    def widening(inside: list[np.ndarray]) -> float:
        fitted_bands = FreeRunBands.fit({WHOLE_DRIVE: list(errors)}, DT, spreads, inside=inside, stretches=5)
        return fitted_bands.horizons[-1].widening

    # Student's t at 0.95 with four and two degrees of freedom, by its printed table, over the normal quantile.
    assert widening([within] * 5) == pytest.approx(2.132 / 1.645, rel=1e-3)
    assert widening([within] * 3 + [beyond] * 2) == pytest.approx(2.920 / 1.645, rel=1e-3)
    # Two stretches do not show how much they differ: the factor is that of the least number that does.
    assert widening([within] * 2 + [beyond] * 3) == pytest.approx(2.920 / 1.645, rel=1e-3)


def test_a_part_of_a_drive_and_the_whole_of_it_are_one_stretch() -> None:
    errors = [drive(seed)[0] for seed in range(3)]
    first, last = np.arange(N) < N // 2, np.arange(N) >= N // 2
    halves = [np.where(half, error, np.nan) for error in errors for half in (first, last)]
    names = [f"{i}" for i in range(3) for _ in range(2)]
    of_halves, of_one_less = (
        FreeRunBands.fit(
            {WHOLE_DRIVE: [*halves[:count], *errors]},
            DT,
            stretches=count,
            records=[*names[:count], "0", "1", "2"],
        ).horizons[-1]
        for count in (6, 5)
    )
    # Six halves; five of them, with the whole of the drive whose other half is missing.
    assert of_halves.widening == pytest.approx(2.015 / 1.645, rel=1e-3)
    assert of_one_less.widening == pytest.approx(2.132 / 1.645, rel=1e-3)


def test_bands_of_97_5_percent_are_not_called_those_of_98():
    assert repr(FreeRunBands(0.025, ())) == "FreeRunBands(97.5 %, 0 horizons)"
