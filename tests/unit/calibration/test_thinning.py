"""Fewer rows for fits: charge is kept, pulses stay pulses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.calibration.model import leniency, saturated
from aesi.calibration.records.prepared import fitted_rows_sentence, prepared
from aesi.calibration.records.thinning import thinned
from aesi.physics import initial_state, simulate
from aesi.physics.cell import Cell
from aesi.records import Measurement

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


def pulses(step_s: float = 0.1) -> Measurement:
    time = np.arange(0.0, 4000.0, step_s)
    current = np.where((time % 800 > 400) & (time % 800 < 430), 5.0, 0.0)
    return Measurement(time, current, 3.7 - 0.03 * current, np.full(len(time), 25.0))


def charge_ah(data: Measurement, hold: str) -> float:
    mean = data.current_a[1:] if hold == "backward" else 0.5 * (data.current_a[1:] + data.current_a[:-1])
    return float(np.sum(mean * np.diff(data.time_s))) / 3600.0


def test_a_pulse_test_keeps_its_charge_and_its_pulses_in_a_tenth_of_the_rows():
    data = pulses()
    thin = thinned(data, 3.0)
    assert len(thin.data) < 0.1 * len(data)
    assert charge_ah(thin.data, thin.hold) == pytest.approx(charge_ah(data, "backward"), rel=1e-3)
    assert thin.data.current_a.max() == pytest.approx(5.0, abs=1e-6)


@pytest.mark.parametrize("hold", ["linear", "backward"])
def test_a_thinned_record_kept_the_charge_of_a_held_current_whatever_was_declared(hold):
    rng = np.random.default_rng(0)
    time = np.concatenate([[0.0], np.cumsum(rng.choice([0.5, 1.0, 2.0, 5.0], 2000))])
    current = np.repeat(rng.normal(1.0, 2.0, 201), 10)[: len(time)]
    data = Measurement(time, current, 3.7 - 0.02 * current, hold=hold)
    thin = thinned(data, 3.0)
    assert len(thin.data) < len(data)
    assert thin.hold == hold
    assert charge_ah(thin.data, thin.hold) == pytest.approx(charge_ah(data, hold), rel=1e-4)


def test_a_drive_is_averaged_to_its_window_and_keeps_its_charge():
    time = np.arange(0.0, 600.0, 0.1)
    current = 3.0 * np.sin(time / 3.0) + 1.0
    thin = thinned(Measurement(time, current, 3.7 - 0.02 * current), 3.0)
    assert np.median(np.diff(thin.data.time_s)) == pytest.approx(1.0, abs=0.05)
    assert charge_ah(thin.data, thin.hold) == pytest.approx(
        charge_ah(Measurement(time, current, current), "linear"), rel=0.01
    )


def test_a_row_in_the_middle_of_a_step_is_not_believed_where_another_follows_soon():
    thin = thinned(pulses(), 3.0)
    after = np.flatnonzero(np.abs(np.diff(thin.data.current_a)) > 1.0) + 1
    assert not thin.trusted[after].any()
    assert thin.trusted.mean() > 0.9


def test_the_loss_is_square_when_small_and_linear_when_large():
    small, large = np.array([1e-3]), np.array([0.3, 0.6])
    assert saturated(small) == pytest.approx(small, rel=2e-3)
    assert np.diff(saturated(large) ** 2) == pytest.approx(2.0 * 0.015 * 0.3, rel=0.01)
    error = np.array([-0.2, -0.01, 0.003, 0.05])
    slope = (saturated(error + 1e-7) - saturated(error - 1e-7)) / 2e-7
    assert leniency(error) == pytest.approx(slope, rel=1e-5)


def drive(step_s: float, hold: str | None = None) -> Measurement:
    time = np.arange(0.0, 4000.0, step_s)
    current = 2.0 * np.sin(time / 1.3) * np.sign(np.sin(time / 90.0))
    return Measurement(time, current, 3.7 - 0.03 * current, name="drive", hold=hold)


@pytest.mark.parametrize(
    ("data", "taken"),
    [
        (drive(2.0), "as linear between rows; --hold backward takes it otherwise."),
        (drive(2.0, "backward"), "constant since the row before, as declared."),
        (drive(8.0), "constant since the row before, as loggers write; --hold linear takes it otherwise."),
        (drive(0.1), "averages over 1 s, with the current linear between them."),
        (
            drive(0.1, "backward"),
            "linear between them; --hold backward holds for rows that are not thinned.",
        ),
        (
            replace(pulses(), hold="linear"),
            "since the last current step, with the current linear between them.",
        ),
    ],
)
def test_how_the_current_was_taken_between_the_rows_of_a_fit_is_told(data, taken):
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    (ready,) = prepared(cell, [data], [thinned(data, cell.capacity_ah)], 0.8)
    assert fitted_rows_sentence(ready).endswith(taken)


def test_a_start_was_read_with_another_hold_than_its_record_is_simulated_with():
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    time, current = np.arange(1000.0), np.repeat(np.random.default_rng(1).normal(2.5, 4.0, 200), 5)
    loaded = Measurement(time, current, simulate(cell, time, current, 0.7).voltage_v).between(505.0, 1000.0)
    (ready,) = prepared(cell, [loaded], [thinned(loaded, cell.capacity_ah)], None)
    linear, backward = (initial_state(cell, loaded, hold=hold).soc for hold in ("linear", "backward"))
    assert ready.hold == loaded.hold_taken == "linear"
    assert ready.start.soc == linear
    assert linear != pytest.approx(backward, abs=1e-5)
