"""How far the declared parameters and the initial states of records are believed."""

from __future__ import annotations

from typing import Literal

from aesi.parameters import Parameter
from aesi.physics.effect import Effect

Trust = Literal["exact", "tight", "loose", "measured", "lasting", "beside"]
"""How far the declared parameters are believed.
exact: fitted to this very cell with this very model.
tight: a careful parametrisation of this cell.
loose: a parametrisation of another cell of the same make.
measured: fitted to this very cell, with a model error as usual for measured cells and instruments that may be off.
lasting: as measured, without the part of the error within seconds.
beside: as lasting, with records of the cell that are known to be good; the question is how the others differ."""
MEASURED_CELL: tuple[Trust, ...] = ("measured", "lasting", "beside")
"""Trusts at which the file is believed, with a model error as usual for measured cells."""
AGEING: tuple[Trust, ...] = ("loose", "measured", "lasting")
"""Trusts at which records may be of several ages. At exact and tight a model has to explain all records at one age; at
beside, an age that differs from the good records' is itself an answer."""
BESIDE_SOC0_SD = 5e-3
"""Least standard deviation of an initial state of charge beside good records: starts at a full charge are off by 0.33 %
RMS on the good records of 24 pairs, and by 0.28 % without the eight of them with a record that was fitted, or is
of a test case alone (`python -m aesi.bench.real.repeatability`)."""
EXACT_SHARE = 0.1
"""Factor on the tight spread of a declared parameter where the file is believed exactly. A convention: not zero, so
that round-off of the numerics is no evidence for an effect."""


def start_sd(trust: Trust, read_sd: float) -> float:
    """Standard deviation of an initial state of charge.  read_sd : the one that was read from the record."""
    return max(read_sd, BESIDE_SOC0_SD) if trust == "beside" else read_sd


def own_sd(trust: Trust, effect: Effect, p: Parameter, capacity_ah: float) -> float | None:
    """Prior standard deviation of a declared parameter of a cell of this capacity (Ah), in the parameter's unit, or of
    its logarithm where it has a logarithmic scale; None where the parameter is fixed at this trust."""
    if p.spread is None:
        return None
    measured_cell = trust in MEASURED_CELL
    instrument_may_be_off = measured_cell and effect.kind == "instrument"
    sd = p.spread.loose if trust == "loose" or instrument_may_be_off else p.spread.tight
    if sd is None:
        return None
    if (trust == "exact" or measured_cell) and effect.kind == "parameter":
        sd *= EXACT_SHARE
    return sd * capacity_ah**p.capacity_power
