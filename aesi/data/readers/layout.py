"""Layout of a text table: its encoding, separator, decimal sign and header, determined from its first lines."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from aesi.data.readers.formats.format import Format
from aesi.data.readers.heading import (
    LINES_LOOKED_AT,
    NUMBER,
    WITH_COMMA,
    Heading,
    find_heading,
    first_of_numbers,
    likely_heading,
    separator_of,
    split,
)
from aesi.data.readers.table import SHOWN
from aesi.errors import DataError

COMMENT = "#"
COLUMN_NUMBER = "#"
"""Prefix of the number of a column in a table without names."""
LINES_BELOW = 49
"""Number of lines of the table from which its decimal sign and width are determined. A convention."""
CELL_OPEN = re.compile(r'(?:^|[,;\t|])\s*"[^"]*$')
"""End of a line within a quoted cell."""
LINES_OF_A_ROW = 99
"""Largest number of lines that the quoted cells of a row take; a mark that stays open opens no cell. A convention."""
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
LONE_NUL = re.compile(rb"^\x00(?=\r?$)", re.MULTILINE)
"""A line of a single NUL, as in Digatron's exports above the column names, counts as blank; other NULs mean binary."""


@dataclass(frozen=True)
class Layout:
    """Layout of a text table.

    decimal : decimal sign, '' where the first lines hold only whole numbers.
    layer : number of empty cells at the beginning of a row of this table, in a report with layers of cycles and steps.
    """

    encoding: str
    separator: str
    decimal: str
    header: tuple[str, ...]
    lines_before_data: int
    notes: tuple[str, ...]
    format: Format | None
    units: tuple[str, ...]
    layer: int


def decoded(head: bytes, name: str) -> tuple[str, str]:
    """(encoding, text) of the head: by its byte-order mark, else UTF-8, else Latin-1, which accepts any byte."""
    for mark, encoding in BYTE_ORDER_MARKS:
        if head.startswith(mark):
            try:
                return encoding, codecs.getincrementaldecoder(encoding)().decode(head)
            except UnicodeDecodeError:
                raise DataError(f"{name} starts with a {encoding} mark but is not {encoding}.") from None
    head = LONE_NUL.sub(b"", head)
    if b"\x00" in head:
        raise DataError(f"{name} holds binary data; give a text table (CSV) or a Parquet file.")
    try:
        return "utf-8", codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "latin-1", head.decode("latin-1")


def layout_of(text: str, encoding: str, *, whole: bool, name: str, wanted: Collection[str]) -> Layout:
    """The layout of a text as a table, with sentences on the assumptions made.

    text : all of a file (`whole`), or its beginning, whose last line may be cut off.  encoding : of the file.
    name : of the file.  wanted : names of columns that the user gave, which a header holds.
    """
    lines = io.StringIO(text, newline=None).read().split("\n")
    if lines[-1] == "":
        del lines[-1]  # the empty text after the last line end
    if not whole:
        lines = lines[:-1]  # the last one may be cut off
    lines, above = _rows_as_lines(lines)
    found = _find_header(lines, name, wanted)
    notes, start, first_row = found.notes, found.line, found.first_row
    separator = _separator_at(lines, start)
    if encoding == "latin-1":
        notes.append("The file is not UTF-8; it was read as Latin-1.")
    if whole and text and not text.endswith(("\n", "\r")):
        notes.append("The last line does not end: if the file was cut there, its last number is too short.")
    below = lines[first_row : first_row + LINES_BELOW]
    decimal = decimal_in((split(line, separator) for line in below), separator)
    header = _padded_header(found.names, below, separator)
    form, units = (found.heading.format, found.heading.units) if found.heading else (None, ())
    layer = _layer_depth(lines[:start], header, below, separator) if form else 0
    if layer:
        notes.append("The rows of cycles and steps between the records were passed over.")
    layout = Layout(encoding, separator, "", header, above[first_row], tuple(notes), form, units, layer)
    return layout if decimal is None else with_decimal(layout, decimal)


