"""The noise of a record, under loads and in channels of several kinds."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.physics import simulate
from aesi.records import Measurement
from aesi.tracer.case.noise import noise_floor_v, noise_of, quantum_v
from aesi.tracer.case.records import prepare_all


@pytest.mark.parametrize(("noise_v", "most_v"), [(2e-4, 7e-4), (1e-3, 1.3e-3)])
def test_the_drop_of_a_current_that_is_never_steady_was_told_as_noise(cell, rng, noise_v, most_v):
    """The symptom: 3.9 mV of noise in a US06 at 1 Hz, below which nothing was found."""
    time = np.arange(1200.0)
    current = 10.0 + np.convolve(rng.normal(0.0, 60.0, len(time)), np.ones(15) / 15, mode="same")
    voltage = simulate(cell, time, current, soc0=0.8).voltage_v
    told = noise_floor_v(voltage + noise_v * rng.normal(size=len(time)), current)
    assert noise_v < told < most_v  # what is left is the answer of kinetics and diffusion


def test_noise_floor_is_found_under_a_drive(rng):
    n = 5000
    current = np.repeat(rng.normal(0, 10, n // 50), 50)
    voltage = 3.8 - 2e-3 * current + 1e-3 * rng.normal(size=n)
    assert noise_floor_v(voltage, current) == pytest.approx(1e-3, rel=0.08)


def test_quantised_data_have_at_least_the_noise_of_the_quantum():
    voltage = np.round(np.linspace(4.0, 3.9, 3000), 2)
    assert noise_floor_v(voltage, np.ones(3000)) >= 0.01 / np.sqrt(12) * 0.999


def test_noise_of_half_a_step_lets_means_tell_more_than_the_step(rng):
    time = np.arange(20_000.0)
    voltage = 3.7 + 1e-5 * np.arange(20_000.0) + 1e-3 * rng.normal(size=len(time))
    data = Measurement(time, np.full(len(time), 3.0), 2e-3 * np.round(voltage / 2e-3), name="scattered")
    noise = noise_of(data, 3.0)
    assert noise.sd_v == pytest.approx(np.hypot(1e-3, 2e-3 / np.sqrt(12.0)), rel=0.05)
    assert noise.sd_of_means_v(np.array([1.0, 100.0])) == pytest.approx(
        noise.sd_v * np.array([1.0, 0.1]), rel=0.01
    )


def over_five_rows(values):
    return np.convolve(values, np.ones(5) / np.sqrt(5.0), mode="same")


@pytest.mark.parametrize("smooth", [over_five_rows, lambda values: np.repeat(values[::5], 5)])
def test_the_noise_of_a_filtered_or_held_channel_was_told_from_neighbouring_rows(cell, make, rng, smooth):
    data = make(n=6000)
    clean = simulate(cell, data.time_s, data.current_a, 0.9).voltage_v
    noise = smooth(rng.normal(size=len(data)))
    channel = replace(data, voltage_v=clean + 1e-3 * noise)
    assert noise_of(channel, 30.0).sd_v == pytest.approx(1e-3, rel=0.15)
    assert noise_of(channel, 30.0).rows > 2
    record = prepare_all(cell, [channel], 0.9, 0.0)[0]
    assert record.noise_v == pytest.approx(1e-3, rel=0.15)
    assert record.equivalent_white_v.min() > 1.4 * record.white_v.max()


def test_neither_white_noise_nor_a_relaxing_voltage_is_taken_for_that_of_a_filter(cell, make):
    data = make(n=6000)
    clean = replace(data, voltage_v=simulate(cell, data.time_s, data.current_a, 0.9).voltage_v)
    for one in (data, clean):
        noise = noise_of(one, 30.0)
        assert (noise.sd_v, noise.rows) == (noise_floor_v(one.voltage_v, one.current_a), 1)


def test_a_few_rows_that_are_off_make_no_noise():
    rng = np.random.default_rng(5)
    voltage = 3.7 + 1e-3 * rng.normal(size=20_000)
    voltage[rng.choice(len(voltage), 200, replace=False)] += 0.03
    assert noise_floor_v(voltage, np.full(len(voltage), 2.0)) == pytest.approx(1e-3, rel=0.05)


@pytest.mark.parametrize("noise_v", [0.0, 2e-4, 1e-3])
def test_the_resolution_is_the_least_move_between_neighbours_where_two_grids_are_offset(rng, noise_v):
    voltage = 3.7 + 1e-4 * np.cumsum(rng.normal(size=20_000)) + noise_v * rng.normal(size=20_000)
    grid_v = 6.4e-4 * np.round(voltage / 6.4e-4)
    grid_v[12_000:] += 1.5e-4
    assert quantum_v(np.round(grid_v, 5)) == pytest.approx(6.4e-4, abs=1.1e-5)


@pytest.mark.parametrize("rows", [150, 400])
def test_the_few_rows_of_a_slow_discharge_were_given_the_resolution_of_their_closest_values(rng, rows):
    voltage = np.linspace(4.1, 2.9, rows) + 1e-4 * rng.normal(size=rows)
    assert noise_floor_v(np.round(voltage, 5), np.ones(rows)) == pytest.approx(1e-4, rel=0.25)


def test_a_channel_that_holds_its_values_has_no_resolution_by_that(rng):
    voltage = 3.7 + 1e-3 * np.repeat(rng.normal(size=2_000), 5)
    assert quantum_v(voltage) < 1e-4
