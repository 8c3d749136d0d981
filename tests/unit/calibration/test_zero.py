"""The zero of a cycler, from a slow record that ends nearly as full as it began."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.calibration.records.zero import ZERO_SHARE, zero_of
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


def test_a_cycle_that_stops_before_full_tells_nothing(start, cycle):
    assert zero_of(start, [stopped(start, cycle, 200)]).mean_a == 0.0


def test_the_zero_is_taken_out_of_slow_records_alone(start, cycle):
    zero = zero_of(start, [cycle])
    taken = zero.taken_out(cycle, start.nominal_capacity_ah).current_a
    assert taken[0] == 0.0
    assert np.abs(taken).max() == pytest.approx(start.capacity_ah / 20.0, abs=2.0 * zero.sd_a)
    fast = replace(cycle, current_a=20.0 * cycle.current_a)
    assert zero.taken_out(fast, start.nominal_capacity_ah) is fast


def test_a_record_of_rest_alone_ended_with_an_index_that_is_out_of_bounds(start, cycle):
    rest = replace(cycle, current_a=np.zeros(len(cycle)))
    assert zero_of(start, [rest]).sentences == ()
