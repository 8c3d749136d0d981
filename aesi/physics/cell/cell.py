"""A cell and its BPX file, and the state of charge that a rest voltage tells.

Sign convention of the whole package: current is positive on discharge.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any, Self

import numpy as np

from aesi.errors import SimulationError
from aesi.physics.cell.bpx_read import read_bpx
from aesi.physics.cell.bpx_write import write_bpx
from aesi.physics.cell.parts import CellParameters


@dataclass(frozen=True)
class Cell(CellParameters):
    """A cell as a BPX file declares it; its fields are those of `CellParameters`."""

    def __repr__(self) -> str:
        window = f"{self.lower_voltage_v:g} to {self.upper_voltage_v:g} V"
        return f"Cell({self.name!r}, {self.nominal_capacity_ah:g} Ah, {window})"

    @classmethod
    def from_bpx(cls, source: str | PathLike[str] | Mapping[str, Any], fitted: bool = False) -> Self:
        """Read a BPX file (a path) or what it holds (a dict), versions 0.x and 1.x.

        fitted : it is of a saved model, and a fit may have moved transport and kinetics beyond what tells another unit.
        Raises CellError, one sentence, for a file that fails the schema or lacks a field this model needs.
        """
        return cls(**vars(read_bpx(source, fitted)))

    def to_bpx(self) -> dict[str, Any]:
        """The cell as a BPX 1.x dict; `Cell.from_bpx` gives the cell back."""
        return write_bpx(self)


SOC_GRID = 4001
"""Points at which a rest voltage is inverted: 2.6e-4 of the charge apart."""
SOC_MARGIN = 0.02
"""How far beyond full and empty it is inverted."""


def initial_soc(cell: Cell, voltage_v: float) -> float:
    """State of charge at which the cell rests at `voltage_v`.

    Voltages up to 2 % of state of charge beyond the declared limits are accepted (a full cell relaxes to
    slightly above or below its nominal voltage). Raises SimulationError outside, naming the range.
    """
    soc = np.linspace(-SOC_MARGIN, 1.0 + SOC_MARGIN, SOC_GRID)
    limits = [(e.theta_min, e.theta_max) for e in (cell.negative, cell.positive)]
    inside = np.ones(SOC_GRID, dtype=bool)
    for theta, (low, high) in zip(
        (
            limits[0][0] + soc * (limits[0][1] - limits[0][0]),
            limits[1][1] - soc * (limits[1][1] - limits[1][0]),
        ),
        limits,
        strict=True,
    ):
        inside &= (theta > min(low, 1e-6)) & (theta < max(high, 1 - 1e-6))
    soc = soc[inside]
    ocv = np.maximum.accumulate(cell.rest_voltage_v(soc))
    if not ocv[0] <= voltage_v <= ocv[-1]:
        raise SimulationError(
            f"{cell.name}: a rest voltage of {voltage_v:.4f} V lies outside [{ocv[0]:.3f}, {ocv[-1]:.3f}] V, "
            "what the cell's open-circuit potentials and stoichiometry limits allow; check that the record "
            "starts at rest and belongs to this cell, or give soc0."
        )
    return float(np.interp(voltage_v, ocv, soc))
