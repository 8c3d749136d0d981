"""A cell as its BPX file declares it."""

from aesi.physics.cell.cell import Cell, initial_soc
from aesi.physics.cell.parts import CellParameters, Electrode, Electrolyte, Separator, checked_soh

__all__ = ["Cell", "CellParameters", "Electrode", "Electrolyte", "Separator", "checked_soh", "initial_soc"]
