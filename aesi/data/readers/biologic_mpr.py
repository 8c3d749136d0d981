"""BioLogic's binary `.mpr`, through galvani."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.readers.frame import FrameTable, table_of_columns
from aesi.errors import DataError, first_line
from aesi.numerics.typing import AnyArray

BEGINNING = b"BIO-LOGIC MODULAR FILE"
"""First bytes of every `.mpr` file."""


def open_mpr(path: Path) -> FrameTable:
    """The records of an `.mpr` file.  Raises DataError where it is none, or galvani is not there or cannot read it."""
    with path.open("rb") as stream:
        if stream.read(len(BEGINNING)) != BEGINNING:
            raise DataError(
                f"{path.name} does not begin as BioLogic's .mpr files do; copy it again from the cycler's computer, or "
                "give it the ending of the kind of file that it is (.mpt for EC-Lab's text)."
            )
    try:
        from galvani import BioLogic  # type: ignore[import-untyped]
    except ImportError:
        raise DataError(
            f"{path.name} is BioLogic's own file; install its reader (pip install galvani), or export the test as "
            "text (.mpt)."
        ) from None
    try:
        data = BioLogic.MPRfile(str(path)).data
    except Exception as error:
        # It raises many kinds: of numpy, struct and its own.
        raise DataError(
            f"{path.name} cannot be read by galvani: {first_line(error)}; copy it again, or export it as text (.mpt)."
        ) from None
    columns = {name: data[name] for name in data.dtype.names}
    notes = ["Read by galvani."]
    return table_of_columns(path, _with_current(columns, notes), tuple(notes))


CURRENTS, TIME, CHARGES = ("I/mA", "<I>/mA", "I/A", "<I>/A"), "time/s", ("dq/mA.h", "dQ/mA.h")


def _with_current(columns: dict[str, AnyArray], notes: list[str]) -> dict[str, AnyArray]:
    """The columns with a current. For some techniques (GCPL) EC-Lab stores the charge between rows and no current; its
    exported `<I>` is that charge over the time since the row before."""
    charge = next((name for name in CHARGES if name in columns), None)
    if charge is None or TIME not in columns or any(name in columns for name in CURRENTS):
        return columns
    seconds = np.diff(np.asarray(columns[TIME], dtype=float), prepend=np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        current = np.asarray(columns[charge], dtype=float) * SECONDS_PER_HOUR / seconds
    current[~(seconds > 0.0)] = 0.0  # the first row, and rows of one stamp
    notes.append(f"It stores no current: that was taken from the charge between rows ({charge!r}).")
    return columns | {"<I>/mA": current}
