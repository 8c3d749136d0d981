"""Writing of columns as CSV, and conversion of measurement files to this project's columns or to BDF."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from aesi.constants import MILLI, SECONDS_PER_HOUR
from aesi.data.channels.implausible.responses import ENOUGH_STEPS, step_resistance_ohm
from aesi.data.channels.implausible.scale import USUAL_RESISTANCE_OHM_AH
from aesi.data.read import read
from aesi.data.reading import Reading
from aesi.errors import DataError, not_written
from aesi.numerics.files.whole import write_whole
from aesi.numerics.typing import Array
from aesi.over_time import extent, range_words
from aesi.records import Measurement

if TYPE_CHECKING:
    import pandas as pd

TIME_DIGITS = 15
"""Significant digits of times, all that a double holds: seconds since 1970 need ten before the decimal point."""
DIGITS = 10
"""Significant digits of the other columns: more than any instrument has."""
WrittenLayout = Literal["aesi", "bdf"]
BDF_NAMES = {
    "time_s": "Test Time / s",
    "voltage_v": "Voltage / V",
    "current_a": "Current / A",
    "temperature_degc": "Surface Temperature T1 / degC",
}


def write_csv(path: Path, table: pd.DataFrame, digits: int = DIGITS) -> None:
    """Write a table in one piece; compressed where the name ends in .gz.

    table : its first column, the time in s or another that rises, is written with TIME_DIGITS.
    digits : significant digits of the other columns.
    Raises OSError where the file cannot be written.
    """
    time = table.columns[0]
    shown = table.assign(**{time: [f"{stamp:.{TIME_DIGITS}g}" for stamp in table[time]]})
    text = shown.to_csv(index=False, float_format=f"%.{digits}g", lineterminator="\n")
    zipped = path.suffix.lower() == ".gz"
    write_whole(
        path, gzip.compress(text.encode(), mtime=0) if zipped else text
    )  # without the hour, as a CSV is


def convert_file(
    path: Path,
    out: Path,
    reading: Reading | None = None,
    layout: WrittenLayout = "aesi",
    admit: Callable[[Measurement], None] | None = None,
) -> Measurement:
    """Read `path`, check it as every command does, and write it in one piece to `out`; returns the written measurement.

    admit : a further check, which raises before anything is written.
    Raises DataError where `path` cannot be used as a measurement, or `out` cannot be written.
    """
    record = read(path, reading or Reading(), max_rows=None)
    if admit is not None:
        admit(record)
    table = record.to_frame()
    if layout == "bdf":
        table["current_a"] = 0.0 - record.current_a
        table = table[[name for name in BDF_NAMES if name in table]].rename(columns=BDF_NAMES)
    try:
        write_csv(out, table)
    except OSError as error:
        raise DataError(not_written(out, error)) from None
    return record


def record_lines(record: Measurement, *, of_cell: bool = False) -> list[str]:
    """Sentences on the content of a record, to check a conversion.  of_cell : the record is known to be of a cell."""
    step = np.diff(record.time_s)
    charge = record.steps_as(record.hold_taken) / SECONDS_PER_HOUR
    out, into = float(np.sum(charge[charge > 0])), float(np.sum(-charge[charge < 0]))
    lines = [
        f"{extent(record.time_s)}, every {np.median(step):.4g} s in the median; {_range(record.voltage_v, 'V')}.",
        f"Current {_range(record.current_a, 'A')}, positive on discharge: {out:.4g} Ah discharged, {into:.4g} Ah "
        "charged.",
    ]
    if not of_cell:
        lines += _size_line(record)
    if record.temperature_degc is not None:
        lines.append(f"Temperature {_range(record.temperature_degc, 'degC')}.")
    return lines


def _size_line(record: Measurement) -> list[str]:
    """The size of cell that fits the resistance at current steps: nothing else in a record shows kA or a C-rate."""
    columns = {"time_s": record.time_s, "current_a": record.current_a, "voltage_v": record.voltage_v}
    resistance = step_resistance_ohm(columns)
    if resistance is None:
        return [
            "Of what cells it can be, and so the unit of the current, is not told: fewer than "
            f"{ENOUGH_STEPS} steps of the current are clear, or the voltage does not follow them; --cell FILE checks "
            "it."
        ]
    low, high = (_plain(each / resistance, 2) for each in USUAL_RESISTANCE_OHM_AH)
    return [
        f"Steps of the current show {_plain(MILLI * resistance, 3)} mohm, as cells of {low} to {high} Ah do; if it is "
        "none of these, the current is in another unit than A (--unit current_a=...), or scaled, or, of a larger cell, "
        "the voltage was taken with the drop of its leads; --cell FILE checks it."
    ]


def _plain(value: float, digits: int) -> str:
    """A number to so many significant digits, without an exponent up to a million: '140' and not '1.4e+02'."""
    return f"{float(f'{value:.{digits}g}'):g}"


def _range(values: Array, unit: str) -> str:
    return f"{range_words(f'{np.min(values):.4g}', f'{np.max(values):.4g}')} {unit}"
