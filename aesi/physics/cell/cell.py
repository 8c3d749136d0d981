"""A cell and its BPX file.

Sign convention of the whole package: current is positive on discharge.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any, Self

from aesi.physics.cell.bpx_read import read_bpx
from aesi.physics.cell.bpx_values import check_values
from aesi.physics.cell.bpx_write import write_bpx
from aesi.physics.cell.parts import CellParameters
from aesi.physics.cell.relations import hashed_once


@hashed_once
@dataclass(frozen=True)
class Cell(CellParameters):
    """A cell as a BPX file declares it; its fields are those of `CellParameters`."""

    def __repr__(self) -> str:
        window = f"{self.lower_voltage_v:g} to {self.upper_voltage_v:g} V"
        return f"Cell({self.name!r}, {self.nominal_capacity_ah:g} Ah, {window})"

    @classmethod
    def from_bpx(cls, source: str | PathLike[str] | Mapping[str, Any], fitted: bool = False) -> Self:
        """The cell of a BPX file (a path) or of its content (a dict), versions 0.x and 1.x.

        fitted : True for the file of a saved model: transport and kinetics are not checked for wrong units, since a fit
        may have moved them beyond those limits.
        Raises CellError, one sentence, for a file that fails the schema or lacks a field that this model needs.
        """
        return cls(**vars(read_bpx(source, fitted)))

    def with_cut_offs(self, lower_v: float, upper_v: float) -> Self:
        """The cell with other cut-off voltages, V, for a cell that is cycled between these.

        The stoichiometry limits do not change: a state of charge of 0 or 1 stays at the previous cut-offs until a
        calibration moves the limits.

        Raises CellError for cut-offs that no cell has, and for an upper one far from the voltage of the full cell.
        """
        cell = replace(self, lower_voltage_v=lower_v, upper_voltage_v=upper_v)
        check_values(cell, self.name)
        return cell

    def to_bpx(self) -> dict[str, Any]:
        """The cell as a BPX 1.x dict; `Cell.from_bpx` restores it."""
        return write_bpx(self)
