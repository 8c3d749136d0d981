"""A cell and small synthetic records; the independent cases are in tests/reference."""

from pathlib import Path

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
FEW = (
    "series_resistance",
    "current_sensor_gain",
    "voltage_sensor_offset",
    "solid_diffusivity",
    "ocv_hysteresis",
)
NOISE_V = 1e-3


@pytest.fixture(scope="session")
def cell():
    return Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")


@pytest.fixture(scope="session")
def few():
    """Effects that are cheap to simulate."""
    return {name: CATALOGUE[name] for name in FEW}


def steps(n, scale_a, rng):
    """A current of random steps after a rest, with rests between them, discharging on average."""
    current = np.repeat(rng.normal(0.3, 0.7, n // 20 + 1), 20)[:n] * scale_a
    current[(np.arange(n) // 200) % 4 == 0] = 0.0
    return current


@pytest.fixture
def make(cell):
    """measurement(effects, seed): a noisy record of 2,400 s with the given effects in it."""

    def measurement(effects=(), seed=1, n=2400, soc0=0.9):
        rng = np.random.default_rng(seed)
        time = np.arange(float(n))
        current = steps(n, 45.0, rng)
        voltage = simulate(cell, time, current, soc0, effects).voltage_v
        noisy = voltage + NOISE_V * rng.normal(size=n)
        return Measurement(time, current, noisy, name="made")

    return measurement


@pytest.fixture
def slow_kinetics():
    """The cell and the record of an LG M50 at a right 25 degC whose reactions are half as fast as declared."""
    m50 = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    rng, time = np.random.default_rng(1), np.arange(0.0, 2400.0, 2.0)
    current, degc = steps(len(time), 6.0, rng), np.full(len(time), 25.0)
    truth = (CATALOGUE["charge_transfer_kinetics"].activate(),)
    voltage = simulate(m50, time, current, 0.9, truth, temperature_degc=degc).voltage_v
    noisy = voltage + 5e-4 * rng.normal(size=len(time))
    return m50, Measurement(time, current, noisy, degc, "slow", hold="linear")
