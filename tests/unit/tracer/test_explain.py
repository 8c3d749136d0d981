"""What a residual depends on: slow states at any spacing of rows, and shares that tell causes from noise."""

import numpy as np
import pytest

from aesi.records import Run
from aesi.tracer.report.explain import Scales, explain, features


def run_of(time_s, current_a):
    soc = 0.9 - np.cumsum(current_a) / 5e4
    names = ("c_sn", "c_sp", "c_e0", "c_eL")
    states = {name: np.sin(time_s / (200.0 + 70.0 * k)) for k, name in enumerate(names)}
    return Run(time_s, current_a, np.full(len(time_s), 3.7), {"soc": soc, **states})


def test_a_slow_state_follows_time_and_not_rows():
    uneven = np.concatenate([[0.0], np.geomspace(0.1, 3000.0, 80)])
    run = run_of(uneven, np.full(len(uneven), 4.0))
    slow = features(run, Scales.of([run]))["history"][:, 0]
    np.testing.assert_allclose(slow, 1.0 - np.exp(-uneven / 300.0), atol=1e-12)


def test_a_drop_that_follows_the_current_is_told_from_noise(rng):
    time = np.arange(0.0, 3000.0)
    run = run_of(time, np.repeat(rng.normal(2.0, 4.0, 100), 30))
    noise = 1e-3 * rng.normal(size=len(time))
    shares = explain([run], [8e-3 * run.current_a + noise])
    assert shares["current"] == pytest.approx(1.0, abs=0.01)
    assert shares["state of charge"] < 0.5
    assert max(explain([run], [noise]).values()) < 0.02


def test_a_drop_that_follows_the_current_was_half_explained_in_two_records_of_different_loads(rng):
    time = np.arange(0.0, 3000.0)
    drive = np.repeat(rng.normal(2.0, 4.0, 100), 30)
    gentle, hard = run_of(time, 0.3 * drive), run_of(time, drive)
    assert explain([gentle, hard], [5e-3 * r.current_a for r in (gentle, hard)])["current"] > 0.99


def test_a_slope_over_the_charge_and_a_drift_are_the_same_in_several_records():
    time = np.arange(0.0, 6000.0)
    early, late = (run_of(time, np.full(len(time), current_a)) for current_a in (2.0, 4.0))
    assert explain([early, late], [r.series["soc"] - 0.5 for r in (early, late)])["state of charge"] > 0.99
    short, long = (run_of(time[:n], np.full(n, 4.0)) for n in (2000, 6000))
    assert explain([short, long], [1e-6 * r.time_s for r in (short, long)])["time"] > 0.99
