"""A table that another reader returns in memory: `.mpr` (galvani), `.nda` and `.ndax` (batterydf), `.xlsx`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from aesi.data.readers.formats import recognise
from aesi.data.readers.formats.format import Format
from aesi.errors import DataError
from aesi.numerics.typing import Array


class FrameTable:
    """Columns in memory; see `aesi.data.readers.table.TableFile`.

    columns : one sequence per column, in the order of `header`.  row_numbers : number of each row in the file, where
    rows have numbers there.
    """

    def __init__(
        self,
        path: Path,
        header: Sequence[str],
        columns: Sequence[Any],
        notes: tuple[str, ...] = (),
        units: tuple[str, ...] = (),
        row_numbers: Sequence[int] | None = None,
    ) -> None:
        self.path = path
        self.header = tuple(header)
        self.notes = notes
        self.format: Format | None = recognise(self.header)
        self.units = units
        self._columns = columns
        self._row_numbers = row_numbers

    def read(self, positions: tuple[int, ...]) -> list[Array]:
        """The columns at the given positions; an empty cell is NaN."""
        return [self._numbers(position) for position in positions]

    def read_text(self, positions: tuple[int, ...]) -> list[list[str]]:
        """The columns at the given positions as words; an empty cell is ''."""
        return [
            ["" if v is None else str(v).strip() for v in self._columns[position]] for position in positions
        ]

    def where(self, row: int) -> str:
        """The row, and its number in a sheet."""
        there = "" if self._row_numbers is None else f" (row {self._row_numbers[row]} of the sheet)"
        return f"row {row + 1}{there}"

    def _numbers(self, position: int) -> Array:
        column = self._columns[position]
        if isinstance(column, np.ndarray) and np.issubdtype(column.dtype, np.number):
            return column.astype(float)
        numbers = np.full(len(column), np.nan)
        for row, cell in enumerate(column):
            if cell is None or cell == "":
                continue
            try:
                numbers[row] = float(cell)
            except OverflowError:
                raise DataError(
                    f"{self.path.name}, {self.where(row)}: column {self.header[position]!r} holds a whole number of "
                    "more than 308 digits; remove or correct this row."
                ) from None
            except (TypeError, ValueError):
                raise DataError(
                    f"{self.path.name}, {self.where(row)}: column {self.header[position]!r} holds {str(cell)[:40]!r}, "
                    "which is not a number; times that are no numbers are declared: --unit time_s=h:m:s or =date."
                ) from None
        return numbers


def table_of_columns(path: Path, columns: Mapping[str, Any], notes: tuple[str, ...]) -> FrameTable:
    """A table of named columns."""
    return FrameTable(path, list(columns), list(columns.values()), notes)
