"""Bounds of the initial state of charge from the charge that a record moves.

A voltage on a flat potential, or shortly after an unrecorded current, gives an uncertain state of charge. But a
discharge of 0.95 of the capacity cannot begin at 0.7, since it would end further beyond empty than any cell can. The
reading is taken as normally distributed, and truncated at these bounds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.over_time import stamp
from aesi.physics.cell import Cell
from aesi.physics.record_checks import SOC_MARGIN
from aesi.physics.start.state import InitialState
from aesi.records import Hold, Measurement

CONTRADICTED = 0.02
"""Probability of the reading within the bounds below which the charge contradicts it, as at two standard deviations.
Such a record is of another cell, or in another unit; it is reported elsewhere and left as read."""
MOVED_SDS = 0.1
"""Smallest correction by the bounds that is applied, in standard deviations of the reading."""


def truncated_by_charge(read: InitialState, moved: Array, bounds: Array) -> InitialState:
    """The state read under load, truncated to the states that the charge of the record admits; unchanged where these
    bounds move it by less than `MOVED_SDS`, and where they contradict it.

    moved : (n,) discharged since the first row, as a share of the capacity.  bounds : (2,) as `start_bounds` has them,
    in the windows of the state.
    """
    low, high = ((bounds - read.soc) / read.sd).tolist()
    share = ndtr(high) - ndtr(low)
    if share < CONTRADICTED:
        return read
    at_low, at_high = np.exp(-0.5 * np.square([low, high])) / np.sqrt(2.0 * np.pi) / share
    rise = float(at_low - at_high)
    soc = read.soc + read.sd * rise
    sd = read.sd * float(np.sqrt(1.0 + low * at_low - high * at_high - rise**2))
    if abs(soc - read.soc) < MOVED_SDS * read.sd:
        return read
    words = f"{read.sentence[:-1]}; as the record moves {np.ptp(moved):.3f} of the capacity, {soc:.3f} +/- {sd:.3f}."
    return replace(read, soc=soc, sd=sd, sentence=words, ends=None)


def check_charge(cell: Cell, record: Measurement, soc0: float, hold: Hold) -> None:
    """Raises DataError for a record whose charge takes the cell more than `SOC_MARGIN` beyond empty or full.

    soc0 : state of charge at its first row.  hold : how its current runs between its rows.
    """
    soc = soc0 - record.discharged_ah(hold) / cell.capacity_ah
    beyond = (soc < -SOC_MARGIN) | (soc > 1.0 + SOC_MARGIN)
    if beyond.any():
        row = int(np.argmax(beyond))
        raise DataError(
            f"{record.name}: the charge moved takes the cell to a state of charge of {100 * soc[row]:.0f} % at "
            f"{stamp(record.time_s[row])} s, from {100 * soc0:.0f} % at the start and with {cell.capacity_ah:.3g} Ah; "
            "check the cell file, soc0 and the sign and unit of the current."
        )


def start_bounds(moved: Array) -> Array:
    """(2,) least and largest state of charge at the first row, within which no row is beyond `SOC_MARGIN`.

    moved : (n,) discharged since the first row, as a share of the capacity.
    """
    return np.array([float(moved.max()) - SOC_MARGIN, 1.0 + SOC_MARGIN + float(moved.min())])
