"""Models of a cell (single particle and porous electrode), and the effects that they may lack."""

from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Contribution, Effect, Record, Trace
from aesi.physics.impedance import impedance
from aesi.physics.initial_state import InitialState, initial_state
from aesi.physics.model import EspmModel
from aesi.physics.rest.open_circuit import initial_soc
from aesi.physics.simulation import ModelName, simulate

__all__ = [
    "ActiveEffect",
    "Cell",
    "Contribution",
    "Effect",
    "EspmModel",
    "InitialState",
    "ModelName",
    "Record",
    "Trace",
    "impedance",
    "initial_soc",
    "initial_state",
    "simulate",
]
