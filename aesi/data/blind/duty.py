"""The tests of a case: drives, pulses, a slow discharge, each from a rest, of 25 to 60 minutes or one discharge."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.blind.case import RecordKind
from aesi.data.profiles.profile import Profile, ProfileBuilder
from aesi.numerics.typing import Array

SCHEDULES = ("udds", "hwfet", "us06", "wltc_3b", "artemis_urban", "sc03", "nedc")
FIRST_REST_S = 120.0
"""Rest at the beginning of every test, so that the first voltage is a rest voltage."""
SHORTEST_S = 1500.0
"""Tests last from this to LONGEST_S: long enough for salt and heat to respond, short enough for a PyBaMM run of
seconds."""
LONGEST_S = 3600.0
PULSE_C = 2.0
"""C-rate of a charge pulse."""
SLOW_DT_S = 10.0
"""Seconds a row of a slow discharge, as loggers write it."""
SLOW_C = 0.2
"""Rate of a slow discharge; it ends at LEAST_SOC."""
LEAST_SOC = 0.1


@dataclass(frozen=True)
class DutyConditions:
    """Conditions of a test.

    capacity_ah : of the cell.  rate : factor on the currents of drives and pulses; the C-rates below are those at 1.
    soc0 : at the first row.  dt_s : interval of rows, s.
    """

    capacity_ah: float
    rate: float
    soc0: float
    dt_s: float

    @property
    def builder(self) -> ProfileBuilder:
        """The builder of profiles for this cell, with the factor on the currents of drives, but not on pulses."""
        return ProfileBuilder(self.capacity_ah, dt_s=self.dt_s, scale=self.rate)


def drive(conditions: DutyConditions, rng: np.random.Generator) -> Profile:
    """Schedules in random order until 1,500 s are full; each followed by rest, charge pulse of 20 to 60 s, rest."""
    builder = conditions.builder
    pieces: list[Array] = [builder.rest(FIRST_REST_S)]
    while _seconds(pieces, conditions) < SHORTEST_S:
        room = LONGEST_S - _seconds(pieces, conditions)
        piece = [
            builder.drive(str(rng.choice(SCHEDULES))),
            builder.rest(float(rng.integers(60, 240))),
            builder.pulse(-PULSE_C * conditions.rate, float(rng.integers(20, 60))),
            builder.rest(float(rng.integers(60, 300))),
        ]
        if _seconds(piece, conditions) <= room:
            pieces += piece
    return builder.profile("drive", pieces, conditions.soc0)


def fast_charge(conditions: DutyConditions, rng: np.random.Generator) -> Profile:
    """Drive pieces with long 3C charges at a high state of charge, at which lithium plates."""
    builder = conditions.builder
    pieces: list[Array] = [builder.rest(FIRST_REST_S)]
    while _seconds(pieces, conditions) < SHORTEST_S:
        pieces += [
            builder.drive(str(rng.choice(("us06", "sc03", "artemis_urban")))),
            builder.rest(float(rng.integers(60, 180))),
            builder.pulse(-3.0 * conditions.rate, float(rng.integers(60, 120))),
            builder.rest(float(rng.integers(200, 400))),
        ]
    return builder.profile("fast_charge", pieces, conditions.soc0)


def pulses(conditions: DutyConditions, rng: np.random.Generator) -> Profile:
    """Discharge and charge pulses of 10 s with rests, 8 % of the charge taken out at 1C between them."""
    builder = conditions.builder
    pieces: list[Array] = [builder.rest(FIRST_REST_S)]
    while _seconds(pieces, conditions) < SHORTEST_S:
        strength = conditions.rate * float(rng.uniform(1.0, 2.0))
        pieces += [
            builder.pulse(strength, 10.0),
            builder.rest(60.0),
            builder.pulse(-0.75 * strength, 10.0),
            builder.rest(60.0),
            builder.pulse(conditions.rate, 0.08 * SECONDS_PER_HOUR / conditions.rate),
            builder.rest(float(rng.integers(120, 300))),
        ]
    return builder.profile("pulses", pieces, conditions.soc0)


def slow(conditions: DutyConditions, rng: np.random.Generator) -> Profile:
    """A discharge at C/5 down to a tenth of the charge, a row every 10 s, with rests before and after."""
    builder = ProfileBuilder(conditions.capacity_ah, dt_s=SLOW_DT_S)
    pieces = [
        builder.rest(FIRST_REST_S),
        builder.pulse(SLOW_C, (conditions.soc0 - LEAST_SOC) / SLOW_C * SECONDS_PER_HOUR),
        builder.rest(1200.0),
    ]
    return builder.profile("slow", pieces, conditions.soc0)


TESTS: Mapping[RecordKind, Callable[[DutyConditions, np.random.Generator], Profile]] = {
    "drive": drive,
    "pulses": pulses,
    "slow": slow,
    "fast_charge": fast_charge,
}


def _seconds(pieces: list[Array], conditions: DutyConditions) -> float:
    return sum(map(len, pieces)) * conditions.dt_s
