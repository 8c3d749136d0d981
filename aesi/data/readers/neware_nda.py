"""Neware's binary `.nda` and `.ndax`, through the Battery Data Alliance's `batterydf`, which hands over BDF."""

from __future__ import annotations

import warnings
from pathlib import Path

from aesi.data.readers.frame import FrameTable, of_mapping
from aesi.errors import DataError


def open_nda(path: Path) -> FrameTable:
    """The records of an `.nda` or `.ndax` file.  Raises DataError where its reader is missing or fails."""
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
            frame = bdf.read(path, validate=False)
    except Exception as error:
        # Each of its plugins raises its own.
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise DataError(f"{path.name} cannot be read as a cycler's file: {reason[:200]}") from None
    columns = {str(name): frame[name].to_numpy() for name in frame.columns}
    return of_mapping(path, columns, ("Read by batterydf, which converted its units and names to BDF.",))
