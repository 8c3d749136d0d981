"""A file on disk becomes a Measurement, or one sentence that says why not."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from aesi.data.checks import (
    Columns,
    Context,
    check_alive,
    check_finite,
    check_milliampere,
    check_ranges,
    check_sign,
    check_time,
    find_gaps,
    gap_error,
    is_rest,
)
from aesi.data.columns import Mapped, map_columns
from aesi.data.readers import open_table
from aesi.data.resample import decimate
from aesi.errors import DataError
from aesi.numerics.typing import AnyArray
from aesi.records import Measurement

Sign = Literal["discharge-positive", "charge-positive"]
Duplicates = Literal["refuse", "first", "last"]

MAX_ROWS = 2_000_000
"""A tenth of a second for two days; more rows are decimated, and a note says so."""
SUFFIXES = (".gz", ".csv", ".txt", ".tsv", ".bdf", ".parquet")


def read_measurement(
    path: str | Path,
    columns: Mapping[str, str | None] | None = None,
    sign: Sign = "discharge-positive",
    max_rows: int | None = MAX_ROWS,
    *,
    start_s: float | None = None,
    stop_s: float | None = None,
    duplicates: Duplicates = "refuse",
    name: str | None = None,
) -> Measurement:
    """Read one continuous test from CSV (also gzip), BDF or Parquet.

    columns : quantity -> the file's name for it, for those not named time_s, current_a, voltage_v,
        temperature_degc (optional) or as in BDF; None leaves the temperature out.
    sign : which direction of the file's current is positive; BDF columns have their own, charge positive.
    max_rows : more rows than this are decimated (interval averages); None keeps all.
    start_s, stop_s : keep rows with start_s <= time_s <= stop_s of the file.
    duplicates : which row of several with one stamp to keep; by default such a file is refused.

    Returns a Measurement with discharge-positive current; its `notes` say all that was mapped, dropped or
    averaged. Raises DataError, one sentence with file, column and first row, for anything else.
    """
    _check_choice("sign", sign, get_args(Sign))
    _check_choice("duplicates", duplicates, get_args(Duplicates))
    table = open_table(path)
    file = table.path.name
    mapped = map_columns(table.header, columns, file)
    quantities = tuple(mapped.position)
    arrays = table.read(tuple(mapped.position[q] for q in quantities))
    data: Columns = dict(zip(quantities, arrays, strict=True))
    if len(data["time_s"]) < 2:
        raise DataError(
            f"{file} has {len(data['time_s'])} rows below its header; a measurement needs at least two."
        )
    context = Context(file, mapped.header, table.where)
    notes = [*table.notes, *mapped.notes]
    orient(data, mapped, sign, notes)
    data, context = _window(data, context, start_s, stop_s, notes)
    check_finite(data, context)
    data, context = _without_duplicates(data, context, duplicates, notes)
    check_time(data["time_s"], context)
    check_ranges(data, context)
    data = _without_gaps(data, context, notes)
    check_alive(data, context)
    check_milliampere(data, context)
    check_sign(data, context, _sign_advice(mapped, sign))
    measurement = Measurement(
        time_s=data["time_s"],
        current_a=data["current_a"],
        voltage_v=data["voltage_v"],
        temperature_degc=data.get("temperature_degc"),
        name=name or _stem(table.path),
        source=str(path),
        notes=tuple(f"{file}: {note}" for note in notes),
    )
    return measurement if max_rows is None else decimate(measurement, max_rows)


def _check_choice(what: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise DataError(f"{what} = {value!r} is unknown; give {' or '.join(choices)}.")


def orient(data: Columns, mapped: Mapped, sign: Sign, notes: list[str]) -> None:
    """Turn the current of `data` discharge-positive, in place, and add a note where that took a turn."""
    if mapped.bdf_current:
        notes.append("BDF current is positive on charge; its sign was turned.")
    elif sign == "charge-positive":
        notes.append("The current was declared positive on charge; its sign was turned.")
    else:
        return
    data["current_a"] = -data["current_a"]


def _sign_advice(mapped: Mapped, sign: Sign) -> str:
    if mapped.bdf_current:
        name = mapped.header["current_a"]
        return f'; if this BDF file breaks the BDF sign, map its column: --column current_a="{name}"'
    other = "charge-positive" if sign == "discharge-positive" else "discharge-positive"
    return f": {sign} was declared; give --sign {other} if the file is meant so"


def _keep(data: Columns, context: Context, keep: AnyArray) -> tuple[Columns, Context]:
    """The rows of an index array, with the file's own row numbers kept for later sentences."""
    where = partial(_where_kept, context, keep)
    return {q: v[keep] for q, v in data.items()}, Context(context.file, context.header, where)


def _where_kept(context: Context, kept: AnyArray, row: int) -> str:
    return context.where(int(kept[row]))


def _window(
    data: Columns, context: Context, start_s: float | None, stop_s: float | None, notes: list[str]
) -> tuple[Columns, Context]:
    if start_s is None and stop_s is None:
        return data, context
    low = -np.inf if start_s is None else start_s
    high = np.inf if stop_s is None else stop_s
    time = data["time_s"]
    keep = np.flatnonzero((time >= low) & (time <= high))
    if len(keep) < 2:
        raise DataError(
            f"{context.file}: {len(keep)} rows lie between {low:g} s and {high:g} s; its times run from "
            f"{np.nanmin(time):g} s to {np.nanmax(time):g} s."
        )
    if len(keep) < len(time):
        ends = [f"before {low:g} s"] * (start_s is not None) + [f"after {high:g} s"] * (stop_s is not None)
        notes.append(f"{len(time) - len(keep)} rows {' and '.join(ends)} were left out as asked.")
    return _keep(data, context, keep)


def _without_duplicates(
    data: Columns, context: Context, duplicates: Duplicates, notes: list[str]
) -> tuple[Columns, Context]:
    same = np.diff(data["time_s"]) == 0
    if duplicates == "refuse" or not np.any(same):
        return data, context
    dropped = np.append(same, False) if duplicates == "last" else np.insert(same, 0, False)
    notes.append(
        f"{int(np.sum(same))} rows of a stamp that is there twice were dropped, the {duplicates} kept."
    )
    return _keep(data, context, np.flatnonzero(~dropped))


def _without_gaps(data: Columns, context: Context, notes: list[str]) -> Columns:
    """Refuse gaps; pass over a rest logged sparsely and a lone row long after the test, with a note."""
    n = len(data["time_s"])
    for k in find_gaps(data):
        seconds = float(data["time_s"][k + 1] - data["time_s"][k])
        if is_rest(data, k):
            notes.append(f"No rows for {seconds:.6g} s from {data['time_s'][k]:.10g} s on; the cell rested.")
        elif k == n - 2 and n > 2:
            notes.append(
                f"The last row, {seconds:.6g} s after the one before it, is not of this test and was dropped."
            )
            return {q: v[:-1] for q, v in data.items()}
        else:
            raise gap_error(data, k, context)
    return data


def _stem(path: Path) -> str:
    while path.suffix.lower() in SUFFIXES:
        path = path.with_suffix("")
    return path.name
