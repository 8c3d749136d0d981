"""Columns as a CSV file: whole, and with time stamps that are told apart again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from aesi.whole_files import write_whole

if TYPE_CHECKING:
    import pandas as pd

TIME_DIGITS = 15
"""What a double holds of any decimal number: a stamp in seconds since 1970 needs ten for its whole seconds alone."""


def write_csv(path: Path, table: pd.DataFrame, digits: int) -> None:
    """The table as a CSV, its first column with all digits of its numbers, the others with so many.

    table : the first column is the time in s, or another that rises.  digits : significant ones.
    Raises OSError where the file cannot be written.
    """
    time = table.columns[0]
    shown = table.assign(**{time: [f"{stamp:.{TIME_DIGITS}g}" for stamp in table[time]]})
    write_whole(path, shown.to_csv(index=False, float_format=f"%.{digits}g", lineterminator="\n"))
