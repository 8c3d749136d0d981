"""Excel workbooks (.xlsx), as Arbin and Neware write them, through openpyxl.

The table is taken from the first sheet with a heading of known names, or else from the longest sheet with any heading:
cyclers write sheets of sums over steps and cycles before that of the records. A note names further sheets with the same
columns, into which Arbin divides a long test. Clock times and dates become text, so that they are read as from a text
file.
"""

from __future__ import annotations

import datetime
import zipfile
from collections.abc import Collection, Iterable, Sequence
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.readers.frame import FrameTable
from aesi.data.readers.heading import LINES_LOOKED_AT, Heading, find_heading, likely_heading
from aesi.errors import DataError, first_line

WORKBOOK = "[Content_Types].xml"
"""A member of every Office Open XML archive (ECMA-376, part 2)."""

LAST_YEAR_OF_CLOCKS = 1900
"""Excel stores a time of more than a day, formatted as a time of day (h:mm:ss), as a date up to this year; no test is
that old."""


def open_sheet(path: Path, wanted: Collection[str]) -> FrameTable:
    """The sheet with the table of measurements.

    Raises DataError where openpyxl is missing, the file is no workbook, or no sheet has a heading.
    """
    _check_no_archive(path)
    try:
        import openpyxl  # type: ignore[import-untyped]
    except ImportError:
        raise DataError(
            f"{path.name} is an Excel workbook; install its reader (pip install openpyxl), or save the sheet as CSV."
        ) from None
    try:
        # By its content: of a name, openpyxl refuses a workbook that is called .csv.
        content = BytesIO(path.read_bytes()) if zipfile.is_zipfile(path) else path
        book = openpyxl.load_workbook(content, read_only=True, data_only=True)
    except Exception as error:
        # openpyxl raises what zipfile, its XML reader and its own checks raise.
        raise DataError(
            f"{path.name} is a spreadsheet or an archive that cannot be read ({first_line(error, 120)}); save the "
            "sheet as CSV."
        ) from None
    try:
        return _first_table(path, book, wanted)
    finally:
        book.close()


def _check_no_archive(path: Path) -> None:
    """Refuse a zip archive that is not a workbook: it has to be unpacked."""
    if not zipfile.is_zipfile(path):
        return
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    if WORKBOOK not in names:
        raise DataError(
            f"{path.name} is a zip archive ({', '.join(names[:3])}{', ...' * (len(names) > 3)}); unpack it, and give a "
            "file of it."
        )


def _first_table(path: Path, book: Any, wanted: Collection[str]) -> FrameTable:
    heads = [(sheet, _head(sheet)) for sheet in book.worksheets]
    tables = _with_headings((sheet, find_heading(head, wanted)) for sheet, head in heads)
    if not tables:
        unknown = _with_headings(
            (sheet, likely_heading(head[i : i + 3] for i in range(len(head)))) for sheet, head in heads
        )
        tables = sorted(unknown, key=lambda table: -(table[0].max_row or 0))
    if tables:
        sheet, heading = tables[0]
        alike = [repr(other.title) for other, its in tables[1:] if its.header == heading.header]
        return _table(path, sheet, heading, alike)
    raise DataError(
        f"{path.name}: no sheet ({', '.join(book.sheetnames[:8])}) names time_s, current_a and voltage_v or the "
        "columns of a known cycler; name its columns: --column time_s=NAME --column current_a=NAME "
        "--column voltage_v=NAME."
    )


def _head(sheet: Any) -> list[list[str]]:
    return [
        [_word(cell) for cell in row] for row in islice(sheet.iter_rows(values_only=True), LINES_LOOKED_AT)
    ]


def _with_headings(sheets: Iterable[tuple[Any, Heading | None]]) -> list[tuple[Any, Heading]]:
    return [(sheet, heading) for sheet, heading in sheets if heading is not None]


def _table(path: Path, sheet: Any, heading: Heading, alike: Sequence[str]) -> FrameTable:
    """alike : names of further sheets with the same columns."""
    start = heading.line + 1 + int(heading.has_units)
    numbered = [
        (number, row)
        for number, row in enumerate(islice(sheet.iter_rows(values_only=True), start, None), start + 1)
        if any(c is not None for c in row)
    ]
    rows = [row for _, row in numbered]
    width = len(heading.header)
    columns = [
        [_cell_as_text(row[place]) if place < len(row) else None for row in rows] for place in range(width)
    ]
    notes = [f"Read from the sheet {sheet.title!r}."]
    if alike:
        notes.append(
            f"Not read: {', '.join(alike)}, with the same columns; if the test goes on there, save it whole as one CSV."
        )
    return FrameTable(
        path, heading.header, columns, tuple(notes), heading.units, [number for number, _ in numbered]
    )


def _word(cell: Any) -> str:
    return "" if cell is None else str(_cell_as_text(cell))


def _cell_as_text(cell: Any) -> Any:
    """Clock times as h:m:s and dates as ISO 8601; all else as it is."""
    if isinstance(cell, datetime.datetime) and cell.year <= LAST_YEAR_OF_CLOCKS:
        from openpyxl.utils.datetime import to_excel  # type: ignore[import-untyped]

        cell = datetime.timedelta(days=to_excel(cell))
    if isinstance(cell, datetime.timedelta):
        seconds = cell.total_seconds()
        hours, rest = divmod(seconds, SECONDS_PER_HOUR)
        minutes, seconds = divmod(rest, 60.0)
        return f"{int(hours)}:{int(minutes):02d}:{seconds:09.6f}"
    if isinstance(cell, datetime.datetime | datetime.time):
        return cell.isoformat()
    return cell
