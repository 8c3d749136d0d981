"""Columns of a table in SI, discharge positive, for the requested rows; their values are not checked here."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.data import units
from aesi.data.channels import headers
from aesi.data.channels.checks import Columns, Context, check_resolution
from aesi.data.channels.columns import QUANTITIES, Mapped, map_columns
from aesi.data.readers.table import TableFile
from aesi.data.reading import Duplicates, Reading, bounds
from aesi.data.state import directions, has_both_directions, with_directions
from aesi.errors import DataError
from aesi.numerics.typing import AnyArray, Array
from aesi.over_time import range_words

ZERO_SHARE = 0.01
"""Share of the largest current up to which a negative current is the offset of a cycler, not a direction."""


def load_columns(
    table: TableFile, reading: Reading, required: tuple[str, ...]
) -> tuple[Columns, Context, Mapped, list[str]]:
    """(columns, context for messages, mapping of the columns, notes on what was changed)."""
    mapped = map_columns(table, reading.columns, reading.units, required, reading.selectors)
    data = _numbers(table, mapped)
    if len(data["time_s"]) < 2:
        raise DataError(
            f"{table.path.name} has too few rows below its header ({len(data['time_s'])}); a measurement needs at "
            "least two."
        )
    context = Context(table.path.name, mapped.header, table.where, mapped.unit)
    notes = [*table.notes, *mapped.notes]
    _orient(table, data, mapped, reading, notes)
    for name in reading.selectors:
        data, context = _with_number(data, context, name, getattr(reading, name), notes)
    data = {quantity: column for quantity, column in data.items() if quantity in QUANTITIES}
    data, context = _window(data, context, reading, notes)
    duplicates: Duplicates = reading.duplicates or ("first" if mapped.maker else "refuse")
    if reading.duplicates is None:
        check_resolution(data, context)
    data, context = _without_duplicates(data, context, duplicates, notes)
    return data, context, mapped, notes


def _numbers(table: TableFile, mapped: Mapped) -> Columns:
    """All mapped columns except the state, in SI."""
    wanted = [name for name in mapped.position if name != "state"]
    as_text = [name for name in wanted if units.is_text(mapped.unit.get(name, ""))]
    plain = [name for name in wanted if name not in as_text]
    data = dict(zip(plain, table.read(tuple(mapped.position[name] for name in plain)), strict=True))
    for name in as_text:
        data[name] = _times(table, mapped, name)
    columns = {
        name: units.to_si(name, data[name], mapped.unit[name])
        if name in plain and name in mapped.unit
        else data[name]
        for name in wanted
    }
    if mapped.stated_degc is not None:
        columns["temperature_degc"] = np.full(len(columns["time_s"]), mapped.stated_degc)
    return columns


def _times(table: TableFile, mapped: Mapped, name: str) -> Array:
    unit = mapped.unit[name]
    (cells,) = table.read_text((mapped.position[name],))
    seconds = units.clock_to_s(cells) if unit == units.CLOCK else units.dates_to_s(cells, unit)
    wrong = np.flatnonzero(np.isnan(seconds) & np.array([bool(cell) for cell in cells], dtype=bool))
    if len(wrong):
        row = int(wrong[0])
        raise DataError(
            f"{table.path.name}, {table.where(row)}: column {mapped.header[name]!r} holds {cells[row][:40]!r}, which "
            f"is no time as {unit}; declare what it is: --unit {name}=s (or min, h, h:m:s, date, or a pattern such as "
            "'%d.%m.%Y %H:%M:%S')."
        )
    return seconds


def _orient(table: TableFile, data: Columns, mapped: Mapped, reading: Reading, notes: list[str]) -> None:
    """Make the current of `data` discharge-positive, in place, and note a change of sign."""
    if reading.state_words and "state" not in mapped.position:
        raise DataError(
            f"{table.path.name}: --state-word says what words of a column mean, and no column is known to say which "
            f'way the current flows; name it: --state "NAME". There are: {", ".join(map(repr, table.header))}.'
        )
    if _orient_by_words(table, data, mapped, reading, notes):
        return
    if reading.state_words:
        notes.append(
            "Words of a state were declared, and the sign of the current comes from itself; name their column: --state."
        )
    name = mapped.header["current_a"]
    if not (reading.sign or mapped.maker_sign) and headers.sign_in(name) == "charge-positive":
        raise DataError(
            f"{table.path.name}: column {name!r} is positive on charge by its name; declare it: --sign "
            "charge-positive, or --sign discharge-positive if its name is wrong."
        )
    _orient_by_declaration(data, mapped, reading, notes)


def _orient_by_words(
    table: TableFile, data: Columns, mapped: Mapped, reading: Reading, notes: list[str]
) -> bool:
    """Take the direction of the current from a column of words such as `charge`, where the user named one or the
    current has no sign. True where that was done."""
    current = data["current_a"]
    asked = "state" in reading.columns
    signed = np.nanmin(current, initial=0.0) < -ZERO_SHARE * np.nanmax(np.abs(current), initial=0.0)
    if "state" not in mapped.position:
        if not signed:
            _check_words(table, current, mapped, reading)
        return False
    if signed and not asked:
        return False
    (words,) = table.read_text((mapped.position["state"],))
    file, column = table.path.name, mapped.header["state"]
    way, note = directions(words, current, reading.state_words, file, column, table.where)
    if not asked and not np.any(way != 0):
        return False
    data["current_a"], changes = with_directions(current, way, data["time_s"], bool(signed))
    notes += [note, *changes]
    if reading.sign is not None:
        notes.append(
            f"The current was declared {reading.sign}, and column {column!r} says which way it flows: the column was "
            "followed."
        )
    return True


def _orient_by_declaration(data: Columns, mapped: Mapped, reading: Reading, notes: list[str]) -> None:
    """Make the current discharge-positive by the sign that the user declares, else by that of the format or maker."""
    if mapped.bdf_current and reading.sign == "discharge-positive":
        notes.append("The current was declared positive on discharge, which BDF's is not; its sign was left.")
        return
    if mapped.bdf_current:
        notes.append("BDF current is positive on charge; its sign was turned.")
    elif (reading.sign or mapped.maker_sign) != "charge-positive":
        return
    elif reading.sign:
        notes.append("The current was declared positive on charge; its sign was turned.")
    else:
        notes.append(f"{mapped.maker} writes the current positive on charge; its sign was turned.")
    data["current_a"] = 0.0 - data["current_a"]  # no negative zeros


def _check_words(table: TableFile, current: Array, mapped: Mapped, reading: Reading) -> None:
    """Refuse magnitudes where a column of words states both directions and the user neither named nor left it out."""
    name = None if "state" in reading.columns else headers.nearest("state", table.header)
    if name is None or not has_both_directions(table.read_text((table.header.index(name),))[0], current):
        return
    raise DataError(
        f"{table.path.name}: the current ({mapped.header['current_a']!r}) never changes its sign, and yet column "
        f"{name!r} has the cell charged and discharged: the file holds magnitudes. Take the direction from there: "
        f'--state "{name}"; if it means something else, leave it out: --column state=.'
    )


def keep_rows(columns: Columns, context: Context, keep: AnyArray) -> tuple[Columns, Context]:
    """The rows of an index array; messages keep the row numbers of the file."""
    where = partial(_where_kept, context, keep)
    return {q: v[keep] for q, v in columns.items()}, replace(context, where=where)


def _where_kept(context: Context, kept: AnyArray, row: int) -> str:
    return context.where(int(kept[row]))


def _with_number(
    data: Columns, context: Context, name: str, text: str, notes: list[str]
) -> tuple[Columns, Context]:
    """The rows of a cycle or a step."""
    low, high = bounds(name, text) or (-np.inf, np.inf)
    numbers = data[name]
    keep = np.flatnonzero((numbers >= low) & (numbers <= high))
    if len(keep) < 2:
        there = numbers[~np.isnan(numbers)]
        held = (
            f"holds {range_words(f'{there.min():g}', f'{there.max():g}')}"
            if len(there)
            else "is empty in every row"
        )
        raise DataError(
            f"{context.file}: {len(keep)} rows are of {name} {text}; column {context.header[name]!r} {held}."
        )
    notes.append(f"{name} {text}: {len(keep):,} of {len(numbers):,} rows were taken as asked.")
    holes = np.flatnonzero(np.diff(keep) > 1)
    if len(holes):
        missing_ah = _between_ah(data, keep)
        notes.append(
            f"These rows are {len(holes) + 1:,} stretches, the first up to {context.where(int(keep[holes[0]]))}: "
            f"{missing_ah:.4g} Ah that the rows between them carried are not in the record. Where it has to go on as "
            f"the test did, take rows that follow one another: several {name}s (FIRST:LAST), --from-s and --to-s."
        )
    return keep_rows(data, context, keep)


def _between_ah(data: Columns, keep: AnyArray) -> float:
    """Charge, Ah, in both directions, of rows that are left out between the first and the last row kept."""
    hours = np.diff(data["time_s"], prepend=np.nan) / SECONDS_PER_HOUR
    left_out = np.ones(len(hours), dtype=bool)
    left_out[keep] = False
    left_out[: keep[0]] = left_out[keep[-1] :] = False
    return float(np.nansum(np.abs(data["current_a"] * hours)[left_out]))


def _window(data: Columns, context: Context, reading: Reading, notes: list[str]) -> tuple[Columns, Context]:
    if (reading.start_s is None and reading.stop_s is None) or np.isnan(data["time_s"]).all():
        return data, context  # a row without a time is refused later, with its number
    low = -np.inf if reading.start_s is None else reading.start_s
    high = np.inf if reading.stop_s is None else reading.stop_s
    time = data["time_s"]
    keep = np.flatnonzero(~((time < low) | (time > high)))  # keeps rows without a time
    # The note names times, not options: they differ between commands, experiment files and Python.
    asked = " ".join(
        [f"from {low:.10g} s on"] * (reading.start_s is not None)
        + [f"up to {high:.10g} s"] * (reading.stop_s is not None)
    )
    there = f"its times run from {np.nanmin(time):.10g} s to {np.nanmax(time):.10g} s."
    if len(keep) < 2:
        had = "1 row" if len(keep) == 1 else "no row"
        raise DataError(
            f"{context.file}: read {asked} as asked, it has {had}, and a record needs two; {there}"
        )
    if len(keep) == len(time):
        notes.append(f"Read {asked} as asked, which leaves out nothing: {there}")
    else:
        notes.append(f"{_rows(len(time) - len(keep))} left out: read {asked} as asked.")
    return keep_rows(data, context, keep)


def _without_duplicates(
    data: Columns, context: Context, duplicates: Duplicates, notes: list[str]
) -> tuple[Columns, Context]:
    same = np.diff(data["time_s"]) == 0
    if duplicates == "refuse" or not np.any(same):
        return data, context
    if np.all(same):
        raise DataError(
            f"{context.file}: all {len(data['time_s']):,} rows have the stamp {data['time_s'][0]:.10g} s, and a record "
            "needs two; check the column of the time."
        )
    dropped = np.append(same, False) if duplicates == "last" else np.insert(same, 0, False)
    notes.append(f"{_rows(int(np.sum(same)))} dropped whose stamp is there twice, the {duplicates} kept.")
    return keep_rows(data, context, np.flatnonzero(~dropped))


def _rows(count: int) -> str:
    """'1 row was', '1,200 rows were'."""
    return "1 row was" if count == 1 else f"{count:,} rows were"
