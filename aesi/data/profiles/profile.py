"""Current profiles: drive schedules, rests and pulses in a row, and the roles of the paper's experiment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.profiles.drive import schedule
from aesi.data.profiles.vehicle import Pack, Vehicle
from aesi.numerics.typing import Array


@dataclass(frozen=True, eq=False)
class Profile:
    """A current profile.

    time_s : (n,) s from 0, evenly spaced.  current_a : (n,) A, discharge positive, linear between rows.
    soc0 : intended initial state of charge.
    """

    name: str
    time_s: Array
    current_a: Array
    soc0: float

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def charge_ah(self) -> float:
        """Net discharged charge of the profile, Ah."""
        return float(np.trapezoid(self.current_a, self.time_s)) / SECONDS_PER_HOUR


@dataclass(frozen=True)
class ProfileBuilder:
    """Builds a current profile from pieces: rests, pulses and drives, each the current (n,) A, discharge positive.

    capacity_ah : of the cell, Ah.  dt_s : interval of rows, s.  scale : factor on the currents of drives.
    """

    capacity_ah: float
    dt_s: float
    scale: float = 1.0

    def rest(self, seconds: float) -> Array:
        """No current."""
        return np.zeros(self._rows(seconds))

    def pulse(self, c_rate: float, seconds: float) -> Array:
        """Constant current at a C-rate, positive on discharge."""
        return np.full(self._rows(seconds), c_rate * self.capacity_ah)

    def drive(self, name: str) -> Array:
        """The current of a bundled schedule in a vehicle with a pack of such cells, times `scale`, without the
        schedule's last row."""
        vehicle = Vehicle(pack=Pack.for_capacity(self.capacity_ah))
        return self.scale * vehicle.cell_current_a(schedule(name), self.dt_s)[:-1]

    def profile(self, name: str, pieces: Sequence[Array], soc0: float) -> Profile:
        """The pieces one after the other."""
        current: Array = np.concatenate(pieces)
        time: Array = (self.dt_s * np.arange(len(current))).astype(np.float64)
        return Profile(name, time, current, soc0)

    def _rows(self, seconds: float) -> int:
        return round(seconds / self.dt_s)


TRAIN = ("udds", "hwfet", "us06", "wltc_3b", "udds", "hwfet", "us06")
VALID = ("artemis_urban",)
LEAD_S = 12.0
"""Rest at the start; BEFORE_PULSE_S, PULSE_S and AFTER_PULSE_S make the pulse after each drive, at PULSE_C, as in the
paper's experiment."""
BEFORE_PULSE_S = 60.0
PULSE_S = 20.0
AFTER_PULSE_S = 140.0
PULSE_C = 5.0
OTHER_LOAD = 2.0
"""Factor on the validation and test currents: from 1.5C to 3.1C, which the paper's reach and training covers."""


def with_pulses(
    builder: ProfileBuilder,
    name: str,
    schedules: Sequence[str],
    soc0: float,
    pulse_c: float,
) -> Profile:
    """A rest, then each schedule followed by a rest, a charge pulse of `pulse_c` and a rest.

    The times add 220 s a schedule and 12 s at the start; a pulse of 0 leaves only the rests.
    """
    pieces = [builder.rest(LEAD_S)]
    for one in schedules:
        pieces += [
            builder.drive(one),
            builder.rest(BEFORE_PULSE_S),
            builder.pulse(-pulse_c, PULSE_S),
            builder.rest(AFTER_PULSE_S),
        ]
    return builder.profile(name, pieces, soc0)


def paper_profiles(
    capacity_ah: float, dt_s: float, pulse_c: float = PULSE_C, other_load: float = OTHER_LOAD
) -> dict[str, tuple[Profile, ...]]:
    """The paper's experiment by role: train, valid, test; a row every dt_s (s).

    Training: UDDS, HWFET, US06, WLTC, then the first three again, each followed by rest, pulse and rest:
    8,820 s, 88,200 rows at 10 Hz. The paper states that number and the four schedules, not how they add up to
    it; one more pass of three with 220 s around each pulse is this project's reading. Validation and test
    profiles have no pulses, start inside the range of charge that training goes through, and stay in it.

    pulse_c : C-rate of the training profile's charge pulses.  other_load : times the vehicle's current in the
    validation and test profiles, whose schedules are milder than those of training.
    """
    builder, loaded = ProfileBuilder(capacity_ah, dt_s), ProfileBuilder(capacity_ah, dt_s, scale=other_load)
    return {
        "train": (with_pulses(builder, "train", TRAIN, 0.68, pulse_c),),
        "valid": (with_pulses(loaded, "artemis_urban", VALID, 0.60, 0.0),),
        "test": (
            with_pulses(loaded, "sc03", ("sc03",), 0.64, 0.0),
            with_pulses(loaded, "japan_10_15", ("japan_10_15",), 0.56, 0.0),
            with_pulses(loaded, "nedc", ("nedc",), 0.50, 0.0),
        ),
    }
