"""BioLogic's binary `.mpr`, through galvani."""

from __future__ import annotations

from pathlib import Path

from aesi.data.readers.frame import FrameTable, of_mapping
from aesi.errors import DataError


def open_mpr(path: Path) -> FrameTable:
    """The records of an `.mpr` file.  Raises DataError where galvani is not there or cannot read it."""
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
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise DataError(
            f"{path.name} cannot be read by galvani: {reason[:200]}; export it as text (.mpt)."
        ) from None
    columns = {name: data[name] for name in data.dtype.names}
    return of_mapping(path, columns, ("Read by galvani.",))
