"""Labelled measurements with an effect that the declared cell file does not contain.

Made by PyBaMM alone, so that whoever looks for the effect cannot meet its own code. `plan` lists the cases,
`generate` makes one.
"""

from aesi.data.blind.case import BlindCase, CaseSpec
from aesi.data.blind.cells import CELLS, cells_in
from aesi.data.blind.generate import generate, label_of
from aesi.data.blind.plan import FULL, case, plan, small_plan

__all__ = [
    "CELLS",
    "FULL",
    "BlindCase",
    "CaseSpec",
    "case",
    "cells_in",
    "generate",
    "label_of",
    "plan",
    "small_plan",
]
