"""A measurement in any format that is read, written as CSV: in this project's columns, or in BDF."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.read import read
from aesi.data.reading import Reading
from aesi.data.written import write_csv
from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.over_time import extent
from aesi.records import Measurement

DIGITS = 10
"""Of what is written, besides the time: more than any instrument has."""
WrittenLayout = Literal["aesi", "bdf"]
BDF_NAMES = {
    "time_s": "Test Time / s",
    "voltage_v": "Voltage / V",
    "current_a": "Current / A",
    "temperature_degc": "Surface Temperature T1 / degC",
}


def convert_file(
    path: Path, out: Path, reading: Reading | None = None, layout: WrittenLayout = "aesi"
) -> Measurement:
    """Read `path`, check it as every command does, and write it whole to `out`; returns what was written.

    Raises DataError where it cannot be used as a measurement, or `out` cannot be written.
    """
    record = read(path, reading or Reading(), max_rows=None)
    table = record.to_frame()
    if layout == "bdf":
        table["current_a"] = 0.0 - record.current_a
        table = table[[name for name in BDF_NAMES if name in table]].rename(columns=BDF_NAMES)
    try:
        write_csv(out, table, DIGITS)
    except OSError as error:
        raise DataError(f"{out} cannot be written: {error.strerror or error}.") from None
    return record


def record_lines(record: Measurement) -> list[str]:
    """What a record holds, a sentence each, for whoever checks a conversion."""
    step = np.diff(record.time_s)
    charge = record.current_a[1:] * step / SECONDS_PER_HOUR
    out, into = float(np.sum(charge[charge > 0])), float(np.sum(-charge[charge < 0]))
    lines = [
        f"{extent(record.time_s)}, every {np.median(step):.4g} s in the median; {_range(record.voltage_v, 'V')}.",
        f"Current {_range(record.current_a, 'A')}, positive on discharge: {out:.4g} Ah discharged, {into:.4g} Ah "
        "charged.",
    ]
    if record.temperature_degc is not None:
        lines.append(f"Temperature {_range(record.temperature_degc, 'degC')}.")
    return lines


def _range(values: Array, unit: str) -> str:
    return f"{np.min(values):.4g} to {np.max(values):.4g} {unit}"
