"""What a reader offers: a header, and the numbers below it on request."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from aesi.numerics.typing import Array


class TableFile(Protocol):
    """One table on disk, whatever its format."""

    path: Path
    header: tuple[str, ...]
    notes: tuple[str, ...]

    def read(self, positions: tuple[int, ...]) -> list[Array]:
        """The columns at the given positions, each (n_rows,) float; an empty cell is NaN.

        Raises DataError at the first cell that is not a number, at a row of the wrong length, and where the
        file is damaged.
        """
        ...

    def where(self, row: int) -> str:
        """How to find a row (counted from 0) in the file: 'row 5 (line 6)'."""
        ...
