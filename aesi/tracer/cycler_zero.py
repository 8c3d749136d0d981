"""A cycler's current whose zero is off: what a calibration leaves open in slow tests.

    I = I_read - offset   while current flows;   none with the relay open, whatever is read

Leaves out errors of the gain. Matters in slow tests, where the offset is a large share of the current and moves the
charge for a day.

Source: accuracies in data sheets, 0.1 % of the range of a cycler.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aesi.numerics.typing import Array, BoolArray
from aesi.parameters import Parameter
from aesi.physics.cell import Cell
from aesi.physics.effect import Effect
from aesi.physics.effect import Record as Driven
from aesi.tracer.knobs import Knob, tolerated_knob
from aesi.tracer.records import Record

OPEN_SHARE = 1e-3
"""Of the largest current of a record: below this a cycler has its relay open, whatever it reads."""
ZERO_ERROR = 5e-4
"""Of the largest current among the data: what a cycler's zero is uncertain by, 0.1 % of its range being usual. Of a
C/20 current that is several per cent."""
SLOW_C_RATE = 0.15
OFFSET = "offset_a"
NOTED_ZERO = 0.02
"""Of a record's typical current."""


def is_slow(cell: Cell, record: Record) -> bool:
    """Is the current so small that a zero that is off would be a share of it?"""
    seen = np.abs(record.thin.current_a[: record.n_fit])
    return float(np.quantile(seen, 0.95)) <= SLOW_C_RATE * cell.nominal_capacity_ah


def flowing(current_a: Array) -> BoolArray:
    """(n,) True where a current flows."""
    size = np.abs(current_a)
    return size > OPEN_SHARE * size.max()


def _corrected(record: Driven, *, offset_a: float) -> Driven:
    """The true current behind the reading of a cycler whose zero is off; with its relay open there is none."""
    return replace(record, current_a=record.current_a - offset_a * flowing(record.current_a))


ZERO = Effect(
    "cycler_zero",
    "instrument",
    _corrected.__doc__ or "",
    {OFFSET: Parameter(0.0, "A", (-1.0, 1.0), "a cycler's data sheet", neutral=0.0, linear=True)},
    on_record=_corrected,
)


def zero_knob(sd_a: float) -> Knob:
    """The zero of the current, known to `sd_a` (A)."""
    return tolerated_knob(ZERO.id, OFFSET, ZERO.parameters[OFFSET], sd_a)


def zero_noted(cell: Cell, records: Sequence[Record], offset_a: float) -> tuple[str, ...]:
    """A sentence for each record whose charge the cycler's zero moves by much."""
    sentences = []
    for record in records:
        current = record.data.current_a
        share = abs(offset_a) / float(np.median(np.abs(current[flowing(current)])))
        if share > NOTED_ZERO and is_slow(cell, record):
            sentences.append(
                f"{record.name}: its charge fits if its current reads {1e3 * abs(offset_a):.2g} mA too "
                f"{'high' if offset_a > 0 else 'low'} ({100 * share:.1f} % of it); that is taken out."
            )
    return tuple(sentences)
