"""A band widens away from the temperatures that the model was fitted to."""

import json

import numpy as np
import pytest

from aesi.conformal import WHOLE_DRIVE, FreeRunBands
from aesi.numerics.visited import Visited

DT = 1.0
N = 900
ROOM_DEGC = np.full(N, 25.0)
NOTHING_OPEN = np.zeros(N)


def bands() -> FreeRunBands:
    rng = np.random.default_rng(3)
    errors = [2e-3 * rng.standard_normal(N) for _ in range(5)]
    charge = np.concatenate([np.linspace(1.0, 0.8, N), np.linspace(0.2, 0.1, N)])
    seen = Visited.of(charge, np.concatenate([ROOM_DEGC, ROOM_DEGC + 5.0]))
    return FreeRunBands.fit({WHOLE_DRIVE: errors}, DT, seen=seen)


def test_at_another_temperature_the_band_grows_as_rates_do() -> None:
    made = bands()
    within, cold, hot, unknown = (
        made.along(DT, NOTHING_OPEN, temperature_degc=t)[1][0]
        for t in (ROOM_DEGC + 3.0, np.full(N, 10.0), np.full(N, 45.0), None)
    )
    assert within == unknown
    # exp(40 kJ/mol / R (1 / 283.15 K - 1 / 298.15 K)) = exp(0.855); from 30 to 45 degC exp(0.748).
    assert cold / within == pytest.approx(np.exp(0.855), rel=1e-3)
    assert hot / within == pytest.approx(np.exp(0.748), rel=1e-3)


def test_what_was_seen_is_saved_with_the_band() -> None:
    made = bands()
    state = json.loads(json.dumps(made.to_dict(), default=lambda a: a.tolist()))
    again, cold = FreeRunBands.from_dict(state), np.full(N, 0.0)
    for one, other in zip(
        made.along(DT, NOTHING_OPEN, temperature_degc=cold),
        again.along(DT, NOTHING_OPEN, temperature_degc=cold),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)
