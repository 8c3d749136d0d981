"""Text tables: cells separated by comma, semicolon, tab or bar, plain or gzip, in any encoding that loggers write.

The header is the first line that names known columns, or else the first of names with numbers below, or else the first
that is neither blank nor a comment (#).
Numbers are converted by pyarrow as a stream, so that ten million rows cost the memory of their numbers; only when that
fails does a slow pass in Python look for the first invalid cell.
"""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
import zlib
from collections.abc import Collection, Generator
from contextlib import closing
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from aesi.data.readers.heading import NUMBER
from aesi.data.readers.layout import Layout, decimal_in, decoded, layout_of, with_decimal
from aesi.errors import DataError, first_line
from aesi.numerics.typing import Array

HEAD_BYTES = 1 << 18
"""Bytes searched for the header: more than any maker's preamble."""
BLOCK_BYTES = 1 << 22
"""Bytes of a file that are converted at a time, which bounds the memory beyond the numbers."""
MISSING = ("", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None", "-nan", "-NaN")
MINUS = "\N{MINUS SIGN}"
DAMAGED = (EOFError, zlib.error, gzip.BadGzipFile)


class TextTable:
    """A delimited text file; see `aesi.data.readers.table.TableFile`."""

    def __init__(self, path: Path, compressed: bool = False, wanted: Collection[str] = ()) -> None:
        self.path = path
        self._compressed = compressed
        self._layout = self._detect_layout(wanted)
        if not self._layout.decimal:
            self._layout = with_decimal(self._layout, self._first_decimal())
        self.header = self._layout.header
        self.notes = self._layout.notes
        self.format = self._layout.format
        self.units = self._layout.units

    def read(self, positions: tuple[int, ...]) -> list[Array]:
        """The columns at the given positions; an empty cell is NaN."""
        import pyarrow as pa

        try:
            return self._convert(positions)
        except DAMAGED as error:
            raise self._damaged(error) from None
        except (pa.ArrowException, OSError, ValueError) as error:
            if not self._raise_first_fault(positions):
                return [np.empty(0) for _ in positions]
            raise DataError(f"{self.path.name} cannot be read as a table: {first_line(error)}") from None

    def read_text(self, positions: tuple[int, ...]) -> list[list[str]]:
        """The columns at the given positions as they are written; '' where a row is too short."""
        columns: list[list[str]] = [[] for _ in positions]
        try:
            with closing(self._rows()) as rows:
                for _, cells in rows:
                    for column, position in zip(columns, positions, strict=True):
                        column.append(cells[position].strip() if position < len(cells) else "")
        except DAMAGED as error:
            raise self._damaged(error) from None
        except (csv.Error, UnicodeError, OSError) as error:
            raise DataError(f"{self.path.name} is damaged: {error}.") from None
        return columns

    def where(self, row: int) -> str:
        """The row and its line, blank lines and preamble counted."""
        try:
            with closing(self._rows()) as rows:
                for number, (line, _) in enumerate(rows):
                    if number == row:
                        return f"row {row + 1} (line {line})"
        except (*DAMAGED, OSError, UnicodeError, csv.Error):
            pass
        return f"row {row + 1}"

    def _first_decimal(self) -> str:
        """The decimal sign of the first row that has one, for a table that begins with whole numbers, as at rest."""
        try:
            with closing(self._rows()) as rows:
                found = (decimal_in([cells], self._layout.separator) for _, cells in rows)
                return next((sign for sign in found if sign), ".")
        except (*DAMAGED, csv.Error, UnicodeError, OSError):
            return "."  # the error is raised when the table is read

    def _convert(self, positions: tuple[int, ...]) -> list[Array]:
        import pyarrow as pa
        import pyarrow.csv as pacsv

        layout = self._layout
        names = [str(position) for position in range(len(layout.header))]
        wanted = [names[position] for position in positions]
        parse = pacsv.ParseOptions(delimiter=layout.separator)
        convert = pacsv.ConvertOptions(
            column_types=dict.fromkeys(wanted, pa.float64()),
            include_columns=wanted,
            null_values=list(MISSING),
            decimal_point=layout.decimal,
        )
        pieces: list[list[Array]] = [[] for _ in wanted]
        with closing(self._blocks()) as blocks:
            for number, block in enumerate(blocks):
                above = 0 if number else layout.lines_before_data
                read = pacsv.ReadOptions(
                    use_threads=False, block_size=len(block) + 1, column_names=names, skip_rows=above
                )
                table = pacsv.read_csv(pa.BufferReader(block), read, parse, convert)
                for column, piece in zip(table.columns, pieces, strict=True):
                    piece.append(column.to_numpy().astype(float, copy=False))
        return [np.concatenate(piece) if piece else np.empty(0) for piece in pieces]

    def _blocks(self) -> Generator[bytes, None, None]:
        """The file in blocks of whole lines; no block has only blank lines.

        The file is divided here, not by pyarrow, which reads a Python file ahead in a thread. A bad cell left that
        thread behind, and about one process in twenty aborted at its end.
        """
        rest = b""
        with self._utf8() as stream:
            while read := stream.read(BLOCK_BYTES):
                end = max(read.rfind(b"\n"), read.rfind(b"\r")) + 1
                block, rest = (rest + read[:end], read[end:]) if end else (b"", rest + read)
                if block.strip():
                    yield block
        if rest.strip():
            yield rest

    def _bytes(self) -> BinaryIO:
        if self._compressed:
            return cast(BinaryIO, gzip.open(self.path, "rb"))
        return self.path.open("rb")

    def _utf8(self) -> BinaryIO:
        """The file as UTF-8 bytes; without a copy where it already is UTF-8, as nearly all loggers' files."""
        if self._layout.layer:
            return self._own_layer()
        if self._layout.encoding in ("utf-8", "utf-8-sig"):
            return self._bytes()
        return cast(BinaryIO, codecs.EncodedFile(self._bytes(), "utf-8", self._layout.encoding))

    def _own_layer(self) -> BinaryIO:
        """The lines above the table and the rows of its own layer, without the tabs that pad their cells."""
        layout = self._layout
        start = layout.separator * layout.layer
        with self._text() as text:
            kept = [
                line.replace("\t", "") if layout.separator != "\t" else line
                for number, line in enumerate(text)
                if number < layout.lines_before_data or line.startswith(start)
            ]
        return io.BytesIO("".join(kept).encode())

    def _text(self) -> io.TextIOWrapper:
        return io.TextIOWrapper(self._bytes(), encoding=self._layout.encoding, errors="replace")

    def _rows(self) -> Generator[tuple[int, list[str]], None, None]:
        """(line number, cells) of each row below the header, without blank lines.

        The caller has to close it: otherwise an error's traceback would keep the file open.
        """
        with self._text() as text:
            for _ in range(self._layout.lines_before_data):
                text.readline()
            reader = csv.reader(text, delimiter=self._layout.separator)
            for cells in reader:
                if cells and not any(cells[: self._layout.layer]):
                    yield self._layout.lines_before_data + reader.line_num, cells

    def _raise_first_fault(self, positions: tuple[int, ...]) -> int:
        """The slow pass: raise DataError for the first row of the wrong length or cell that is not a number.

        Returns the number of rows where there is none.
        """
        row = -1
        try:
            with closing(self._rows()) as rows:
                for row, (line, cells) in enumerate(rows):
                    begins = line - sum(cell.rstrip("\n").count("\n") for cell in cells)
                    self._check(f"{self.path.name}, row {row + 1} (line {begins})", cells, positions)
        except DAMAGED as error:
            raise self._damaged(error) from None
        except (csv.Error, UnicodeError, OSError) as error:
            raise DataError(f"{self.path.name} is damaged: {error}.") from None
        return row + 1

    def _check(self, place: str, cells: list[str], positions: tuple[int, ...]) -> None:
        width = len(self.header)
        if len(cells) != width:
            if any("\n" in cell for cell in cells):  # which a cell of words may have
                raise DataError(
                    f"{place}: a quotation mark is opened there and not closed in its line; remove it, or close it."
                )
            cause = (
                "the row is cut short or damaged: correct or remove it"
                if len(cells) < width
                else "a column has no name, or a separator stands within a cell, as a decimal comma between commas "
                "does: name the column, or separate the cells by semicolons"
            )
            raise DataError(
                f"{place}: {len(cells)} cell{'s' * (len(cells) != 1)} where the header has {width}; {cause}."
            )
        for position in positions:
            cell = cells[position].strip()
            if cell not in MISSING and not _is_number(cell, self._layout.decimal):
                raise DataError(
                    f"{place}: column {self.header[position]!r} holds {cell[:40]!r}, which is not a "
                    f"number{_advice(cell, self.header[position], self._layout)}."
                )

    def _damaged(self, error: Exception) -> DataError:
        return DataError(
            f"{self.path.name} is a damaged or truncated gzip file ({error}); copy or export it again."
        )

    def _detect_layout(self, wanted: Collection[str]) -> Layout:
        try:
            with self._bytes() as stream:
                head = stream.read(HEAD_BYTES)
        except DAMAGED as error:
            raise self._damaged(error) from None
        except OSError as error:
            raise DataError(f"{self.path} cannot be opened: {error}.") from None
        encoding, text = decoded(head, self.path.name)
        return layout_of(text, encoding, whole=len(head) < HEAD_BYTES, name=self.path.name, wanted=wanted)


def _is_number(cell: str, decimal: str) -> bool:
    """True where a cell is a number with that decimal sign; with a decimal comma, a point is not allowed."""
    return bool(NUMBER.fullmatch(cell.replace(decimal, "."))) and (decimal == "." or "." not in cell)


def _advice(cell: str, name: str, layout: Layout) -> str:
    """End of a message, from ': ' or ', ' on: advice for a cell that is not a number, in the column of that name."""
    if cell == name:
        return ": a second table begins there, below the names of its columns; split the file there"
    if _is_number(cell.replace(MINUS, "-"), layout.decimal):
        return f": its minus is the sign of a typesetter (U+{ord(MINUS):04X}); write a hyphen in all rows"
    if re.match(r"\d{1,4}[-/.:]\d{1,2}[-/.:]\d", cell):
        date = "%d.%m.%Y" if re.match(r"\d+\.", cell) else "%m/%d/%Y"
        fraction = ".%f" if re.search(r":\d+\.\d", cell) else ""
        return (
            ": declare what it is: --unit time_s=h:m:s, --unit time_s=date (2024-05-31 12:00:00), or a pattern such as "
            f"--unit 'time_s={date} %H:%M:%S{fraction}'"
        )
    if re.match(r"[+-]?[\d.,]+\s*(?!e[+-]?\d)[^\W\d_]", cell, re.IGNORECASE):
        return ": write numbers alone, and the unit in the name of the column"
    if layout.separator != "," and ("," in cell or (layout.decimal == "," and "." in cell)):
        sign = "comma" if layout.decimal == "," else "point"
        return f": other numbers have a decimal {sign}; write it in all of them, and nothing between the thousands"
    if "," in cell:
        return (
            ": write nothing between the thousands and a decimal point, or separate the cells by semicolons"
        )
    return ": correct it, or remove the row"
