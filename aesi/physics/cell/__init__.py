"""A cell as its BPX file declares it."""

from aesi.physics.cell.cell import Cell, initial_soc
from aesi.physics.cell.parts import CellParameters, Electrode, Electrolyte, Separator

__all__ = ["Cell", "CellParameters", "Electrode", "Electrolyte", "Separator", "initial_soc"]
