"""MATLAB's `.mat` up to version 7, through scipy: a structure of equally long vectors, or such vectors alone.

Where a file holds several such structures, a column name with that of its structure selects one: 'meas.Time'.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aesi.data.readers.formats import recognise
from aesi.data.readers.frame import FrameTable, table_of_columns
from aesi.data.readers.table import names_listed
from aesi.errors import DataError, first_line

NO_STRUCTURE = ""
"""Name of the table of vectors that are in no structure."""


def open_mat(path: Path, wanted: Collection[str]) -> FrameTable:
    """The table of a `.mat` file.

    wanted : names of columns that the user gave.
    Raises DataError where the file is damaged or of version 7.3, where it holds no table, or several without a choice,
    and where the vectors are not equally long.
    """
    content = _load(path)
    tables = _tables(content)
    name = _chosen_table(path, content, tables, wanted)
    columns = tables[name]
    _check_lengths(path, name, columns)
    notes = [f"Read from the structure {name!r}."] if name else []
    left_out = sorted(({*_fields(content[name])} if name else {*content}) - {*columns})
    if left_out:
        notes.append(f"Not read, for they are no vectors: {names_listed(left_out)}.")
    shown = {
        f"{name}.{column}" if f"{name}.{column}" in wanted else column: one for column, one in columns.items()
    }
    table = table_of_columns(path, shown, tuple(notes))
    table.format = recognise(tuple(columns))
    return table


def _load(path: Path) -> dict[str, Any]:
    """The variables of the file."""
    from scipy.io import loadmat

    try:
        content = loadmat(str(path), appendmat=False)
    except NotImplementedError:
        raise DataError(
            f"{path.name} is a MATLAB file of version 7.3 (HDF5), which is not read; save it again in MATLAB by "
            "save(FILE, ..., '-v7'), or export time, current and voltage as CSV."
        ) from None
    except Exception as error:
        # It raises many kinds: of zlib, struct, numpy and its own.
        raise DataError(
            f"{path.name} is damaged or no MATLAB file: {first_line(error, 120)}; save it again, or export it as CSV."
        ) from None
    return {str(name): value for name, value in content.items() if not str(name).startswith("__")}


def _tables(content: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Name of a structure -> its columns; else the vectors outside structures; else the numbers, as columns of one
    row."""
    for least in (2, 1):
        inside = {name: _columns(_fields(value), least) for name, value in content.items()}
        tables = {name: columns for name, columns in inside.items() if columns}
        alone = {} if tables else _columns(content, least)
        if tables or alone:
            return tables or {NO_STRUCTURE: alone}
    return {}


def _fields(value: Any) -> dict[str, Any]:
    """The fields of a single structure; empty for anything else."""
    names = getattr(getattr(value, "dtype", None), "names", None)
    return {name: value.ravel()[0][name] for name in names} if names and value.size == 1 else {}


def _columns(values: Mapping[str, Any], least: int) -> dict[str, Any]:
    """The vectors of at least `least` rows, and cells of words of the same length; empty for fewer than two vectors."""
    numbers = {name: value.ravel() for name, value in values.items() if _is_vector(value, "iufb", least)}
    if len(numbers) < 2:
        return {}
    lengths = {len(column) for column in numbers.values()}
    cells = {
        name: value
        for name, value in values.items()
        if _is_vector(value, "O", least) and value.size in lengths
    }
    words = {name: _words(value) for name, value in cells.items()}
    columns = numbers | {name: column for name, column in words.items() if column is not None}
    return {name: columns[name] for name in values if name in columns}


def _is_vector(value: Any, kinds: str, least: int) -> bool:
    if not isinstance(value, np.ndarray) or value.dtype.kind not in kinds or not value.size:
        return False
    return value.size == max(value.shape) >= least


def _words(cells: Any) -> list[str] | None:
    """The cells as words; None where a cell holds more than one word."""
    if not all(isinstance(cell, np.ndarray) and cell.size <= 1 for cell in cells.flat):
        return None
    return [str(cell.item()) if cell.size else "" for cell in cells.flat]


def _chosen_table(
    path: Path, content: Mapping[str, Any], tables: Mapping[str, dict[str, Any]], wanted: Collection[str]
) -> str:
    """The name of the only table, or of the table that a wanted column names."""
    if not tables:
        raise DataError(
            f"{path.name} holds no table: no structure whose fields are vectors, and no vectors by themselves (it has "
            f"{names_listed(content) or 'no variable'}); save time, current and voltage as vectors of one structure. "
            "In MATLAB, S = table2struct(T, 'ToScalar', true) makes it of a table."
        )
    named = {name for name in tables if any(each.startswith(f"{name}.") for each in wanted)}
    if len(tables) > 1 and len(named) != 1:
        raise DataError(
            f"{path.name} holds {len(tables)} tables, the structures {names_listed(tables)}; choose one by naming a "
            f'column with its structure: --column time_s="{next(iter(tables))}.NAME".'
        )
    return next(iter(named or tables))


def _check_lengths(path: Path, name: str, columns: Mapping[str, Any]) -> None:
    first, *others = columns
    rows = len(columns[first])
    other = next((one for one in others if len(columns[one]) != rows), None)
    if other is not None:
        raise DataError(
            f"{path.name}: the vectors{f' of {name!r}' * bool(name)} are not equally long ({first!r} has {rows:,} "
            f"rows, {other!r} {len(columns[other]):,}); save those of one test, and no other, in a structure."
        )
