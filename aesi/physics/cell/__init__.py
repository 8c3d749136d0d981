"""A cell as its BPX file declares it."""

from aesi.physics.cell.cell import Cell
from aesi.physics.cell.health import Soh, checked_soh, read_soh
from aesi.physics.cell.parts import CellParameters, Electrode, Electrolyte, Separator

__all__ = [
    "Cell",
    "CellParameters",
    "Electrode",
    "Electrolyte",
    "Separator",
    "Soh",
    "checked_soh",
    "read_soh",
]
