"""A current profile on disk, for a simulation or a prediction; voltage is welcome, not needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from aesi.data.checks import Columns, Context, check_finite, check_time
from aesi.data.columns import map_columns
from aesi.data.read import Sign, orient, read_measurement
from aesi.data.readers import open_table
from aesi.errors import DataError
from aesi.numerics.typing import Array


@dataclass(frozen=True, eq=False)
class CurrentProfile:
    """time_s, current_a : (n,) s, A (discharge positive).  voltage_v, temperature_degc : (n,) or None.

    notes : what the reader dropped, mapped or turned, one sentence each.
    """

    time_s: Array
    current_a: Array
    voltage_v: Array | None = None
    temperature_degc: Array | None = None
    notes: tuple[str, ...] = ()


def read_current(
    path: str | Path, columns: Mapping[str, str | None] | None = None, sign: Sign = "discharge-positive"
) -> CurrentProfile:
    """Read time and current, and what else of a measurement is there.

    columns, sign : as in `read_measurement`. A file with a voltage is checked as a measurement.
    Raises DataError naming file, column and first row.
    """
    table = open_table(path)
    file = table.path.name
    mapped = map_columns(table.header, columns, file, required=("time_s", "current_a"))
    if "voltage_v" in mapped.position:
        measured = read_measurement(path, columns, sign, max_rows=None)
        return CurrentProfile(
            measured.time_s,
            measured.current_a,
            measured.voltage_v,
            measured.temperature_degc,
            measured.notes,
        )
    quantities = tuple(mapped.position)
    arrays = table.read(tuple(mapped.position[q] for q in quantities))
    data: Columns = dict(zip(quantities, arrays, strict=True))
    if len(data["time_s"]) < 2:
        raise DataError(
            f"{file} has {len(data['time_s'])} rows below its header; a profile needs at least two."
        )
    context = Context(file, mapped.header, table.where)
    check_finite(data, context)
    check_time(data["time_s"], context)
    notes = [*table.notes, *mapped.notes]
    orient(data, mapped, sign, notes)
    return CurrentProfile(
        data["time_s"],
        data["current_a"],
        None,
        data.get("temperature_degc"),
        tuple(f"{file}: {note}" for note in notes),
    )
