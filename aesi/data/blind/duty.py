"""Random duties: a rest, then drive schedules with rests and charge pulses between, for some two hours at 1 Hz."""

from __future__ import annotations

import numpy as np

from aesi.data.profile import Bench, Profile
from aesi.numerics.typing import Array

SCHEDULES = ("udds", "hwfet", "us06", "wltc_3b", "artemis_urban", "sc03", "nedc")
FIRST_REST_S = 120.0
SHORTEST_S = 5000.0
LONGEST_S = 8000.0
PULSE_C = 2.0


def duty(capacity_ah: float, rate: float, soc0: float, rng: np.random.Generator) -> Profile:
    """Schedules in random order until at least 5,000 s are full; each followed by rest, charge pulse, rest.

    rate : scale of the currents.  Pulses are 2C times the rate, 20 to 60 s.
    """
    bench = Bench(capacity_ah, dt_s=1.0, scale=rate)
    pieces: list[Array] = [bench.rest(FIRST_REST_S)]
    while sum(map(len, pieces)) < SHORTEST_S:
        room = LONGEST_S - sum(map(len, pieces))
        name = str(rng.choice(SCHEDULES))
        piece = [
            bench.drive(name),
            bench.rest(float(rng.integers(60, 240))),
            bench.pulse(-PULSE_C * rate, float(rng.integers(20, 60))),
            bench.rest(float(rng.integers(60, 300))),
        ]
        if sum(map(len, piece)) <= room:
            pieces += piece
    return bench.profile("duty", pieces, soc0)


def fast_charge(capacity_ah: float, rate: float, soc0: float, rng: np.random.Generator) -> Profile:
    """Drive pieces with long 3C charges at a high state of charge, where lithium plates."""
    bench = Bench(capacity_ah, dt_s=1.0, scale=rate)
    pieces: list[Array] = [bench.rest(FIRST_REST_S)]
    while sum(map(len, pieces)) < SHORTEST_S:
        pieces += [
            bench.drive(str(rng.choice(("us06", "sc03", "artemis_urban")))),
            bench.rest(float(rng.integers(60, 180))),
            bench.pulse(-3.0 * rate, float(rng.integers(60, 120))),
            bench.rest(float(rng.integers(200, 400))),
        ]
    return bench.profile("duty", pieces, soc0)
