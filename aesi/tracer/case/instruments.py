"""Undo instrument faults on the rows as measured, before they are averaged for fits.

The order matters: a lag of half a second no longer shows in rows that are averages over a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from aesi.data.thinning import Averaged, Window
from aesi.physics.effect import ActiveEffect, Effect, Record, as_cell_saw
from aesi.records import Measurement


def instruments_undone(
    data: Measurement, effects: Sequence[ActiveEffect]
) -> tuple[Measurement, tuple[ActiveEffect, ...]]:
    """The record as the cell saw it, averaged, and the effects without the part that was undone.

    A lag of half a second does not show in rows of a second, over which a jump of the current is spread; nor does one
    of a tenth in the sparse rows of a pulse, which begin where the current jumps. Records that were not averaged are
    returned as they are, with all effects.
    """
    acting = tuple(a for a in effects if a.effect.kind == "instrument" and a.effect.on_record is not None)
    if not acting or not isinstance(data, Averaged):
        return data, tuple(effects)
    rest = tuple(replace(a, effect=_elsewhere(a.effect)) if a in acting else a for a in effects)
    return _seen_by_cell(data, acting), rest


@lru_cache(maxsize=64)
def _seen_by_cell(data: Averaged, acting: tuple[ActiveEffect, ...]) -> Measurement:
    """The record without the instruments' faults. Cached, since few of the parameters that a fit moves are theirs."""
    written = Record(data.finer.time_s, data.finer.current_a)
    saw = as_cell_saw(written, acting)
    record = saw.beside_voltage(data.window.hold == "backward", mean=isinstance(data.window, Window))
    return data.with_record(record.time_s, record.current_a)


@lru_cache(maxsize=64)
def _elsewhere(effect: Effect) -> Effect:
    """The effect without the part that acts on the record."""
    return replace(effect, on_record=None)
