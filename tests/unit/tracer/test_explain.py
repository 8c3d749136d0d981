"""What a residual depends on: slow states at any spacing of rows, and shares that tell causes from noise."""

import numpy as np
import pytest

from aesi.records import Run
from aesi.tracer.report.explain import explain, features


def run_of(time_s, current_a):
    soc = 0.9 - np.cumsum(current_a) / 5e4
    names = ("c_sn", "c_sp", "c_e0", "c_eL")
    states = {name: np.sin(time_s / (200.0 + 70.0 * k)) for k, name in enumerate(names)}
    return Run(time_s, current_a, np.full(len(time_s), 3.7), {"soc": soc, **states})


def test_a_slow_state_follows_time_and_not_rows():
    uneven = np.concatenate([[0.0], np.geomspace(0.1, 3000.0, 80)])
    slow = features(run_of(uneven, np.full(len(uneven), 4.0)))["history"][:, 0]
    np.testing.assert_allclose(slow, 1.0 - np.exp(-uneven / 300.0), atol=1e-12)


def test_a_drop_that_follows_the_current_is_told_from_noise(rng):
    time = np.arange(0.0, 3000.0)
    run = run_of(time, np.repeat(rng.normal(2.0, 4.0, 100), 30))
    noise = 1e-3 * rng.normal(size=len(time))
    shares = explain([run], [8e-3 * run.current_a + noise])
    assert shares["current"] == pytest.approx(1.0, abs=0.01)
    assert shares["state of charge"] < 0.5
    assert max(explain([run], [noise]).values()) < 0.02
