"""Neware's binary `.nda` and `.ndax`, through the Battery Data Alliance's `batterydf`, which hands over BDF."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path

import numpy as np

from aesi.data.readers.formats import neware
from aesi.data.readers.frame import FrameTable, table_of_columns
from aesi.errors import DataError, first_line
from aesi.numerics.typing import AnyArray


def open_nda(path: Path) -> FrameTable:
    """The records of an `.nda` or `.ndax` file.  Raises DataError where its reader is missing or fails."""
    try:
        import bdf
    except ImportError:
        raise DataError(
            f"{path.name} is a cycler's own file; install its reader (pip install batterydf), "
            "or export the test as CSV."
        ) from None
    logger = logging.getLogger(ITS_READER)
    logger.disabled = True  # what it logs of a damaged file, it raises too
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            frame = bdf.read(path, validate=False)
    except Exception as error:
        # Each of its plugins raises its own.
        raise DataError(
            f"{path.name} cannot be read by batterydf: {_reason(error)}; copy it again, or export the test as CSV."
        ) from None
    finally:
        logger.disabled = False
    columns = {str(name): frame[name].to_numpy() for name in frame.columns}
    notes = ["Read by batterydf, which converted its units and names to BDF."]
    table = table_of_columns(path, _with_test_time(columns, notes), tuple(notes))
    # Its columns have BDF's names. Of a known export two rows may share a stamp.
    table.format = neware.FORMAT
    return table


ITS_READER = "newarenda"
"""Package that batterydf reads such files by, and its logger."""


def _reason(error: Exception) -> str:
    """What the first reader that batterydf tried says, the one of such files. It lists what all of them say."""
    every = " ".join(str(error).split())
    said = every.partition(" failed: ")[2].partition("; ")[0]
    return said.rstrip(".") or first_line(error).rstrip(".")


TEST_TIME, STEP, CYCLE = "Test Time / s", "Step Count / 1", "Cycle Count / 1"
TURN = 2.0 * np.pi


def _with_test_time(columns: dict[str, AnyArray], notes: list[str]) -> dict[str, AnyArray]:
    """The columns with the time of the test. batterydf 0.1.0 returns an `.ndax` with the time of the step as that of
    the test, and with cycles converted to radians; both are corrected where found. Can go with a version that does
    neither."""
    out = dict(columns)
    if TEST_TIME in columns and STEP in columns:
        time_s, step = (np.asarray(columns[name], dtype=float) for name in (TEST_TIME, STEP))
        back = np.diff(time_s) < 0.0
        if back.any() and (np.diff(step)[back] != 0.0).all():
            out[TEST_TIME] = time_s + np.concatenate([[0.0], np.cumsum(np.where(back, time_s[:-1], 0.0))])
            notes.append("Its time begins anew with each step; the steps were put one after the other.")
    if CYCLE in columns:
        turns = np.asarray(columns[CYCLE], dtype=float) / TURN
        if len(turns) and turns.any() and np.allclose(turns, np.round(turns), atol=1e-6):
            out[CYCLE] = np.round(turns)
    return out
