"""Search for the heading of a table: the line with the names of its columns, below a logger's preamble."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from aesi.data.readers.formats import recognise
from aesi.data.readers.formats.format import Format, plain

LINES_LOOKED_AT = 600
"""Number of lines searched: BioLogic writes some 100 lines above its table, Novonix one per step of the protocol."""
SEPARATORS = ",;\t|"
KNOWN = ("time_s", "current_a", "voltage_v", "test time / s", "current / a", "voltage / v")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?inf(inity)?", re.ASCII | re.IGNORECASE)
WITH_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?", re.ASCII)
UNIT_CELL = re.compile(
    r"[\[(<]?\s*(s|sec|ms|min|h|hr|d|hh:mm:ss(\.\w+)?|h:m(in)?:s|[mkµu]?a|[mkµu]?v|°?[cf]|deg[cf]|k|%|[mk]?ah|[mk]?wh|"
    r"[mk]?w|[mµu]?ohm|[mµu]?ω|[mk]?hz|cnt|#|-|1)?\s*[\])>]?|\[[^\[\]]*\]",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Heading:
    """The heading of a table.

    line : its number, counted from 0.  units : units from a line of units below it, '' for a column without one.
    """

    line: int
    header: tuple[str, ...]
    format: Format | None
    units: tuple[str, ...]

    @property
    def has_units(self) -> bool:
        """True where a line of units, which holds no data, is between the names and the numbers."""
        return any(self.units)


def find_heading(rows: Sequence[Sequence[str]], wanted: Collection[str]) -> Heading | None:
    """The heading among rows of cells: a maker's, or a row with two of this project's, BDF's or the wanted names; None
    without one.
    """
    names = {*KNOWN, *(plain(name) for name in wanted)}
    fallback: Heading | None = None
    for line, cells in enumerate(rows[:LINES_LOOKED_AT]):
        if len(cells) < 2:
            continue
        header = tuple(one_line(cell).lstrip("~") for cell in cells)
        below = rows[line + 1] if line + 1 < len(rows) else ()
        form = recognise(header)
        if form is not None:
            return Heading(line, header, form, _units(header, below))
        same = {plain(name) for name in header} & names
        same |= {name.lower() for name in header} & names
        if fallback is None and len(same) >= 2:
            fallback = Heading(line, header, None, _units(header, below))
    return fallback


def likely_heading(rows_from: Iterable[Sequence[Sequence[str]]]) -> Heading | None:
    """The first row of names with as many cells below it, at least two of them numbers; None where there is none.

    For tables without known names, so that a message can propose theirs.
    rows_from : for each line, its cells and those of the two lines below.
    """
    for line, (cells, *below) in enumerate(rows_from):
        names = tuple(map(one_line, cells))
        if sum(map(bool, names)) < 2 or any(_is_number(name) for name in names):
            continue
        units = _units(names, below[0]) if below else ()
        first = below[bool(units) :][:1]
        if first and len(first[0]) == len(names) and sum(_is_number(cell) for cell in first[0]) >= 2:
            return Heading(line, names, None, units)
    return None


def first_of_numbers(rows_from: Iterable[Sequence[Sequence[str]]]) -> int | None:
    """The line at which a table without names begins: it has at least two numbers, in the same columns as the line
    below, and no possible names directly above it. None where there is none.

    rows_from : as for `likely_heading`.
    """
    names_above = False
    for line, (cells, *below) in enumerate(rows_from):
        numbers = [_is_number(cell) for cell in cells]
        if sum(numbers) >= 2 and below and [_is_number(cell) for cell in below[0]] == numbers:
            return None if names_above else line
        if any(cell.strip() for cell in cells):
            names_above = sum(bool(cell.strip()) for cell in cells) >= 2
    return None


def one_line(name: str) -> str:
    """A column's name with a blank for each line break, as it can be written in an option."""
    return re.sub(r"\s*[\r\n]\s*", " ", name.strip())


def _is_number(cell: str) -> bool:
    return bool(NUMBER.fullmatch(cell.strip()) or WITH_COMMA.fullmatch(cell.strip()))


def separator_of(line: str, below: Sequence[str]) -> str:
    """The separator of a line's cells. Of several candidates it is one that leaves two numbers in the line or a line
    below and commas only within numbers, where they are decimal; else the most frequent one. Frequency alone is not
    enough: decimal commas and those of names (`Zeit, s`) may outnumber the tabs.
    """
    for separator in SEPARATORS.replace(",", ""):
        if separator in line and any(_is_row_of_numbers(split(each, separator)) for each in (line, *below)):
            return separator
    return max(SEPARATORS, key=line.count)


def _is_row_of_numbers(cells: Sequence[str]) -> bool:
    with_comma = [cell for cell in cells if "," in cell]
    return sum(map(_is_number, cells)) >= 2 and all(map(_is_number, with_comma))


def split(line: str, separator: str) -> list[str]:
    """The cells of a line; none where it cannot be split."""
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:
        return []


def _units(header: Sequence[str], below: Sequence[str]) -> tuple[str, ...]:
    """The units in a line that holds only units, at least two; empty where it is a line of data."""
    cells = [cell.strip() for cell in below]
    said = [cell for cell in cells if cell]
    if len(said) < 2 or not all(UNIT_CELL.fullmatch(cell) and not cell.isdigit() for cell in said):
        return ()
    units = [cell.strip("[]()<> ") for cell in cells]
    return tuple([*units, *[""] * len(header)][: len(header)])
