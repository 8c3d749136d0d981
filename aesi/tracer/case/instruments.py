"""What instruments did to a record they did to its rows as measured, before those were averaged for fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from aesi.data.thinning import Averaged
from aesi.physics.effect import ActiveEffect, Effect, Record
from aesi.records import Measurement


def instruments_undone(
    data: Measurement, effects: Sequence[ActiveEffect]
) -> tuple[Measurement, tuple[ActiveEffect, ...]]:
    """The record that the cell saw behind its instruments, and what the effects do beside that.

    A lag of half a second cannot be told from rows of a second: a jump of the current is spread over them. Nor can one
    of a tenth from the sparse rows of a pulse, which begin where the current jumps. Records that were not averaged are
    returned as they are, with all effects.
    """
    acting = tuple(a for a in effects if a.effect.kind == "instrument" and a.effect.on_record is not None)
    if not acting or not isinstance(data, Averaged):
        return data, tuple(effects)
    rest = tuple(replace(a, effect=_elsewhere(a.effect)) if a in acting else a for a in effects)
    return _seen_by_cell(data, acting), rest


@lru_cache(maxsize=64)
def _seen_by_cell(data: Averaged, acting: tuple[ActiveEffect, ...]) -> Measurement:
    """The record behind the instruments: of the parameters that a fit moves few are theirs."""
    record = Record(data.finer.time_s, data.finer.current_a)
    for active in acting:
        assert active.effect.on_record is not None
        record = active.act(active.effect.on_record, record)
    return data.with_record(record.time_s, record.current_a)


@lru_cache(maxsize=64)
def _elsewhere(effect: Effect) -> Effect:
    """The effect with all but what it does to the record."""
    return replace(effect, on_record=None)
