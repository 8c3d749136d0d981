"""The extended single-particle model, its cells and the effects it may lack."""

from aesi.physics.cell import Cell, initial_soc
from aesi.physics.espm import simulate

__all__ = ["Cell", "initial_soc", "simulate"]
