"""Parquet tables, through pyarrow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from aesi.data.readers.formats import recognise
from aesi.errors import DataError, first_line
from aesi.numerics.typing import Array


class ParquetTable:
    """A Parquet file; see `aesi.data.readers.table.TableFile`."""

    def __init__(self, path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.path = path
        self.notes: tuple[str, ...] = ()
        self.units: tuple[str, ...] = ()
        try:
            self._file = pq.ParquetFile(path)
            self.header = tuple(self._file.schema_arrow.names)
            self.format = recognise(self.header)
        except (pa.ArrowException, OSError, ValueError) as error:
            raise DataError(f"{path.name} is damaged or no Parquet file: {first_line(error)}") from None

    def read(self, positions: tuple[int, ...]) -> list[Array]:
        """The columns at the given positions; null becomes NaN."""
        import pyarrow as pa

        for position in positions:
            kind = self._file.schema_arrow.field(position).type
            if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
                raise DataError(
                    f"{self.path.name}: column {self.header[position]!r} holds {kind}, not numbers, from row 1 on; "
                    "store it as float64; times that are no numbers are declared: --unit time_s=h:m:s or =date."
                )
        try:
            return [_floats(column) for column in self._columns(positions)]
        except pa.ArrowException as error:
            raise DataError(
                f"{self.path.name} holds numbers that are no float64: {first_line(error)}"
            ) from None

    def read_text(self, positions: tuple[int, ...]) -> list[list[str]]:
        """The columns at the given positions as words; null becomes ''."""
        return [
            ["" if v is None else str(v).strip() for v in column.to_pylist()]
            for column in self._columns(positions)
        ]

    def _columns(self, positions: tuple[int, ...]) -> list[Any]:
        """The columns at the given positions, as pyarrow has them."""
        import pyarrow as pa

        try:
            table = self._file.read(columns=[self.header[position] for position in positions])
        except (pa.ArrowException, OSError, ValueError) as error:
            raise DataError(f"{self.path.name} is damaged: {first_line(error)}") from None
        return [table.column(self._place_in(table, position)) for position in positions]

    def _place_in(self, table: Any, position: int) -> int:
        """The place in a table that was read by names, which has all columns of one, of that at a position."""
        name = self.header[position]
        alike: list[int] = table.schema.get_all_field_indices(name)
        return alike[self.header[:position].count(name)]

    def where(self, row: int) -> str:
        """Parquet has rows, no lines."""
        return f"row {row + 1}"


def _floats(column: Any) -> Array:
    import pyarrow as pa

    values: Array = column.cast(pa.float64()).to_numpy().astype(np.float64)
    return values
