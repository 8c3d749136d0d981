"""Records whose voltage contradicts the temperature that they are fitted at."""

from __future__ import annotations

from collections.abc import Container, Sequence

from aesi.calibration.records.prepared import Prepared
from aesi.physics.cell import Cell
from aesi.physics.simulation import ModelName
from aesi.physics.start.temperature import contradicted_temperature

OTHER_CELL = "the start file is of a cell with other kinetics, and what the fit moves is right"
"""Another reason for the contradiction, where the temperature is right."""


def against_temperature(
    cell: Cell, records: Sequence[Prepared], model: ModelName, given: Container[str] = ()
) -> tuple[str, ...]:
    """A sentence for each record that contradicts its temperature, judged by the start file before a fit hides it.

    cell : start cell, at the size that the records indicate.
    given : names of the records whose temperature was given by the user, not in a column.
    """
    out = []
    for record in records:
        found = contradicted_temperature(cell, record.rows, record.start.soc, record.hold, model=model)
        if found is not None:
            out.append(found.sentence(record.name, "the start file", OTHER_CELL, given=record.name in given))
    return tuple(out)
