"""Thinning, noise floor, initial states and continuations."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.records import Measurement
from aesi.tracer.records import noise_floor_v, prepare, prepare_test, thinned


def measured(cell, time_s, current_a, soc0=0.8, **more):
    voltage = np.full(len(time_s), float(cell.rest_voltage_v(soc0)[0]))
    return Measurement(time_s, current_a, voltage, name="m", **more)


def test_thinning_keeps_charge_and_the_first_row(cell, rng):
    time = np.arange(0, 600, 0.1)
    current = 5 + np.cumsum(rng.normal(0, 0.1, len(time)))
    thin = thinned(measured(cell, time, current), 1.0)
    assert thin.time_s[0] == 0.0
    assert np.median(np.diff(thin.time_s)) == pytest.approx(1.0)
    whole = np.trapezoid(current, time)
    # windows are centred: the ends differ by half a second of a current that wanders by a tenth an instant
    assert np.trapezoid(thin.current_a, thin.time_s) == pytest.approx(whole, rel=5e-3)


def test_noise_floor_is_found_under_a_drive(rng):
    n = 5000
    current = np.repeat(rng.normal(0, 10, n // 50), 50)
    voltage = 3.8 - 2e-3 * current + 1e-3 * rng.normal(size=n)
    assert noise_floor_v(voltage, current) == pytest.approx(1e-3, rel=0.08)


def test_quantised_data_have_at_least_the_noise_of_the_quantum():
    voltage = np.round(np.linspace(4.0, 3.9, 3000), 2)
    assert noise_floor_v(voltage, np.ones(3000)) >= 0.01 / np.sqrt(12) * 0.999


def test_state_of_charge_is_read_from_the_rest_voltage(cell):
    time = np.arange(600.0)
    current = np.where(time < 30, 0.0, 5.0)
    record = prepare(cell, measured(cell, time, current, soc0=0.62), None, 0.3)
    assert record.soc0 == pytest.approx(0.62, abs=1e-3)
    assert record.n_fit == 420
    assert not record.soc0_given


def test_a_record_that_starts_under_load_needs_a_state_of_charge(cell):
    data = measured(cell, np.arange(600.0), np.full(600, 10.0))
    with pytest.raises(DataError, match="not at rest"):
        prepare(cell, data, None, 0.3)
    assert prepare(cell, data, 0.8, 0.3).soc0 == 0.8


def test_a_given_state_far_from_the_rest_voltage_is_not_believed(cell):
    data = measured(cell, np.arange(600.0), np.zeros(600), soc0=0.5)
    record = prepare(cell, data, 0.9, 0.0)
    assert record.soc0 == pytest.approx(0.5, abs=1e-3)
    assert "the voltage is believed" in record.notes[0]


def test_a_continuation_is_judged_only_after_what_was_seen(cell):
    time = np.arange(900.0)
    whole = measured(cell, time, np.where(time < 30, 0.0, 5.0))
    seen, rest = whole.between(0, 600), whole.between(600, 900)
    for test in (whole, rest):
        record = prepare_test(cell, test, [seen], None)
        assert record.seen_rows == 600
        assert len(record.data) == 900
    other = replace(rest, time_s=rest.time_s + 5000.0, current_a=np.zeros(300))
    assert prepare_test(cell, other, [seen], None).seen_rows == 0
