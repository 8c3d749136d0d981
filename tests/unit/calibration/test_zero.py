"""The zero of a cycler, from a slow record that ends nearly as full as it began."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.calibration.records.zero import ZERO_SHARE, steadily_flowing, zero_of
from aesi.physics import simulate
from aesi.records import Measurement

ZERO_A = 7e-3


@pytest.fixture(scope="module")
def cycle(start) -> Measurement:
    """C/20 down to a twentieth, and as much charge back; its current reads 7 mA too much wherever it flows."""
    hour = 3600.0
    time = np.arange(0.0, 42.0 * hour, 120.0)
    true_a = np.select(
        [time <= 1.0 * hour, time <= 20.0 * hour, time <= 21.0 * hour, time <= 40.0 * hour], [0, 1, 0, -1], 0
    )
    current = true_a * start.capacity_ah / 20.0
    voltage = simulate(start, time, current, 1.0, (), None, "backward").voltage_v
    return Measurement(time, current + ZERO_A * (true_a != 0), voltage, None, "cycle")


def test_a_cycle_from_full_to_full_tells_the_zero_of_its_current(start, cycle):
    zero = zero_of(start, [cycle])
    assert abs(zero.mean_a - ZERO_A) < 2.0 * zero.sd_a
    assert zero.sd_a < 1e-3
    assert "7.0 +/-" in zero.sentences[0]
    assert "too high" in zero.sentences[0]


def test_without_its_charge_the_zero_is_that_of_cyclers(start, cycle):
    discharge = cycle.take(slice(0, len(cycle) // 2))
    zero = zero_of(start, [discharge])
    assert zero.mean_a == 0.0
    assert zero.sd_a == pytest.approx(ZERO_SHARE * np.abs(discharge.current_a).max())
    assert not zero.sentences


def stopped(start, cycle: Measurement, rows: int) -> Measurement:
    """The cycle with that many rows of its charge left out."""
    last = int(np.flatnonzero(cycle.current_a)[-1])
    short = replace(cycle, current_a=np.where(np.arange(len(cycle)) > last - rows, 0.0, cycle.current_a))
    true_a = short.current_a - ZERO_A * (short.current_a != 0)
    voltage = simulate(start, short.time_s, true_a, 1.0, (), None, "backward").voltage_v
    return replace(short, voltage_v=voltage)


def test_a_charge_that_stops_a_little_short_does_not_pass_for_a_zero(start, cycle):
    rows = 8
    missing_ah = rows * 120.0 / 3600.0 * start.capacity_ah / 20.0
    flowed_h = 38.0 - rows * 120.0 / 3600.0
    zero, whole = zero_of(start, [stopped(start, cycle, rows)]), zero_of(start, [cycle])
    assert missing_ah / flowed_h > 1.5e-3  # what it would read too much with both ends taken as full
    assert abs(zero.mean_a - ZERO_A) < 0.4e-3
    assert zero.sd_a > 0.4 * missing_ah / flowed_h
    assert zero.sd_a > 1.5 * whole.sd_a


def test_a_cycle_that_stops_before_full_tells_nothing_and_says_so(start, cycle):
    zero = zero_of(start, [stopped(start, cycle, 200)])
    assert zero.mean_a == 0.0
    assert zero.sentences[0].startswith("cycle: its charge balance does not determine the offset")
    assert "has to be nearly full at both ends" in zero.sentences[0]


@pytest.mark.parametrize("noise_a", [2e-4, 1e-3, 2e-3])
def test_noise_at_rest_passed_for_a_current_and_hid_the_zero(start, cycle, noise_a):
    """From 0.2 mA on, a thousandth of the current, no rest was found after the charge, and nothing was said."""
    noise = noise_a * np.random.default_rng(0).standard_normal(len(cycle))
    noisy, quiet = (
        zero_of(start, [replace(cycle, current_a=cycle.current_a + noise)]),
        zero_of(start, [cycle]),
    )
    assert noisy.mean_a == pytest.approx(quiet.mean_a, abs=quiet.sd_a)
    assert len(noisy.sentences) == 1
    assert "too high" in noisy.sentences[0]


def test_a_current_at_rest_is_told_from_one_that_flows_whatever_flows_for_a_moment(start, cycle):
    pulsed = replace(cycle, current_a=np.where(np.arange(len(cycle)) == 600, 20.0, cycle.current_a))
    assert np.array_equal(steadily_flowing(pulsed), cycle.current_a != 0.0)
    alone = cycle.take(slice(100, 101))
    assert steadily_flowing(alone).tolist() == [True]


@pytest.mark.parametrize(
    ("rows", "why"), [(1200, "no rest after its charge"), (None, "ends with a discharge")]
)
def test_a_cycle_that_could_not_be_used_was_passed_over_in_silence(start, cycle, rows, why):
    """Of one that was cut off in its charge, and of one that starts with the charge."""
    kept = cycle.take(slice(0, rows)) if rows else replace(cycle, current_a=-cycle.current_a)
    zero = zero_of(start, [kept])
    assert zero.mean_a == 0.0
    assert [why in sentence for sentence in zero.sentences] == [True]


def test_the_zero_is_taken_out_of_slow_records_alone(start, cycle):
    zero = zero_of(start, [cycle])
    taken = zero.subtracted_from(cycle, start.nominal_capacity_ah).current_a
    assert taken[0] == 0.0
    assert np.abs(taken).max() == pytest.approx(start.capacity_ah / 20.0, abs=2.0 * zero.sd_a)
    fast = replace(cycle, current_a=20.0 * cycle.current_a)
    assert zero.subtracted_from(fast, start.nominal_capacity_ah) is fast


def test_a_record_of_rest_alone_ended_with_an_index_that_is_out_of_bounds(start, cycle):
    rest = replace(cycle, current_a=np.zeros(len(cycle)))
    assert zero_of(start, [rest]).sentences == ()
