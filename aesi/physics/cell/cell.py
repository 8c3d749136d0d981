"""A cell and its BPX file.

Sign convention of the whole package: current is positive on discharge.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi, prod
from numbers import Real
from os import PathLike
from typing import Any, Self

import numpy as np

from aesi.constants import CM_PER_M, MILLI
from aesi.errors import CellError, in_words
from aesi.physics.cell.bpx.read import read_bpx
from aesi.physics.cell.bpx.values import check_values
from aesi.physics.cell.bpx.write import write_bpx
from aesi.physics.cell.parts import CellParameters
from aesi.physics.cell.relations import hashed_once
from aesi.records.checked import is_finite_number

EDGE_MM = (0.1, 5000.0)
"""Range of the diameter, height or edges of a body. A convention: 18 to 70 mm of round cells, 1 mm to a metre of flat
ones; in metres they are below the range."""
DENSITY_KG_M3 = (200.0, 20000.0)
"""Range of mass over volume: 1,847 to 2,706 kg/m3 in the shipped files, and a thousand times more or less where the
mass is in kg or the body in cm."""


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
        for which, volts in (("lower", lower_v), ("upper", upper_v)):
            if not is_finite_number(volts):
                raise CellError(f"{self.name}: {in_words(volts)} V as the {which} cut-off is no number.")
        cell = replace(self, lower_voltage_v=lower_v, upper_voltage_v=upper_v)
        check_values(cell, self.name)
        return cell

    def with_body(self, size_mm: Sequence[float] | None = None, mass_g: float | None = None) -> Self:
        """The cell in another body: its volume, surface and density are changed.

        size_mm : (diameter, height) of a cylinder, or the three edges of a box, mm; None keeps the file's volume and
        surface.  mass_g : of the whole cell, g; None keeps the file's density.
        Heat capacity per mass, heat transfer per surface and thermal conductivity do not change.

        Raises CellError for a body or a mass that no cell has, and for a mass of a cell whose volume is not known.
        """
        cell = self
        if size_mm is not None:
            volume, surface = _volume_and_surface(size_mm)
            cell = replace(cell, volume_m3=volume, surface_area_m2=surface)
        if mass_g is None:
            return cell
        if not is_finite_number(mass_g):
            raise CellError(f"a mass of {in_words(mass_g)} g is no number.")
        if cell.volume_m3 is None:
            raise CellError(
                f"{self.name}: a mass of {mass_g:g} g makes no density without a volume; give the size of the body, "
                "too, or 'Volume [m3]' in the cell file."
            )
        density, (least, most) = mass_g / MILLI / cell.volume_m3, DENSITY_KG_M3
        if not least <= density <= most:
            raise CellError(
                f"a mass of {mass_g:g} g in {CM_PER_M**3 * cell.volume_m3:.3g} cm3 makes {density:.3g} kg/m3, and "
                "cells have some 2,500; the mass is in g, and the edges of the body in mm."
            )
        return replace(cell, density_kg_m3=density)

    def to_bpx(self) -> dict[str, Any]:
        """The cell as a BPX 1.x dict; `Cell.from_bpx` restores it."""
        return write_bpx(self)


def _volume_and_surface(size_mm: Sequence[float]) -> tuple[float, float]:
    """(m3, m2) of a cylinder (diameter, height) or a box (three edges), mm.  Raises CellError for another body."""
    least, most = EDGE_MM
    numbers = isinstance(size_mm, Sequence | np.ndarray) and all(isinstance(edge, Real) for edge in size_mm)
    if not numbers or len(size_mm) not in (2, 3) or not all(least <= edge <= most for edge in size_mm):
        raise CellError(
            f"a body of {size_mm!r} mm: give diameter and height of a cylinder, or the three edges of a box, each from "
            f"{least:g} to {most:g} mm."
        )
    edges = [edge / MILLI for edge in size_mm]
    if len(edges) == 2:
        diameter, height = edges
        base = pi * diameter**2 / 4.0
        return base * height, pi * diameter * height + 2.0 * base
    a, b, c = edges
    return prod(edges), 2.0 * (a * b + b * c + c * a)