def _rows_as_lines(lines: Sequence[str]) -> tuple[list[str], list[int]]:
    """The lines with a blank for each line break within a quoted cell, as spreadsheets write them in names; and the
    number of lines of the file above each of them, and above their end."""
    rows: list[str] = []
    above = [0]
    while above[-1] < len(lines):
        start = above[-1]
        above.append(start + _lines_of_row(lines[start : start + LINES_OF_A_ROW]))
        rows.append(" ".join(lines[start : above[-1]]))
    return rows, above


def _lines_of_row(lines: Sequence[str]) -> int:
    """Number of lines that the row takes which begins in the first one."""
    marks = 0
    for number, line in enumerate(lines, start=1):
        marks += line.count('"')
        if marks % 2 == 0:
            return number
        if number == 1 and not CELL_OPEN.search(line):
            return 1
    return 1


@dataclass(frozen=True)
class _Header:
    """Where a table begins.

    line : that of its names, or its first one where none names its columns.  first_row : line of its first row.
    heading : what is known of the line of names; None where they are unknown.
    """

    line: int
    first_row: int
    names: tuple[str, ...]
    heading: Heading | None = None

    @property
    def notes(self) -> list[str]:
        """Sentences on what was assumed and passed over."""
        notes, nameless = [], self.first_row == self.line
        if nameless:
            notes.append("No line names the columns; they were numbered, #1 the first.")
        if self.line:
            above = "1 line" if self.line == 1 else f"{self.line} lines"
            of = "table" if nameless else "header"
            notes.append(f"{above} before the {of} {'was' if self.line == 1 else 'were'} passed over.")
        if self.heading is not None and self.heading.has_units:
            notes.append("The line of units below the header was read as such.")
        return notes


def _find_header(lines: Sequence[str], name: str, wanted: Collection[str]) -> _Header:
    """The header by names that are known, or by numbers below it; else a table without names, else the first line.

    Raises DataError where the columns have no names and the user gave no numbers, and where there is no header.
    """
    rows = [_cells(lines, at) for at in range(min(len(lines), LINES_LOOKED_AT))]
    heading = find_heading(rows, wanted) or likely_heading(_rows_from(lines))
    if heading is not None:
        first_row = heading.line + 1 + int(heading.has_units)
        return _Header(heading.line, first_row, heading.header, heading)
    nameless = first_of_numbers(_rows_from(lines))
    if nameless is not None:
        return _Header(nameless, nameless, _column_numbers(rows[nameless], name, nameless, wanted))
    start, names = _first_line(lines, name)
    return _Header(start, start + 1, names)


def with_decimal(layout: Layout, decimal: str) -> Layout:
    """The layout with this decimal sign, and a sentence where it is a comma."""
    notes = ("Numbers were read with a decimal comma.",) if decimal == "," else ()
    return replace(layout, decimal=decimal, notes=(*layout.notes, *notes))


def _rows_from(lines: Sequence[str]) -> Iterator[list[list[str]]]:
    """For each line, its cells and those of the two lines below, all split by the separator of the line itself: decimal
    commas may outnumber the separators below."""
    for start, line in enumerate(lines[:LINES_LOOKED_AT]):
        separator = _separator_at(lines, start)
        below = lines[start + 1 : start + 3]
        yield [
            [] if line.startswith(COMMENT) else split(line, separator),
            *(split(b, separator) for b in below),
        ]


