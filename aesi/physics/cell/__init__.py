"""A cell as its BPX file declares it."""

from aesi.physics.cell.cell import Cell, Electrode, Electrolyte, Separator, initial_soc

__all__ = ["Cell", "Electrode", "Electrolyte", "Separator", "initial_soc"]
