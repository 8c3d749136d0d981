"""What a recalibration makes of records that differ in their charge: nothing, where they are of several days."""

import numpy as np
import pytest
from small_experiment import BPX

from aesi.physics import Cell, simulate
from aesi.pipeline.experiment.recalibrate import FitRecord, recalibrate
from aesi.pipeline.product.deviations import INITIAL_STATE
from aesi.records import Measurement

CELL = Cell.from_bpx(BPX)
OFF = 0.006


def discharged(name, charge_off):
    """A C/2 discharge from 0.5 to 0.02, of a cell that held more charge than it was told."""
    time_s = np.arange(0.0, 3450.0, 10.0)
    current = np.full(len(time_s), 0.5 * CELL.nominal_capacity_ah)
    run = simulate(CELL, time_s, current, 0.5 + charge_off)
    return FitRecord(
        Measurement(time_s, current, run.voltage_v, name=name), 0.5, np.ones(len(time_s), dtype=bool)
    )


def left_v(physics, record):
    given = physics.simulate(record.measurement, record.soc0, "linear").voltage_v
    return float(np.sqrt(np.mean((record.measurement.voltage_v - given) ** 2)))


def test_a_record_of_another_charge_does_not_move_the_cell():
    # Two records that hold less than the file says, and the next one as the file says.
    low = {name: discharged(name, -OFF) for name in ("one", "other")}
    fresh = discharged("next", 0.0)
    several = recalibrate(CELL, (), low, "linear")
    alone = recalibrate(CELL, (), {"one": low["one"]}, "linear")
    assert max(np.abs(several.deviations)) < 0.4 * max(np.abs(alone.deviations))
    assert left_v(several, fresh) < 0.4 * left_v(alone, fresh)


def test_of_one_record_its_charge_is_fitted():
    record = discharged("one", -OFF)
    found = recalibrate(CELL, (), {"one": record}, "linear")
    declared = recalibrate(CELL, (), {}, "linear")
    assert left_v(found, record) < 0.5 * left_v(declared, record)
    assert declared.deviations == pytest.approx(np.zeros(len(found.deviations)))


def test_an_initial_state_that_is_fitted_alone_is_the_charge_of_all_records():
    low = {name: discharged(name, -OFF) for name in ("one", "other")}
    found = recalibrate(CELL, (), low, "linear", INITIAL_STATE)
    declared = recalibrate(CELL, (), {}, "linear")
    assert 0.5 - OFF < found.soc0(0.5) < 0.5 - 0.5 * OFF
    assert left_v(found, low["one"]) < 0.5 * left_v(declared, low["one"])
