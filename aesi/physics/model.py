"""What a simulation solves: a declared cell plus the constitutive choices that effects may change.

Frozen and hashable by value: effects return changed copies, and everything derived is cached by value.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from aesi.physics.cell import Cell

DEFAULT_SOLID_ORDER = 12
DEFAULT_ELECTROLYTE_ORDER = 4
DEFAULT_SUBSTEP_S = 2.0


@dataclass(frozen=True)
class EspmModel:
    """The extended single-particle model of a cell.

    solid_order : even Legendre polynomials a particle.  electrolyte_order : polynomial degree a layer.
    substep_s : longest step of the concentration-dependent part of diffusion; the rest is stepped exactly.
    """

    cell: Cell
    solid_order: int = DEFAULT_SOLID_ORDER
    electrolyte_order: int = DEFAULT_ELECTROLYTE_ORDER
    substep_s: float = DEFAULT_SUBSTEP_S
    extras: tuple[Any, ...] = field(default=())

    def with_cell(self, **changes: Any) -> EspmModel:
        """A copy whose cell has the given fields replaced."""
        return replace(self, cell=replace(self.cell, **changes))
