"""A current profile on disk, for a simulation or a prediction; a voltage is optional."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from aesi.data.channels.checks import Columns, check_finite, check_time
from aesi.data.channels.columns import map_columns
from aesi.data.channels.gaps import find_gaps
from aesi.data.channels.load_columns import load_columns
from aesi.data.channels.stamps import time_doubts
from aesi.data.channels.temperature import temperature_doubts
from aesi.data.read import measurement_in
from aesi.data.readers import open_table
from aesi.data.reading import Reading
from aesi.numerics.typing import Array


@dataclass(frozen=True, eq=False)
class CurrentProfile:
    """time_s, current_a : (n,) s, A (discharge positive).  voltage_v, temperature_degc : (n,) or None.

    notes : one sentence on each thing that the reader dropped, mapped or changed the sign of.
    """

    time_s: Array
    current_a: Array
    voltage_v: Array | None
    temperature_degc: Array | None
    notes: tuple[str, ...]


def read_current(path: str | Path, reading: Reading | None = None) -> CurrentProfile:
    """Read time and current, and voltage and temperature where the file has them.

    reading : how to read the file. A file with a voltage is checked as a measurement.
    Raises DataError naming file, column and first row.
    """
    told = reading or Reading()
    table = open_table(path, [given for given in told.columns.values() if given])
    needed = ("time_s", "current_a")
    if "voltage_v" in map_columns(table, told.columns, told.units, needed, told.selectors).position:
        found = measurement_in(table, told, max_rows=None)
        return CurrentProfile(
            found.time_s, found.current_a, found.voltage_v, found.temperature_degc, found.notes
        )
    data, context, _, notes = load_columns(table, told, needed)
    check_finite(data, context)
    check_time(data["time_s"], context)
    notes += [*_over_gaps(data), *time_doubts(data), *temperature_doubts(data, context)]
    return CurrentProfile(
        data["time_s"],
        data["current_a"],
        None,
        data.get("temperature_degc"),
        tuple(f"{context.file}: {note}" for note in notes),
    )


def _over_gaps(data: Columns) -> list[str]:
    """A note on each long interval between two rows with a current: intended in a profile given by its corners, but in
    a record rows are missing."""
    time, current = data["time_s"], data["current_a"]
    return [
        f"No rows for {time[k + 1] - time[k]:.6g} s from {time[k]:.10g} s on, where the current runs from "
        f"{current[k]:.4g} to {current[k + 1]:.4g} A; if rows are missing there, read one side of it: "
        f"--to-s {time[k]:.10g}."
        for k in find_gaps(data)
        if current[k] or current[k + 1]
    ]
