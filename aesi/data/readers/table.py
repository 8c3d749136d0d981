"""The interface of a reader: a header, and the numbers below it on request."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

from aesi.data.readers.formats.format import Format
from aesi.numerics.typing import Array


class TableFile(Protocol):
    """One table on disk, in any format.

    format : format of a maker whose column names the table has, else None.
    units : one per column, from a line of units below the names; empty where there is no such line.
    """

    path: Path
    header: tuple[str, ...]
    notes: tuple[str, ...]
    format: Format | None
    units: tuple[str, ...]

    def read(self, positions: tuple[int, ...]) -> list[Array]:
        """The columns at the given positions, each (n_rows,) float; an empty cell is NaN.

        Raises DataError at the first cell that is not a number, at a row of the wrong length, and where the
        file is damaged.
        """
        ...

    def read_text(self, positions: tuple[int, ...]) -> list[list[str]]:
        """The columns at the given positions as they are written, for clock times, dates and words."""
        ...

    def where(self, row: int) -> str:
        """Place of a row (counted from 0) in the file, as text: 'row 5 (line 6)'."""
        ...


SHOWN = 12
"""Largest number of names in a sentence."""


def names_listed(names: Iterable[str]) -> str:
    """Names, such as those of a file's columns, for a sentence: at most SHOWN, and the number of the others."""
    every = list(names)
    more = f" and {len(every) - SHOWN} more" if len(every) > SHOWN else ""
    return ", ".join(repr(name[:40]) for name in every[:SHOWN]) + more
