"""What a recalibration makes of records that differ in their charge: nothing, where they are of several days."""

from dataclasses import replace

import numpy as np
import pytest
from small_experiment import BPX

from aesi.errors import SimulationError
from aesi.numerics.metrics import rms
from aesi.physics import Cell, simulate
from aesi.pipeline.experiment import recalibrate as recalibration
from aesi.pipeline.experiment.config import parse_experiment
from aesi.pipeline.experiment.load import load
from aesi.pipeline.experiment.physics_models import DECLARED, RECALIBRATED
from aesi.pipeline.experiment.recalibrate import MODEL_ERROR_V, SETTLED, FitRecord, recalibrate
from aesi.pipeline.product.deviations import INITIAL_STATE, deviating
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
    given = physics.run_as_declared(record.measurement, record.soc0, "linear").voltage_v
    return float(np.sqrt(np.mean((record.measurement.voltage_v - given) ** 2)))


def test_a_record_of_another_charge_does_not_move_the_cell():
    # Two records that hold less than the file says, and the next one as the file says.
    low = {name: discharged(name, -OFF) for name in ("one", "other")}
    fresh = discharged("next", 0.0)
    several = recalibrate(CELL, (), low, "linear", own_charges=True)
    alone = recalibrate(CELL, (), {"one": low["one"]}, "linear")
    assert max(np.abs(several.deviations)) < 0.4 * max(np.abs(alone.deviations))
    assert left_v(several, fresh) < 0.4 * left_v(alone, fresh)


def test_of_one_record_its_charge_is_fitted():
    record = discharged("one", -OFF)
    found = recalibrate(CELL, (), {"one": record}, "linear")
    declared = recalibrate(CELL, (), {}, "linear")
    assert left_v(found, record) < 0.5 * left_v(declared, record)
    assert declared.deviations == pytest.approx(np.zeros(len(found.deviations)))


def test_a_record_that_no_fit_may_see_took_the_charge_of_the_training_record_from_its_fit(tmp_path):
    names = ("train", "test")
    for name, charge_off in zip(names, (-OFF, 0.0), strict=True):
        discharged(name, charge_off).measurement.to_frame().to_csv(tmp_path / f"{name}.csv", index=False)
    files = {role: [str(tmp_path / f"{role}.csv")] for role in names}
    config = parse_experiment(
        {
            "name": "one",
            "data": {"kind": "files", "dt_s": 10.0, "hold": "linear", **files},
            "cell": {"bpx": str(BPX), "soc0": 0.5},
        }
    )
    (train,) = load(config).split.train
    left_mv, declared_mv = (1e3 * rms(train.left_by(name)) for name in (RECALIBRATED, DECLARED))
    assert left_mv < 0.5 * declared_mv


def test_a_model_that_misses_40_mv_followed_them_as_far_as_one_that_misses_10():
    record = discharged("one", 0.0)
    missed_v = 0.04 * np.sin(record.measurement.time_s / 200.0)
    other = replace(record.measurement, voltage_v=record.measurement.voltage_v + missed_v)
    off = replace(record, measurement=other)
    found = recalibrate(CELL, (), {"one": off}, "linear")
    assert max(np.abs(found.deviations)) < 1.0
    # What it says that the model misses is what it leaves, as far as this settles; at least 10 mV.
    assert 1.0 <= left_v(found, off) / found.missed_v <= SETTLED
    assert recalibrate(CELL, (), {"one": record}, "linear").missed_v == MODEL_ERROR_V


def test_averaging_over_steps_moved_a_cell_that_is_as_declared(tmp_path):
    time_s = np.round(np.arange(0.0, 600.05, 0.1), 6)
    for name, seed in (("train", 0), ("test", 1)):
        current = np.random.default_rng(seed).normal(0.0, 30.0, 602)[np.ceil(time_s).astype(int)]
        run = simulate(CELL, time_s, current, 0.6, hold="backward")
        made = Measurement(time_s, current, run.voltage_v)
        made.to_frame().to_csv(tmp_path / f"{name}.csv", index=False)
    files = {role: [str(tmp_path / f"{role}.csv")] for role in ("train", "test")}
    config = parse_experiment(
        {"name": "one", "data": {"kind": "files", **files}, "cell": {"bpx": str(BPX), "soc0": 0.6}}
    )
    (train,) = load(config).split.train
    assert 1e3 * rms(train.left_by(DECLARED)) < 0.01
    assert 1e3 * rms(train.left_by(RECALIBRATED)) < 0.01


def test_an_initial_state_that_is_fitted_alone_is_the_charge_of_all_records():
    low = {name: discharged(name, -OFF) for name in ("one", "other")}
    found = recalibrate(CELL, (), low, "linear", INITIAL_STATE, own_charges=True)
    declared = recalibrate(CELL, (), {}, "linear")
    assert 0.5 - OFF < found.soc0(0.5) < 0.5 - 0.5 * OFF
    assert left_v(found, low["one"]) < 0.5 * left_v(declared, low["one"])


def test_a_model_that_fails_on_one_side_ended_the_fit(monkeypatch):
    record = discharged("one", -OFF)

    def failing(declared, effects, free, z, model):
        if max(z) > 0.0:
            raise SimulationError("it runs into volts")
        return deviating(declared, effects, free, z, model)

    everywhere = recalibrate(CELL, (), {"one": record}, "linear", INITIAL_STATE)
    monkeypatch.setattr(recalibration, "deviating", failing)
    found = recalibrate(CELL, (), {"one": record}, "linear", INITIAL_STATE)
    assert everywhere.shift < -0.3 * OFF
    assert found.shift == pytest.approx(everywhere.shift, rel=0.01)
