"""Files as cyclers write them (BioLogic .mpt, Neware .nda and .ndax), through the Battery Data Alliance's reader.

The package `batterydf` knows the makes, their units and their versions; it hands over a table in the battery
data format. It is an extra (`cyclers`). Other exports are CSV and need no more than a mapping
of their columns.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array


class CyclerTable:
    """A cycler's own file; see `aesi.data.readers.table.TableFile`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._frame = _normalised(path)
        self.header = tuple(str(name) for name in self._frame.columns)
        self.notes: tuple[str, ...] = ("Read by batterydf, which converted its units and names to BDF.",)

    def read(self, positions: tuple[int, ...]) -> list[Array]:
        """The columns at the given positions."""
        import pandas as pd

        found = []
        for position in positions:
            column = pd.to_numeric(self._frame.iloc[:, position], errors="coerce")
            found.append(column.to_numpy(dtype=np.float64))
        return found

    def where(self, row: int) -> str:
        """Rows of the table handed over; the file's own lines are not known."""
        return f"row {row + 1}"


def _normalised(path: Path) -> Any:
    try:
        import bdf
    except ImportError:
        raise DataError(
            f"{path.name} is a cycler's own file; install its reader (pip install batterydf), "
            "or export the test as CSV."
        ) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return bdf.read(path, validate=False)
    except Exception as error:
        # Each of its plugins raises its own.
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise DataError(f"{path.name} cannot be read as a cycler's file: {reason[:200]}") from None
