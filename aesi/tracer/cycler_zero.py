"""A cycler's current whose zero is off, another in each record: a case in which that may be, for calibration.

    I = I_read - offset   while current flows;   none with the relay open, whatever is read

Leaves out errors of the gain. Matters in slow tests, where the offset is a large share of the current and moves the
charge for a day.

Source: accuracies in data sheets, 0.1 % of the range of a cycler.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.typing import Array, BoolArray
from aesi.parameters import Parameter
from aesi.physics.effect import Effect
from aesi.physics.effect import Record as Driven
from aesi.tracer.knobs import Knob, tolerated_knob
from aesi.tracer.problem import Hypothesis, Problem
from aesi.tracer.records import Record

OPEN_SHARE = 1e-3
"""Of the largest current of a record: below this a cycler has its relay open, whatever it reads."""
ZERO_ERROR = 5e-4
"""Of the largest current among the data: what a cycler's zero is uncertain by, 0.1 % of its range being usual. Of a
C/20 current that is several per cent."""
NOTED_ZERO = 0.02
"""Of a record's typical current."""


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
    {"offset_a": Parameter(0.0, "A", (-1.0, 1.0), "a cycler's data sheet", neutral=0.0, linear=True)},
    on_record=_corrected,
)


@dataclass(frozen=True, eq=False)
class ZeroProblem(Problem):
    """A case in which each record's current has a zero of its own.

    current_sd_a : what a zero is uncertain by.
    """

    current_sd_a: float = 0.0

    def knobs(self, hypothesis: Hypothesis) -> list[Knob]:
        """As of any problem, and a zero of the current a record."""
        declared = ZERO.parameters["offset_a"]
        zeros = [
            tolerated_knob(ZERO.id, str(i), declared, self.current_sd_a) for i in range(len(self.records))
        ]
        return [*zeros, *super().knobs(hypothesis)]

    def predict(self, knobs: Sequence[Knob], x: Array) -> list[Array] | None:
        """As of any problem, each record by its own zero."""
        n = len(self.records)
        out = []
        for i, record in enumerate(self.records):
            offset = knobs[i].to_value(float(x[i]))
            alone = replace(self, records=(record,), fixed=(*self.fixed, ZERO.activate(offset_a=offset)))
            own_state = replace(knobs[n + i], name="0")
            seen = Problem.predict(alone, [own_state, *knobs[2 * n :]], x[np.r_[n + i, 2 * n : len(x)]])
            if seen is None:
                return None
            out += seen
        return out


def zeros_noted(records: Sequence[Record], offsets_a: Mapping[str, float]) -> tuple[str, ...]:
    """A sentence for each record whose cycler's zero moves much of its charge."""
    sentences = []
    for i, record in enumerate(records):
        current = record.data.current_a
        zero = offsets_a[str(i)]
        share = zero / float(np.median(np.abs(current[flowing(current)])))
        if abs(share) > NOTED_ZERO:
            sentences.append(
                f"{record.name}: its charge fits if its current reads {1e3 * abs(zero):.2g} mA too "
                f"{'high' if zero > 0 else 'low'} ({100 * abs(share):.1f} % of it); that is taken out."
            )
    return tuple(sentences)
