"""Notes on records, each said once for all the records that it holds for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from aesi.constants import ZERO_CELSIUS_K
from aesi.physics import ActiveEffect, Cell
from aesi.records import Measurement

SEPARATOR = ": "


def together(notes: Iterable[str]) -> tuple[str, ...]:
    """`a: text`, `b: text` as `a, b: text`, in the order of the first of them."""
    subjects: dict[str, list[str]] = {}
    for note in notes:
        subject, separator, text = note.partition(SEPARATOR)
        subjects.setdefault(text if separator else "", []).append(subject if separator else note)
    alone = subjects.pop("", [])
    return (
        *(f"{', '.join(dict.fromkeys(names))}{SEPARATOR}{text}" for text, names in subjects.items()),
        *alone,
    )


def temperature_sentence(cell: Cell, record: Measurement, effects: Sequence[ActiveEffect]) -> str:
    """At what temperature a record is simulated, and on what that rests."""
    inferred = " and ".join(active.id for active in effects if active.effect.infers == "temperature")
    if record.temperature_degc is not None:
        low, high = float(np.min(record.temperature_degc)), float(np.max(record.temperature_degc))
        beside = f"; {inferred} has nothing to add" if inferred else ""
        return f"{record.name}: at its measured temperature, {low:.1f} to {high:.1f} degC{beside}."
    degc = cell.initial_temperature_k - ZERO_CELSIUS_K
    beside = f" and {inferred} changes it" if inferred else ""
    return (
        f"{record.name}: no temperature in it; taken at {degc:.4g} degC, as the cell's file declares{beside}."
    )
