"""How far the declared parameters, and where records begin, are believed."""

from __future__ import annotations

from typing import Literal

from aesi.parameters import Parameter
from aesi.physics.effect import Effect

Trust = Literal["exact", "tight", "loose", "measured", "lasting", "beside"]
"""How far the declared parameters are believed. exact: fitted to this very cell by this very model.  tight: a careful
parametrisation of this cell.  loose: one of another cell of its make.  measured: fitted to this very cell by a model
that errs as models of measured cells do, its records read by instruments that may be off.  lasting: the same, where
what is gone within seconds does not count.  beside: as lasting, with records of the cell that are known to be good, so
that the question is what is different about the others."""
MEASURED_CELL: tuple[Trust, ...] = ("measured", "lasting", "beside")
"""Where the file is believed, and the model errs as models of measured cells do."""
AGEING: tuple[Trust, ...] = ("loose", "measured", "lasting")
"""Where the records of a cell may be of several ages: not where something explains them all, and what is sought beside
good records is what has changed since."""
BESIDE_SOC0_SD = 5e-3
"""Least standard deviation of an initial state of charge beside good records: starts at a full charge are off by 0.33 %
RMS on 24 pairs of development records (`python -m aesi.bench.real.repeatability`)."""
EXACT_SHARE = 0.1
"""Share of the tight spread of a declared parameter that is left to it where the file is believed exactly. A
convention: not nought, so that round-off of the numerics is no evidence for an effect."""


def start_sd(trust: Trust, read_sd: float) -> float:
    """Standard deviation of an initial state of charge.  read_sd : as it was read from the record."""
    return max(read_sd, BESIDE_SOC0_SD) if trust == "beside" else read_sd


def own_sd(trust: Trust, effect: Effect, p: Parameter, capacity_ah: float) -> float | None:
    """Standard deviation of a parameter that the model of a cell of this capacity declares, of its logarithm where it
    has a logarithmic scale; None where nothing is open."""
    if p.spread is None:
        return None
    measured_cell = trust in MEASURED_CELL
    as_it_is = measured_cell and effect.kind == "instrument"
    sd = p.spread.loose if trust == "loose" or as_it_is else p.spread.tight
    if sd is None:
        return None
    if (trust == "exact" or measured_cell) and effect.kind == "parameter":
        sd *= EXACT_SHARE
    return sd * capacity_ah**p.capacity_power
