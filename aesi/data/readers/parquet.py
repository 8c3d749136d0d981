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

        names = [self.header[position] for position in positions]
        for name in names:
            kind = self._file.schema_arrow.field(name).type
            if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
                raise DataError(
                    f"{self.path.name}: column {name!r} holds {kind}, not numbers, from row 1 on; "
                    "store it as float64."
                )
        table = self._columns(names)
        try:
            return [_floats(table.column(name)) for name in names]
        except pa.ArrowException as error:
            raise DataError(
                f"{self.path.name} holds numbers that are no float64: {first_line(error)}"
            ) from None

    def read_text(self, positions: tuple[int, ...]) -> list[list[str]]:
        """The columns at the given positions as words; null becomes ''."""
        names = [self.header[position] for position in positions]
        table = self._columns(names)
        return [["" if v is None else str(v) for v in table.column(name).to_pylist()] for name in names]

    def _columns(self, names: list[str]) -> Any:
        import pyarrow as pa

        try:
            return self._file.read(columns=names)
        except (pa.ArrowException, OSError, ValueError) as error:
            raise DataError(f"{self.path.name} is damaged: {first_line(error)}") from None

    def where(self, row: int) -> str:
        """Parquet has rows, no lines."""
        return f"row {row + 1}"


def _floats(column: Any) -> Array:
    import pyarrow as pa

    values: Array = column.cast(pa.float64()).to_numpy().astype(np.float64)
    return values