def _layer_depth(above: Sequence[str], header: tuple[str, ...], below: Sequence[str], separator: str) -> int:
    """Number of empty cells at the beginning of a row of this table, below the names of other layers; 0 without layers.

    The names of layers are in the lines directly above, each indented by one cell more, and the rows of a layer have no
    more cells than its names, unlike a table with an unnamed first column of row numbers. Neware may write the first
    row of a step into the line of its cycle, so that cells of the layers between may follow.
    """
    layer = next((i for i, name in enumerate(header) if name), 0)
    names = [_extent(line, separator) for line in above[-layer:]] if layer else []
    if not layer or [first for first, _ in names] != list(range(layer)):
        return 0
    ends = [last + sum(deeper for _, deeper in names[first + 1 :]) for first, last in names]
    rows = [_extent(line, separator) for line in below if line.strip()]
    others = [(first, last) for first, last in rows if first < layer]
    return layer if others and all(last <= ends[first] for first, last in others) else 0


def _extent(line: str, separator: str) -> tuple[int, int]:
    """Indices of the first and of the last non-empty cell of a line."""
    filled = [i for i, cell in enumerate(split(line, separator)) if cell.strip()]
    return (filled[0], filled[-1]) if filled else (0, 0)


def _cells(lines: Sequence[str], at: int) -> list[str]:
    """The cells of the line number `at`; none of a comment."""
    return [] if lines[at].startswith(COMMENT) else split(lines[at], _separator_at(lines, at))


def _separator_at(lines: Sequence[str], at: int) -> str:
    return separator_of(lines[at], lines[at + 1 : at + 3])


def _first_line(lines: Sequence[str], name: str) -> tuple[int, tuple[str, ...]]:
    """(index, cells) of the first line that is neither blank nor a comment, where no line names known columns."""
    start = next((i for i, line in enumerate(lines) if line.strip() and not line.startswith(COMMENT)), None)
    if start is None:
        raise DataError(f"{name} has no header line; the first line should name the columns.")
    separator = _separator_at(lines, start)
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
    return start, header


def _column_numbers(cells: Sequence[str], name: str, line: int, wanted: Collection[str]) -> tuple[str, ...]:
    """Names for the columns of a table that has none, which a user can recognise from its first row."""
    if not any(each.startswith(COLUMN_NUMBER) for each in wanted):
        shown = ", ".join(
            f"{COLUMN_NUMBER}{i} {cell.strip()!r}" for i, cell in enumerate(cells[:SHOWN], start=1)
        )
        more = f" and {len(cells) - SHOWN} more" if len(cells) > SHOWN else ""
        raise DataError(
            f"{name}, line {line + 1}: no line above the numbers names the columns; call them by their number: "
            f"--column time_s={COLUMN_NUMBER}N --column current_a={COLUMN_NUMBER}N --column voltage_v={COLUMN_NUMBER}N,"
            " and --sign charge-positive if charging is positive there. "
            f"The first row: {shown}{more}."
        )
    return tuple(f"{COLUMN_NUMBER}{i}" for i in range(1, len(cells) + 1))


def _padded_header(header: tuple[str, ...], below: Sequence[str], separator: str) -> tuple[str, ...]:
    """The header with as many names as a row has cells: loggers end the line of names or the rows with a separator, not
    always both."""
    first = next((line for line in below if line.strip()), None)
    if first is None:
        return header
    cells = split(first, separator)
    if len(cells) == len(header) - 1 and header[-1] == "":
        return header[:-1]
    if len(cells) == len(header) + 1 and not cells[-1].strip():
        return (*header, "")
    return header


def decimal_in(rows: Iterable[Sequence[str]], separator: str) -> str | None:
    """The decimal sign: a comma where more cells have one than a point, else a point; None where no cell has either.

    With a comma as separator, such cells are quoted, and the comma may separate thousands: three digits follow it, and
    the number does not begin with 0. Where all cells are so, they are left to be refused.
    """
    cells = [cell.strip() for row in rows for cell in row]
    with_comma = [cell for cell in cells if WITH_COMMA.fullmatch(cell)]
    points = sum("." in cell and bool(NUMBER.fullmatch(cell)) for cell in cells)
    if separator == "," and all(THOUSANDS.fullmatch(cell) for cell in with_comma):
        return "."
    return "," if len(with_comma) > points else "." if points else None
