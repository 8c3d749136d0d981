"""The extended single-particle model, its cells and the effects it may lack."""

from aesi.physics.cell import Cell, initial_soc
from aesi.physics.effect import ActiveEffect, Contribution, Effect, Record, Trace
from aesi.physics.model import EspmModel
from aesi.physics.simulation import simulate

__all__ = [
    "ActiveEffect",
    "Cell",
    "Contribution",
    "Effect",
    "EspmModel",
    "Record",
    "Trace",
    "initial_soc",
    "simulate",
]
