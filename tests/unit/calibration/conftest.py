"""A small cell test at two temperatures, simulated with parameters that the start file does not have."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.cell.relations import Constant
from aesi.records import Measurement

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
KINETIC_ENERGY, CONTACT_OHM, FILM_OHM_M2 = 52e3, 4e-3, 2e-3


@pytest.fixture(scope="session")
def start() -> Cell:
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    cell = cell.with_negative(diffusivity_ea_j_mol=30e3)
    return cell.with_positive(diffusivity_ea_j_mol=30e3)


@pytest.fixture(scope="session")
def truth(start) -> Cell:
    cell = start.with_negative(rate_ea_j_mol=KINETIC_ENERGY, diffusivity_ea_j_mol=40e3)
    cell = cell.with_positive(rate_ea_j_mol=KINETIC_ENERGY)
    film = {"film_ohm_m2": Constant(FILM_OHM_M2), "film_ea_j_mol": KINETIC_ENERGY}
    cell = cell.with_negative(**film).with_positive(**film)
    return replace(cell, contact_resistance_ohm=CONTACT_OHM)


def pulses(cell: Cell, degc: float, name: str) -> Measurement:
    """Pulses and rests from full to a third, every 5 s, 0.3 mV of noise."""
    time = np.arange(0.0, 9000.0, 5.0)
    phase = time % 1500.0
    current = np.select([phase < 300, phase < 340, phase < 640, phase < 680], [0.0, 8.0, 0.0, 3.0], 2.5)
    voltage = simulate(cell, time, current, 1.0, (), degc, "backward").voltage_v
    noise = 3e-4 * np.random.default_rng(int(degc) + 50).standard_normal(len(time))
    return Measurement(time, current, voltage + noise, np.full(len(time), degc), name)


@pytest.fixture(scope="session")
def records(truth) -> tuple[Measurement, ...]:
    return tuple(pulses(truth, degc, f"at_{degc:g}") for degc in (25.0, 0.0))
