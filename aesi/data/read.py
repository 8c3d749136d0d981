"""Read a file into a Measurement; a refusal is one sentence that gives the reason."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from aesi.advice import advises_python, with_arguments
from aesi.data.channels.checks import Columns, Context, check_constant, check_finite, check_ranges, check_time
from aesi.data.channels.columns import QUANTITIES, REQUIRED, Mapped
from aesi.data.channels.gaps import ambiguous_charge_notes, without_gaps
from aesi.data.channels.glitches import glitch_doubts, glitches
from aesi.data.channels.implausible.scale import check_scale
from aesi.data.channels.implausible.sign import check_magnitudes, check_sign
from aesi.data.channels.lag import aligned
from aesi.data.channels.load_columns import keep_rows, load_columns
from aesi.data.channels.stamps import time_doubts
from aesi.data.channels.stuck import check_stuck_current, check_stuck_voltage, held_doubts
from aesi.data.channels.temperature import temperature_doubts
from aesi.data.readers import open_table
from aesi.data.readers.formats.format import Sign
from aesi.data.readers.table import TableFile
from aesi.data.reading import Duplicates, Reading, by_quantity, column_name, record_name
from aesi.data.resample import decimate
from aesi.data.state import Direction
from aesi.errors import InputError
from aesi.records import Measurement

__all__ = ["Duplicates", "Reading", "Sign", "read", "read_measurement"]

MAX_ROWS = 2_000_000
"""A tenth of a second for two days; more rows are decimated, and a note says so."""


@advises_python
def read_measurement(
    path: str | Path,
    columns: Mapping[str, str | float | None] | None = None,
    sign: Sign | None = None,
    max_rows: int | None = MAX_ROWS,
    *,
    units: Mapping[str, str] | None = None,
    state: str | None = None,
    state_words: Mapping[str, Direction] | None = None,
    cycle: int | str | None = None,
    step: int | str | None = None,
    start_s: float | None = None,
    stop_s: float | None = None,
    duplicates: Duplicates | None = None,
    name: str | None = None,
) -> Measurement:
    """Read one continuous test: CSV (also gzip), Excel, Parquet, BDF, or a cycler's export or own file.

    columns : quantity (time_s, current_a, voltage_v, temperature_degc) -> name of the file's column, for columns that
        are named neither so nor as in BDF or a known cycler's export. The temperature is optional: None leaves it out,
        and a number sets it in every row, in degC or in the unit of `units`.
    sign : direction in which the file's current is positive; None takes that of the known export, else discharge.
        In BDF it is charge.
    max_rows : most rows; more are decimated (interval averages). None keeps all.
    units : quantity -> unit of the file's column, where it is not SI: {"current_a": "mA", "time_s": "h:m:s"}.
    state : name of the column with the direction of a current that has no sign.  state_words : word there -> charge,
        discharge or rest, for words that are not known.
    cycle, step : keep the rows with this number (or "from:to").  start_s, stop_s : keep rows between these times, s.
    duplicates : which of several rows with the same time to keep; None refuses them, but keeps the first in known
        exports.

    Returns a Measurement with discharge-positive current; its `notes` list all that was mapped, converted, dropped
    or averaged. Raises DataError, one sentence with file, column and first row, where the content cannot be used;
    InputError where `path` is no file, or max_rows no whole number.
    """
    if not isinstance(path, str | PathLike):
        raise InputError(
            f"an object of type {type(path).__name__} is no file; what is in memory already is a record as "
            "aesi.Measurement(time_s, current_a, voltage_v)."
        )
    given = by_quantity("columns", columns) | ({} if state is None else {"state": state})
    reading = Reading(
        {quantity: column_name(name) for quantity, name in given.items()},
        by_quantity("units", units),
        sign,
        by_quantity("state_words", state_words, "words"),
        cycle=None if cycle is None else str(cycle),
        step=None if step is None else str(step),
        start_s=start_s,
        stop_s=stop_s,
        duplicates=duplicates,
    )
    found = read(path, reading, max_rows, name)
    return replace(found, notes=tuple(map(with_arguments, found.notes)))


def read(
    path: str | Path, reading: Reading, max_rows: int | None = MAX_ROWS, name: str | None = None
) -> Measurement:
    """`read_measurement` with all options in one object."""
    table = open_table(path, [given for given in reading.columns.values() if given])
    return measurement_in(table, reading, max_rows, name)


def measurement_in(
    table: TableFile, reading: Reading, max_rows: int | None, name: str | None = None
) -> Measurement:
    """The measurement in a table that is open already.  max_rows, name : as for `read_measurement`."""
    data, context, mapped, notes = load_columns(table, reading, REQUIRED)
    data = _examine(data, context, notes, table.header, _sign_advice(mapped, reading))
    measurement = Measurement(
        time_s=data["time_s"],
        current_a=data["current_a"],
        voltage_v=data["voltage_v"],
        temperature_degc=data.get("temperature_degc"),
        name=name or record_name(table.path),
        source=str(table.path),
        notes=tuple(f"{context.file}: {note}" for note in notes),
    )
    few = measurement if max_rows is None else decimate(measurement, max_rows)
    return replace(few, examined_digest=few.digest)


def examined(record: Measurement) -> Measurement:
    """A record that was made in memory, after the checks of one that is read from a file.

    Raises DataError, one sentence, for what a file would be refused for.
    """
    data = {name: getattr(record, name) for name in QUANTITIES if getattr(record, name) is not None}
    context = Context(record.name, {name: name for name in data}, lambda row: f"row {row + 1}")
    notes: list[str] = []
    data = _examine(data, context, notes, (), "; turn it")
    told = tuple(
        f"{record.name}: {note}" for note in notes if not any(had.endswith(note) for had in record.notes)
    )
    whole = replace(
        record,
        time_s=data["time_s"],
        current_a=data["current_a"],
        voltage_v=data["voltage_v"],
        temperature_degc=data.get("temperature_degc"),
        notes=(*record.notes, *told),
    )
    return replace(whole, examined_digest=whole.digest)


def _examine(
    data: Columns, context: Context, notes: list[str], header: Sequence[str], sign_advice: str
) -> Columns:
    """The columns without a lone first or last row, after all checks; `notes` is given what was dropped or doubted."""
    check_finite(data, context)
    check_time(data["time_s"], context)
    check_ranges(data, context)
    data, context = without_gaps(data, context, notes)
    check_constant(data, context)
    notes.extend(time_doubts(data))
    notes.extend(ambiguous_charge_notes(data))
    notes.extend(temperature_doubts(data, context))
    found = glitches(data)
    notes.extend(glitch_doubts(found, data, context))
    course = data, context
    if found.leaps.size:
        course = keep_rows(data, context, np.delete(np.arange(len(data["time_s"])), found.leaps))
    in_step, of_it, lagging = aligned(*course)
    notes.extend(lagging)
    _examine_course(in_step, of_it, header, sign_advice)
    notes.extend(held_doubts(in_step))
    return data


def _examine_course(data: Columns, context: Context, header: Sequence[str], sign_advice: str) -> None:
    """Check current, voltage and time against each other."""
    check_stuck_current(data, context)
    check_scale(data, context)
    check_magnitudes(data, context, header)
    check_sign(data, context, sign_advice)
    check_stuck_voltage(data, context)


def _sign_advice(mapped: Mapped, reading: Reading) -> str:
    if mapped.bdf_current and reading.sign is None:
        return "; if this file breaks the sign of BDF, positive on charge: --sign discharge-positive"
    told = reading.sign or mapped.maker_sign or "discharge-positive"
    other = "charge-positive" if told == "discharge-positive" else "discharge-positive"
    who = (
        "was declared"
        if reading.sign
        else f"is what {mapped.maker} writes"
        if mapped.maker
        else "was assumed"
    )
    return f": {told} {who}; give --sign {other} if the file is meant so"
