"""How a text table is written: its encoding, separator, decimal sign and header, told by a look at its head."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from aesi.data.readers.formats.format import Format
from aesi.data.readers.heading import (
    LINES_LOOKED_AT,
    NUMBER,
    WITH_COMMA,
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
"""Before the number of a column in a table without names."""
LINES_BELOW = 49
"""Of the table, that tell its decimal sign and its width. A convention."""
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
LONE_NUL = re.compile(rb"^\x00(?=\r?$)", re.MULTILINE)
"""A line of one NUL, as Digatron's exports have it above the names of the columns: blank. Any other is binary."""


@dataclass(frozen=True)
class Layout:
    """How a text table is written: what a look at its head tells.

    decimal : '' where the lines that were looked at hold whole numbers alone.
    layer : empty cells that a row of this table begins with, in a report that holds those of cycles and steps too.
    """

    encoding: str
    separator: str
    decimal: str
    header: tuple[str, ...]
    lines_before_data: int
    notes: tuple[str, ...]
    format: Format | None = None
    units: tuple[str, ...] = field(default=())
    layer: int = 0


def decoded(head: bytes, name: str) -> tuple[str, str]:
    """Encoding and text of the head: by its mark, else UTF-8, else Latin-1, which takes any byte."""
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
    """How a text is laid out as a table, and sentences on what that took for granted.

    text : the beginning of a file, or all of it (`whole`); else its last line may be cut off.  encoding : that it was
    read in.  name : of the file.  wanted : names of columns that the user gave, which a header holds.
    """
    lines = io.StringIO(text, newline=None).read().split("\n")
    if lines[-1] == "":
        del lines[-1]  # what follows the end of the last line is none
    if not whole:
        lines = lines[:-1]  # the last one may be cut by the size of the look
    notes: list[str] = []
    rows = [_cells(lines, at) for at in range(min(len(lines), LINES_LOOKED_AT))]
    heading = find_heading(rows, wanted) or likely_heading(_rows_from(lines))
    nameless = first_of_numbers(_rows_from(lines)) if heading is None else None
    if heading is not None:
        start, header = heading.line, heading.header
        first_row = start + 1 + int(heading.has_units)
    elif nameless is not None:
        start, header = nameless, _numbered(rows[nameless], name, nameless, wanted)
        first_row = start
        notes.append("No line names the columns; they were numbered, #1 the first.")
    else:
        start, header = _first_line(lines, name)
        first_row = start + 1
    separator = _separator_at(lines, start)
    if start:
        above = "1 line" if start == 1 else f"{start} lines"
        of = "table" if nameless is not None else "header"
        notes.append(f"{above} before the {of} {'was' if start == 1 else 'were'} passed over.")
    if heading is not None and heading.has_units:
        notes.append("The line of units below the header was read as such.")
    if encoding == "latin-1":
        notes.append("The file is not UTF-8; it was read as Latin-1.")
    if whole and text and not text.endswith(("\n", "\r")):
        notes.append("The last line does not end: if the file was cut there, its last number is too short.")
    below = lines[first_row : first_row + LINES_BELOW]
    decimal = decimal_in((split(line, separator) for line in below), separator)
    header = _as_wide_as_the_rows(header, below, separator)
    form, units = (heading.format, heading.units) if heading else (None, ())
    layer = _layer(lines[:start], header, below, separator) if form else 0
    if layer:
        notes.append("The rows of cycles and steps between the records were passed over.")
    layout = Layout(encoding, separator, "", header, first_row, tuple(notes), form, units, layer)
    return layout if decimal is None else with_decimal(layout, decimal)


def with_decimal(layout: Layout, decimal: str) -> Layout:
    """The layout with a decimal sign, and a sentence on one that is a comma."""
    told = ("Numbers were read with a decimal comma.",) if decimal == "," else ()
    return replace(layout, decimal=decimal, notes=(*layout.notes, *told))


def _rows_from(lines: Sequence[str]) -> Iterator[list[list[str]]]:
    """Of each line, its cells and those of the two below, all split as the line itself is: decimal commas may outnumber
    the separators below."""
    for start, line in enumerate(lines[:LINES_LOOKED_AT]):
        separator = _separator_at(lines, start)
        below = lines[start + 1 : start + 3]
        yield [
            [] if line.startswith(COMMENT) else split(line, separator),
            *(split(b, separator) for b in below),
        ]


def _layer(above: Sequence[str], header: tuple[str, ...], below: Sequence[str], separator: str) -> int:
    """Empty cells that a row of this table begins with, below the names of other layers; 0 of a table by itself.

    Those names stand in the lines right above, each indented by one cell more, and the rows of such a layer have no
    more cells than its names: a first column without a name, as of row numbers, is none of that. Neware may write the
    first row of a step into the line of its cycle, so that the cells of the layers between may follow.
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
    """Numbers of the first and of the last cell of a line that holds something."""
    filled = [i for i, cell in enumerate(split(line, separator)) if cell.strip()]
    return (filled[0], filled[-1]) if filled else (0, 0)


def _cells(lines: Sequence[str], at: int) -> list[str]:
    return [] if lines[at].startswith(COMMENT) else split(lines[at], _separator_at(lines, at))


def _separator_at(lines: Sequence[str], at: int) -> str:
    return separator_of(lines[at], lines[at + 1 : at + 3])


def _first_line(lines: Sequence[str], name: str) -> tuple[int, tuple[str, ...]]:
    """Where no line names known columns: the first that is neither blank nor a comment."""
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


def _numbered(cells: Sequence[str], name: str, line: int, wanted: Collection[str]) -> tuple[str, ...]:
    """Names for the columns of a table that has none, by which a user who saw its first row can call them."""
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


def decimal_in(rows: Iterable[Sequence[str]], separator: str) -> str | None:
    """A comma, where more of the cells have a comma than a point; None where no cell has either.

    Between commas such cells are quoted, and a comma may be one between thousands, which has three digits behind it
    and none but 1 to 9 in front: where all are so, it is left to be refused.
    """
    cells = [cell.strip() for row in rows for cell in row]
    with_comma = [cell for cell in cells if WITH_COMMA.fullmatch(cell)]
    points = sum("." in cell and bool(NUMBER.fullmatch(cell)) for cell in cells)
    if separator == "," and all(THOUSANDS.fullmatch(cell) for cell in with_comma):
        return "."
    return "," if len(with_comma) > points else "." if points else None
