"""Text tables: comma, semicolon, tab or bar between the cells, plain or gzip, in any encoding loggers write.

The header is the first line that names known columns, or else the first that is neither blank nor a comment (#).
Numbers are converted by pyarrow as a stream, so that ten million rows cost the memory of their numbers; only when that
fails does a slow pass in Python look for the first cell at fault.
"""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
import zlib
from collections.abc import Collection, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from aesi.data.readers.formats.format import Format
from aesi.data.readers.heading import LINES_LOOKED_AT, SEPARATORS, find_heading, split
from aesi.errors import DataError
from aesi.numerics.typing import Array

HEAD_BYTES = 1 << 18
"""Read to find the header in: more than any maker's preamble."""
BLOCK_BYTES = 1 << 22
"""Of a file that is converted at a time; it bounds the memory beyond the numbers."""
COMMENT = "#"
MISSING = ("", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None", "-nan", "-NaN")
BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?inf(inity)?", re.ASCII | re.IGNORECASE)
WITH_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?", re.ASCII)
DAMAGED = (EOFError, zlib.error, gzip.BadGzipFile)


@dataclass(frozen=True)
class Layout:
    """How a text table is written: what a look at its head tells."""

    encoding: str
    separator: str
    decimal: str
    header: tuple[str, ...]
    lines_before_data: int
    notes: tuple[str, ...]
    format: Format | None = None
    units: tuple[str, ...] = field(default=())


class TextTable:
    """A delimited text file; see `aesi.data.readers.table.TableFile`."""

    def __init__(self, path: Path, compressed: bool = False, wanted: Collection[str] = ()) -> None:
        self.path = path
        self._compressed = compressed
        self._layout = self._look(wanted)
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
            text = (str(error).splitlines() or [type(error).__name__])[0]
            raise DataError(f"{self.path.name} cannot be read as a table: {text[:200]}") from None

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

    def _convert(self, positions: tuple[int, ...]) -> list[Array]:
        import pyarrow as pa
        import pyarrow.csv as pacsv

        layout = self._layout
        names = [str(position) for position in range(len(layout.header))]
        wanted = [names[position] for position in positions]
        with self._utf8() as stream:
            reader = pacsv.open_csv(
                pa.PythonFile(stream, mode="r"),
                pacsv.ReadOptions(
                    use_threads=False,
                    block_size=BLOCK_BYTES,
                    column_names=names,
                    skip_rows=layout.lines_before_data,
                ),
                pacsv.ParseOptions(delimiter=layout.separator),
                pacsv.ConvertOptions(
                    column_types=dict.fromkeys(wanted, pa.float64()),
                    include_columns=wanted,
                    null_values=list(MISSING),
                    decimal_point=layout.decimal,
                ),
            )
            pieces: list[list[Array]] = [[] for _ in wanted]
            for batch in reader:
                for column, piece in zip(batch.columns, pieces, strict=True):
                    piece.append(column.to_numpy(zero_copy_only=False).astype(float, copy=False))
        return [np.concatenate(piece) if piece else np.empty(0) for piece in pieces]

    def _bytes(self) -> BinaryIO:
        if self._compressed:
            return cast(BinaryIO, gzip.open(self.path, "rb"))
        return self.path.open("rb")

    def _utf8(self) -> BinaryIO:
        """The file as UTF-8 bytes; loggers' files nearly always are, and then nothing is copied."""
        if self._layout.encoding in ("utf-8", "utf-8-sig"):
            return self._bytes()
        return cast(BinaryIO, codecs.EncodedFile(self._bytes(), "utf-8", self._layout.encoding))

    def _text(self) -> io.TextIOWrapper:
        return io.TextIOWrapper(self._bytes(), encoding=self._layout.encoding, errors="replace")

    def _rows(self) -> Generator[tuple[int, list[str]], None, None]:
        """Line number and cells of each row below the header; blank lines are passed over.

        To be closed: left half way, it would hold the file open for as long as an error's traceback lives.
        """
        with self._text() as text:
            for _ in range(self._layout.lines_before_data):
                text.readline()
            reader = csv.reader(text, delimiter=self._layout.separator)
            for cells in reader:
                if cells:
                    yield self._layout.lines_before_data + reader.line_num, cells

    def _raise_first_fault(self, positions: tuple[int, ...]) -> int:
        """The slow pass: name the first row of the wrong length or cell that is no number.

        Returns the number of rows where it finds no fault.
        """
        row = -1
        try:
            with closing(self._rows()) as rows:
                for row, (line, cells) in enumerate(rows):
                    self._check(f"{self.path.name}, row {row + 1} (line {line})", cells, positions)
        except DAMAGED as error:
            raise self._damaged(error) from None
        except (csv.Error, UnicodeError, OSError) as error:
            raise DataError(f"{self.path.name} is damaged: {error}.") from None
        return row + 1

    def _check(self, place: str, cells: list[str], positions: tuple[int, ...]) -> None:
        width = len(self.header)
        if len(cells) != width:
            raise DataError(
                f"{place}: {len(cells)} cells where the header has {width}; the row is cut short or damaged: "
                "correct or remove it."
            )
        for position in positions:
            cell = cells[position].strip()
            if cell not in MISSING and not NUMBER.fullmatch(cell.replace(self._layout.decimal, ".")):
                raise DataError(
                    f"{place}: column {self.header[position]!r} holds {cell[:40]!r}, which is not a "
                    f"number{_advice(cell)}."
                )

    def _damaged(self, error: Exception) -> DataError:
        return DataError(
            f"{self.path.name} is a damaged or truncated gzip file ({error}); copy or export it again."
        )

    def _look(self, wanted: Collection[str]) -> Layout:
        try:
            with self._bytes() as stream:
                head = stream.read(HEAD_BYTES)
        except DAMAGED as error:
            raise self._damaged(error) from None
        except OSError as error:
            raise DataError(f"{self.path} cannot be opened: {error}.") from None
        encoding, text = _decode(head, self.path.name)
        return _layout(text, encoding, whole=len(head) < HEAD_BYTES, name=self.path.name, wanted=wanted)


def _decode(head: bytes, name: str) -> tuple[str, str]:
    """Encoding and text of the head: by its mark, else UTF-8, else Latin-1, which takes any byte."""
    for mark, encoding in BYTE_ORDER_MARKS:
        if head.startswith(mark):
            try:
                return encoding, codecs.getincrementaldecoder(encoding)().decode(head)
            except UnicodeDecodeError:
                raise DataError(f"{name} starts with a {encoding} mark but is not {encoding}.") from None
    if b"\x00" in head:
        raise DataError(f"{name} holds binary data; give a text table (CSV) or a Parquet file.")
    try:
        return "utf-8", codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "latin-1", head.decode("latin-1")


def _layout(text: str, encoding: str, *, whole: bool, name: str, wanted: Collection[str]) -> Layout:
    lines = text.splitlines()
    if not whole:
        lines = lines[:-1]  # the last one may be cut by the size of the look
    notes: list[str] = []
    rows = [_cells(line) for line in lines[:LINES_LOOKED_AT]]
    heading = find_heading(rows, wanted)
    if heading is None:
        start, header, last = *_first_line(lines, name), 0
    else:
        start, header, last = heading.line, heading.header, int(heading.has_units)
    separator = max(SEPARATORS, key=lines[start].count)
    if start:
        notes.append(f"{start} lines before the header were passed over.")
    if last:
        notes.append("The line of units below the header was read as such.")
    if encoding == "latin-1":
        notes.append("The file is not UTF-8; it was read as Latin-1.")
    if whole and text and not text.endswith(("\n", "\r")):
        notes.append("The last line does not end: if the file was cut there, its last number is too short.")
    below = lines[start + 1 + last : start + 50 + last]
    decimal = _decimal(below, separator)
    if decimal == ",":
        notes.append("Numbers were read with a decimal comma.")
    header = _as_wide_as_the_rows(header, below, separator)
    form, units = (heading.format, heading.units) if heading else (None, ())
    return Layout(encoding, separator, decimal, header, start + 1 + last, tuple(notes), form, units)


def _cells(line: str) -> list[str]:
    return [] if line.startswith(COMMENT) else split(line, max(SEPARATORS, key=line.count))


def _first_line(lines: Sequence[str], name: str) -> tuple[int, tuple[str, ...]]:
    """Where no line names known columns: the first that is neither blank nor a comment."""
    start = next((i for i, line in enumerate(lines) if line.strip() and not line.startswith(COMMENT)), None)
    if start is None:
        raise DataError(f"{name} has no header line; the first line should name the columns.")
    separator = max(SEPARATORS, key=lines[start].count)
    try:
        header = tuple(cell.strip() for cell in next(csv.reader([lines[start]], delimiter=separator)))
    except (csv.Error, StopIteration) as error:
        raise DataError(f"{name}, line {start + 1}: the header cannot be read: {error}.") from None
    if len(header) == 1 and len(header[0].split()) > 2:
        raise DataError(
            f"{name}, line {start + 1}: no comma, semicolon, tab or bar between the names of the columns; "
            "separate the cells by one of these, or, where this is a block above the table, name its columns "
            "(--column time_s=NAME --column current_a=NAME --column voltage_v=NAME)."
        )
    if len(header) > 1 and all(NUMBER.fullmatch(cell) for cell in header):
        raise DataError(
            f"{name}, line {start + 1}: numbers where the header should be; put a line with the names of the "
            "columns first: time_s,current_a,voltage_v."
        )
    return start, header


def _as_wide_as_the_rows(header: tuple[str, ...], below: Sequence[str], separator: str) -> tuple[str, ...]:
    """Loggers end their names or their rows with a separator, not always both."""
    first = next((line for line in below if line.strip()), None)
    if first is None:
        return header
    cells = split(first, separator)
    if len(cells) == len(header) - 1 and header[-1] == "":
        return header[:-1]
    if len(cells) == len(header) + 1 and not cells[-1].strip():
        return (*header, "")
    return header


def _decimal(lines: list[str], separator: str) -> str:
    """A comma, where cells are separated otherwise and more of the first ones have a comma than a point."""
    if separator == ",":
        return "."
    cells = [cell.strip() for line in lines for cell in line.split(separator)]
    commas = sum(bool(WITH_COMMA.fullmatch(cell)) for cell in cells)
    points = sum("." in cell and bool(NUMBER.fullmatch(cell)) for cell in cells)
    return "," if commas > points else "."


def _advice(cell: str) -> str:
    if re.match(r"\d{1,4}[-/.:]\d{1,2}[-/.:]\d", cell):
        return (
            ": declare what it is: --unit time_s=h:m:s, --unit time_s=date (2024-05-31 12:00:00), or a pattern such as "
            "--unit 'time_s=%m/%d/%Y %H:%M:%S.%f'"
        )
    if "," in cell:
        return ": write a decimal point, or separate the cells by semicolons"
    return ""
