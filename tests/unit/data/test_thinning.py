"""Fewer rows for fits: the charge is kept, and what is too short for a window stays as it is."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.data.thinning import Spacing, averaged_over, condensed
from aesi.records import Measurement


def record(n: int, dt_s: float = 0.1) -> Measurement:
    time = dt_s * np.arange(n)
    return Measurement(time, np.sin(time), 4.0 - 0.01 * time)


@pytest.mark.parametrize("rows", [1, 2, 5, 10])
def test_a_record_shorter_than_a_window_stays_as_it_is(rows):
    short = record(rows)
    assert averaged_over(short, step_s=1.0) is short


@pytest.mark.parametrize("rows", [11, 12, 205])
def test_windows_are_centred_averages_of_a_straight_line(rows):
    thin = averaged_over(record(rows), step_s=1.0)
    assert len(thin) < rows
    np.testing.assert_allclose(np.diff(thin.time_s)[1:], 1.0)
    np.testing.assert_allclose(
        thin.voltage_v, 4.0 - 0.01 * thin.time_s, rtol=1e-12
    )  # the mean of a line is its middle


@pytest.mark.parametrize("factor", [2, 3, 10])
def test_windows_side_by_side_count_every_row_once(factor):
    data = record(20 * factor + 1, 1.0 / factor)
    current = np.random.default_rng(0).normal(size=len(data))
    thin = averaged_over(replace(data, current_a=current), step_s=1.0)
    # By hand: the windows from the first one's centre on tile the record from half a window before it to half after.
    begin = factor // 2
    inside = current[begin - factor // 2 : len(current) - begin + factor // 2]
    if factor % 2:
        whole = inside[: factor * (len(thin) - 1)].sum()
    else:  # the row between two windows is half of either
        held = inside[: factor * (len(thin) - 1) + 1]
        whole = held.sum() - 0.5 * (held[0] + held[-1])
    assert factor * thin.current_a[1:].sum() == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize("hold", ["backward", "linear"])
@pytest.mark.parametrize("gap_s", [600.0, 3600.0])
@pytest.mark.parametrize(("before_a", "after_a"), [(0.0, 0.0), (2.5, 0.0), (0.0, 2.5), (2.5, 2.5)])
def test_windows_over_a_gap_made_charge_that_never_flowed(hold, gap_s, before_a, after_a):
    """A logger that pauses: a window of three rows of which one is of a load carried its current over half of it."""
    time = np.concatenate([np.arange(2000.0), 2000.0 + gap_s + np.arange(2000.0)])
    current = np.repeat(np.random.default_rng(0).normal(0.5, 1.5, 400), 10)
    current[1990:2000], current[2000], current[2001:2030] = before_a, after_a, 3.0
    data = Measurement(time, current, 3.7 - 0.02 * current, hold=hold)
    for step_s in (2.0, 3.0, 8.0, 30.0):
        thin = averaged_over(data, step_s)
        assert len(thin) < 1.2 * len(data) / step_s
        (moved, kept) = (r.discharged_ah(h)[-1] for r, h in ((data, hold), (thin, "linear")))
        # What a window at an end is off by, at the largest current.
        assert kept == pytest.approx(moved, abs=4.0 * step_s * 5.0 / 3600.0)
        ends = np.flatnonzero(np.diff(thin.time_s) > 100.0)
        assert thin.time_s[ends] == 1999.0
        assert thin.time_s[ends + 1] == 2000.0 + gap_s
        assert thin.voltage_v[[ends[0], ends[0] + 1]] == pytest.approx(data.voltage_v[[1999, 2000]])


def test_a_stretch_between_two_gaps_that_is_shorter_than_a_window_stays_as_it_is():
    time = np.concatenate([np.arange(500.0), 1000.0 + np.arange(4.0), 2000.0 + np.arange(500.0)])
    data = Measurement(time, np.zeros(len(time)), 4.0 - 1e-4 * time)
    thin = averaged_over(data, step_s=10.0)
    kept = (thin.time_s >= 1000.0) & (thin.time_s < 1900.0)
    np.testing.assert_array_equal(thin.time_s[kept], data.time_s[500:504])
    np.testing.assert_allclose(thin.voltage_v, 4.0 - 1e-4 * thin.time_s, rtol=1e-12)


def test_the_rows_on_both_sides_of_a_step_stand_for_themselves():
    time = np.arange(3000.0)
    current = np.where((time >= 1000.0) & (time < 1100.0), 5.0, 0.0)
    data = Measurement(time, current, 4.0 - 0.02 * current)
    thin, rows = condensed(data, 5.0, 100.0, Spacing(first_s=1.0, growth=0.5))
    assert len(thin) < 150
    for at_s in (999.0, 1000.0, 1099.0, 1100.0):
        (place,) = np.flatnonzero(thin.time_s == at_s)
        assert rows[place] == 1.0
        assert thin.voltage_v[place] == data.voltage_v[int(at_s)]


def swinging(hold, *, n=2001, ohm=0.05):
    """2 A with 1 A up and down from row to row, at 10 Hz, through a resistance."""
    current = 2.0 + np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
    return Measurement(0.1 * np.arange(n), current, 4.0 - ohm * current, hold=hold)


@pytest.mark.parametrize(("hold", "share"), [("backward", 1.0), ("linear", 1.0 / 3.0)])
def test_the_heat_that_averages_lose_is_that_of_the_swing_within_them(hold, share):
    """R times the variance: 0.05 ohm * 1 A2 where a current is held, a third of it in straight lines."""
    thin = averaged_over(swinging(hold), step_s=1.0)
    np.testing.assert_allclose(thin.current_a[1:], 2.0)
    heat_w = thin.unresolved_heat_w("linear")
    assert heat_w[0] == 0.0
    np.testing.assert_allclose(heat_w[3:], 0.05 * share, rtol=1e-9)
    np.testing.assert_allclose(thin.take(slice(0, 50)).unresolved_heat_w("linear"), heat_w[:50], rtol=1e-9)


def test_the_heat_that_averages_lose_is_of_the_current_as_it_was_seen():
    """An instrument's fault is undone on the rows as measured: a current twice as large has twice the heat beside the
    voltage as measured, and a constant one none."""
    data = swinging("backward")
    thin = averaged_over(data, step_s=1.0)
    for factor in (2.0, 0.0):
        seen = thin.with_record(data.time_s, factor * data.current_a)
        expected = factor * thin.unresolved_heat_w("linear")
        np.testing.assert_allclose(seen.unresolved_heat_w("linear"), expected, atol=1e-12)


@pytest.mark.parametrize("hold", ["backward", "linear"])
def test_averages_of_steady_currents_lose_no_heat(hold):
    time = np.arange(6000.0)
    current = np.where(time % 2000.0 < 1200.0, 5.0, 0.0)
    data = Measurement(time, current, 4.0 - 0.02 * current - 1e-5 * time, hold=hold)
    thin, _ = condensed(data, 5.0, 100.0, Spacing(first_s=1.0, growth=0.5), hold)
    assert len(thin) < len(data) / 10
    np.testing.assert_allclose(thin.unresolved_heat_w(hold), 0.0, atol=1e-9)


def test_averages_lose_no_heat_over_a_gap():
    data = swinging("linear", n=400)
    apart = Measurement(
        np.concatenate([data.time_s, 3600.0 + data.time_s]),
        np.concatenate([np.zeros(400), np.full(400, 3.0)]),
        np.concatenate([np.full(400, 4.0), np.full(400, 3.8)]),
        hold="linear",
    )
    thin = averaged_over(apart, step_s=1.0)
    assert len(thin) < 90
    np.testing.assert_allclose(thin.unresolved_heat_w("linear"), 0.0, atol=1e-9)
