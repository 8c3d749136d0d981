"""A check-up of the cell of the file: lithium that is gone is not taken for material."""

import numpy as np
import pytest

from aesi.calibration import Conditions, calibrate
from aesi.calibration.uncertainty.health import health_intervals, health_of
from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement

LOST = 0.1
"""Of the capacity, as the effect counts it."""


def record(cell, time_s, current_a, soc0, name):
    effects = (CATALOGUE["lithium_inventory_loss"].activate(loss=LOST),)
    run = simulate(cell, time_s, current_a, soc0, effects, 25.0, "backward", on_depletion="clip")
    rows = slice(0, int(np.argmax(np.append(run.voltage_v, 0.0) < cell.lower_voltage_v)))
    noise = 3e-4 * np.random.default_rng(len(time_s)).standard_normal(len(time_s))
    columns = (time_s, current_a, run.voltage_v + noise, np.full(len(time_s), 25.0))
    return Measurement(*(column[rows] for column in columns), name)


@pytest.mark.slow
def test_lost_lithium_was_taken_for_lost_material(start):
    slow = np.arange(0.0, 22 * 3600.0, 120.0)
    pulses = np.arange(0.0, 9000.0, 5.0)
    phase = pulses % 1500.0
    drawn = np.select([phase < 300, phase < 340, phase < 640, phase < 680], [0.0, 8.0, 0.0, 3.0], 2.5)
    records = [
        record(start, slow, np.where(slow < 600.0, 0.0, start.capacity_ah / 20), 1.0, "slow"),
        record(start, pulses, drawn, 1.0, "pulses"),
    ]
    found = calibrate(start, records, Conditions(same_cell=True))
    fresh, intervals = health_of(start), health_intervals(found)
    lithium_ah = fresh.inventory_ah - LOST * start.capacity_ah
    for name, true in (
        ("inventory_ah", lithium_ah),
        ("negative_ah", fresh.negative_ah),
        ("positive_ah", fresh.positive_ah),
    ):
        low, high = intervals[name]
        assert low < true < high
    assert health_of(found.cell).negative_ah == pytest.approx(fresh.negative_ah, rel=0.02)
