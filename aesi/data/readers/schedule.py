"""Drive schedules: CSV with time_s and speed_m_s."""

from __future__ import annotations

from pathlib import Path

from aesi.data.readers.text import TextTable
from aesi.errors import DataError
from aesi.numerics.typing import Array


def read_speed(path: Path) -> tuple[Array, Array]:
    """Time (n,) s and speed (n,) m/s of a schedule file.

    Raises DataError where a column is missing or a cell is no number.
    """
    table = TextTable(path)
    try:
        places = tuple(table.header.index(name) for name in ("time_s", "speed_m_s"))
    except ValueError:
        raise DataError(f"{path.name}: a schedule has the columns time_s and speed_m_s.") from None
    time_s, speed_m_s = table.read(places)
    return time_s, speed_m_s
