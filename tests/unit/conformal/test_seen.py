"""A band widens away from the states of charge and the temperatures that the model was fitted to."""

import json

import numpy as np
import pytest

from aesi.conformal import WHOLE_DRIVE, FreeRunBands
from aesi.conformal.seen import gap
from aesi.numerics.visited import LENGTH, Visited

DT = 1.0
N = 900
ROOM_DEGC = np.full(N, 25.0)


def pieces() -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Errors, gaps and states of charge of left-out pieces: 2 mV where others were near, 10 mV more away from them."""
    rng = np.random.default_rng(3)
    gaps = [np.abs(np.linspace(-1.0, 1.0, N)) * top for top in (0.1, 0.5, 0.9, 0.3, 0.7)]
    errors = [(2e-3 + 1e-2 * each) * rng.standard_normal(N) for each in gaps]
    return errors, gaps, [np.full(N, 0.5)] * len(gaps)


def bands() -> FreeRunBands:
    errors, gaps, _ = pieces()
    charge = np.concatenate([np.linspace(1.0, 0.8, N), np.linspace(0.2, 0.1, N)])
    seen = Visited.of(charge, np.concatenate([ROOM_DEGC, ROOM_DEGC + 5.0]))
    return FreeRunBands.fit({WHOLE_DRIVE: errors}, DT, [np.zeros(N)] * 5, gap=gaps, seen=seen)


def test_a_gap_is_nothing_on_visited_charges_and_one_far_from_them() -> None:
    seen = Visited.of(np.concatenate([np.linspace(1.0, 0.8, 300), np.linspace(0.2, 0.0, 300)]))
    gaps = gap(seen, np.array([0.9, 0.8 - LENGTH, 0.5, 0.1]))
    np.testing.assert_allclose(gaps, [0.0, np.sqrt(1 - np.exp(-1.0)), 1.0, 0.0], atol=0.02)


def test_the_band_holds_where_no_drive_had_been() -> None:
    made = bands()
    soc = np.linspace(0.8, 0.2, N)
    gaps = gap(made.seen, soc)
    error = (2e-3 + 1e-2 * gaps) * np.random.default_rng(9).standard_normal(N)
    low, high = made.along(DT, np.zeros(N), soc)
    middle = gaps > 0.8
    assert 0.8 < np.mean((low <= error) & (error <= high)) < 0.99
    assert 0.8 < np.mean(((low <= error) & (error <= high))[middle]) < 0.99
    assert high[middle].mean() > 3.0 * high[~middle].min()


def test_at_another_temperature_the_band_grows_as_rates_do() -> None:
    made = bands()
    soc = np.full(N, 0.9)
    within, cold, hot, unknown = (
        made.along(DT, np.zeros(N), soc, temperature_degc=t)[1][0]
        for t in (ROOM_DEGC + 3.0, np.full(N, 10.0), np.full(N, 45.0), None)
    )
    assert within == unknown
    # exp(40 kJ/mol / R (1 / 283.15 K - 1 / 298.15 K)) = exp(0.855); from 30 to 45 degC exp(0.748).
    assert cold / within == pytest.approx(np.exp(0.855), rel=1e-3)
    assert hot / within == pytest.approx(np.exp(0.748), rel=1e-3)


def test_what_was_seen_is_saved_with_the_band() -> None:
    made = bands()
    state = json.loads(json.dumps(made.to_dict(), default=lambda a: a.tolist()))
    again = FreeRunBands.from_dict(state)
    soc, cold = np.linspace(0.9, 0.3, N), np.full(N, 0.0)
    for one, other in zip(
        made.along(DT, np.zeros(N), soc, temperature_degc=cold),
        again.along(DT, np.zeros(N), soc, temperature_degc=cold),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)
