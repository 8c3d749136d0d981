"""Bounds of the initial state of charge from the charge that a record moves.

A voltage on a flat potential, or shortly after an unrecorded current, gives an uncertain state of charge. But a
discharge of 0.95 of the capacity cannot begin at 0.7, since it would end further beyond empty than any cell can. The
reading is taken as normally distributed, and truncated at these bounds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from aesi.numerics.typing import Array
from aesi.physics.belongs import SOC_MARGIN
from aesi.physics.start.state import InitialState
from aesi.records import Hold, Measurement

CONTRADICTED = 0.02
"""Probability of the reading within the bounds below which the charge contradicts it, as at two standard deviations.
Such a record is of another cell, or in another unit; it is reported elsewhere and left as read."""
MOVED_SDS = 0.1
"""Smallest correction by the bounds that is applied, in standard deviations of the reading."""


def told_by_charge(read: InitialState, record: Measurement, hold: Hold, capacity_ah: float) -> InitialState:
    """The state read under load, truncated so that no row of the record is further beyond empty or full than cells may
    be; unchanged where the bounds hardly matter, or contradict it."""
    moved = record.discharged_ah(hold) / capacity_ah
    ends = _ends(moved)
    low, high = ((ends - read.soc) / read.sd).tolist()
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


def carried_from(soc: float, record: Measurement, hold: Hold, capacity_ah: float) -> bool:
    """Whether no row of a record that begins at a state of charge is further beyond empty or full than cells hold more
    than they are declared to."""
    low, high = _ends(record.discharged_ah(hold) / capacity_ah)
    return bool(low <= soc <= high)


def _ends(moved: Array) -> Array:
    """(2,) the least and the largest state of charge that a record may begin at which moves these shares (n,) of the
    capacity."""
    return np.array([float(moved.max()) - SOC_MARGIN, 1.0 + SOC_MARGIN + float(moved.min())])
