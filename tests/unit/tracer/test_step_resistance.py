"""The resistance within seconds of a step of the current, from records whose resistance is known."""

import numpy as np
import pytest

from aesi.tracer.report.step_resistance import CurrentSteps

OHM, SLOW_OHM, SLOW_S = 0.02, 0.03, 400.0


def drive(n=6000, dt_s=1.0, seed=0):
    """(time, current, soc): a new current every few seconds."""
    rng = np.random.default_rng(seed)
    time_s = dt_s * np.arange(n)
    held = max(round(4.0 / dt_s), 1)
    current_a = np.repeat(rng.normal(1.0, 2.0, n // held + 1), held)[:n]
    return time_s, current_a, np.linspace(0.95, 0.05, n)


def voltage(time_s, current_a, soc, ohm=OHM, lag_s=0.0):
    """V of a resistance, a slow element that hardly moves in seconds, and a sloped open-circuit voltage."""
    rows = np.diff(time_s, prepend=time_s[0])
    slow = np.zeros(len(time_s))
    for k in range(1, len(time_s)):
        decay = np.exp(-rows[k] / SLOW_S)
        slow[k] = decay * slow[k - 1] + (1.0 - decay) * SLOW_OHM * current_a[k]
    out = 3.2 + 0.8 * soc - ohm * current_a - slow
    return np.interp(time_s - lag_s, time_s, out)


@pytest.mark.parametrize("dt_s", [0.1, 1.0, 2.0])
def test_an_ohmic_cell_has_its_resistance_at_any_charge_and_current(dt_s):
    time, current, soc = drive(round(6000 / dt_s), dt_s)
    steps = CurrentSteps.of(time, current, soc, {"measured": voltage(time, current, soc)})
    for found in (steps.by_soc(), steps.by_current()):
        assert len(found.x) >= 5
        np.testing.assert_allclose(found.ohm["measured"], OHM, rtol=0.03)


def test_a_voltage_that_lags_shows_the_same():
    time, current, soc = drive()
    late = voltage(time, current, soc, lag_s=0.4)
    steps = CurrentSteps.of(time, current, soc, {"measured": late})
    np.testing.assert_allclose(steps.by_soc().ohm["measured"], OHM, rtol=0.04)


def test_a_resistance_that_depends_on_charge_and_one_that_depends_on_current_are_shown():
    time, current, soc = drive()
    kinetic = 3.2 + 0.8 * soc - 0.05 * np.arcsinh(current / 2.0)
    rising = voltage(time, current, soc, ohm=OHM * (2.0 - soc))
    steps = CurrentSteps.of(time, current, soc, {"rising": rising, "kinetic": kinetic})
    by_soc, by_current = steps.by_soc(), steps.by_current()
    np.testing.assert_allclose(by_soc.ohm["rising"], OHM * (2.0 - by_soc.x), rtol=0.05)
    smallest, largest = np.argmin(np.abs(by_current.x)), np.argmax(np.abs(by_current.x))
    assert by_current.ohm["kinetic"][largest] < 0.8 * by_current.ohm["kinetic"][smallest]


def test_what_shows_no_resistance_gives_none():
    time, current, soc = drive()
    volts = voltage(time, current, soc)
    constant = np.full(len(time), 2.0)
    assert CurrentSteps.of(time, constant, soc, {"measured": volts}) is None
    assert CurrentSteps.of(3.0 * time, current, soc, {"measured": volts}) is None
    assert CurrentSteps.of(time[:3], current[:3], soc[:3], {"measured": volts[:3]}) is None
    few = CurrentSteps.of(time[:40], current[:40], soc[:40], {"measured": volts[:40]})
    assert len(few.by_soc().x) == 0


def test_an_uncertain_resistance_and_a_model_that_stopped_are_nan():
    time, current, soc = drive()
    volts = voltage(time, current, soc)
    stopped = np.where(time < 3000.0, volts, np.nan)
    noisy = volts + np.random.default_rng(1).normal(0.0, 1.0, len(time))
    found = CurrentSteps.of(
        time, current, soc, {"measured": volts, "stopped": stopped, "noisy": noisy}
    ).by_soc()
    assert np.isfinite(found.ohm["measured"]).all()
    np.testing.assert_array_equal(np.isfinite(found.ohm["stopped"]), found.x > 0.5)
    assert np.isnan(found.ohm["noisy"]).all()


def test_a_record_of_unknown_charge_was_in_the_bin_near_full():
    """Where no model can be simulated on one of several parts, a search that had ended could not be written."""
    time, current, soc = drive()
    volts = voltage(time, current, soc)
    known, unknown = (
        CurrentSteps.of(time, current, soc_known, {"measured": volts})
        for soc_known in (soc, np.full(len(time), np.nan))
    )
    alone, both = known.by_soc(), CurrentSteps.together([known, unknown]).by_soc()
    np.testing.assert_array_equal(both.x, alone.x)
    np.testing.assert_array_equal(both.ohm["measured"], alone.ohm["measured"])
    assert unknown.by_soc().x.size == 0
    assert unknown.by_current().x.size > 0


def test_rows_across_a_gap_are_left_out():
    time, current, soc = drive()
    volts = voltage(time, current, soc) - np.where(time < 3000.0, 0.0, 1.0)
    kept = np.abs(time - 3000.0) > 60.0
    steps = CurrentSteps.of(time[kept], current[kept], soc[kept], {"measured": volts[kept]})
    np.testing.assert_allclose(steps.by_soc().ohm["measured"], OHM, rtol=0.03)


def test_records_with_other_rows_are_not_mixed():
    fine, coarse = drive(3000), drive(600, dt_s=2.0)
    both = [CurrentSteps.of(*one, {"measured": voltage(*one)}) for one in (fine, fine, coarse)]
    assert len(CurrentSteps.together(both).soc) == 2 * len(both[0].soc)
