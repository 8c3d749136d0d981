"""Drive schedules: speed against time, bundled by name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from aesi.data.readers.schedule import read_speed
from aesi.errors import DataError, did_you_mean
from aesi.numerics.typing import Array

FOLDER = Path(__file__).parents[1] / "schedules"

TITLES = {
    "udds": "UDDS",
    "hwfet": "HWFET",
    "us06": "US06",
    "wltc_3b": "WLTC 3b",
    "artemis_urban": "Artemis Urban",
    "sc03": "SC03",
    "japan_10_15": "Japan 10-15",
    "nedc": "NEDC",
}


@dataclass(frozen=True, eq=False)
class Schedule:
    """time_s : (n,) s from 0, one row a second.  speed_m_s : (n,) m/s, never negative."""

    name: str
    title: str
    time_s: Array
    speed_m_s: Array

    @property
    def duration_s(self) -> float:
        """Length of the schedule."""
        return float(self.time_s[-1])


@cache
def schedule(name: str) -> Schedule:
    """A bundled schedule. Raises DataError for an unknown name, with the nearest one."""
    if name not in TITLES:
        raise DataError(
            f"There is no drive schedule {name!r}{did_you_mean(name, TITLES)} Known: {', '.join(TITLES)}."
        )
    time_s, speed_m_s = read_speed(FOLDER / f"{name}.csv")
    return Schedule(name, TITLES[name], time_s, speed_m_s)
