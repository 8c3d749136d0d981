"""Write effects that only change numbers of the cell file into the cell."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, materials_first
from aesi.physics.model import EspmModel


@dataclass(frozen=True)
class Folded:
    """cell : with all effects that a cell file can hold; its description names them.
    held, left : the effects that are in the cell now, and those that are not; without those that change nothing."""

    cell: Cell
    held: tuple[ActiveEffect, ...]
    left: tuple[ActiveEffect, ...]

    def same_window(self, declared: Cell) -> bool:
        """True where the stoichiometry windows are those of `declared`, so that a state of charge means the same; a
        loss of lithium or of active material moves full and empty."""
        return all(
            (new.theta_min, new.theta_max) == (old.theta_min, old.theta_max)
            for new, old in ((self.cell.negative, declared.negative), (self.cell.positive, declared.positive))
        )


def folded(
    cell: Cell, effects: Iterable[ActiveEffect], stays: Callable[[ActiveEffect], bool] = lambda active: False
) -> Folded:
    """The cell with every effect applied that acts on the parameters of a cell file alone.

    Effects on the record, on the reading, on the voltage, or on parameters that a cell file does not declare (layers,
    particle sizes, a heat balance) are left, and so are those that `stays` selects.
    Raises as `ActiveEffect.act` where a user's own effect fails on the cell.
    """
    held: list[ActiveEffect] = []
    left: list[ActiveEffect] = []
    for active in materials_first(effect for effect in effects if not effect.vanishes):
        changed = None if stays(active) else _on_cell_alone(cell, active)
        if changed is None:
            left.append(active)
        else:
            cell = changed
            held.append(active)
    if held:
        changed_by = f"Values changed by {', '.join(map(repr, held))}."
        cell = replace(cell, description=f"{cell.description} {changed_by}".strip())
    return Folded(cell, tuple(held), tuple(left))


def _on_cell_alone(cell: Cell, active: ActiveEffect) -> Cell | None:
    effect = active.effect
    if effect.on_model is None or effect.on_record or effect.on_voltage or effect.on_reading:
        return None
    before = EspmModel(cell)
    after = active.act(effect.on_model, before)
    return after.cell if replace(after, cell=cell) == before else None
