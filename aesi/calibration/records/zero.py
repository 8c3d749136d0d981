"""The zero offset of a cycler's current (reading minus true current), which at C/20 is several per cent.

One discharge cannot distinguish it from capacity. A slow record that ends about as full as it began can: a cell returns
all but a thousandth of its charge, so that the excess of a discharge over the charge after it comes from the zero
offset,

    zero = (q + Q (s_end - s_start)) / t,     q = integral of I dt over the record, I > 0 on discharge           (1)

t the time in which a current flows (the relay is open at rest), Q the capacity, s the states of charge at both ends by
their rest voltages: a charge that stopped at the upper cut-off voltage is less full than one that was held there. The
potentials of another cell tell their difference roughly, so each end is uncertain by half its distance from full, too.
The C/20 cycles of an LG 18650HG2 at 25, 40 and 0 degC say -5.0, -4.5 and -3.6 mA, that of a Panasonic NCR18650PF
9.2 mA: they took 18.3, 17.7, 17.1 and 20.7 h to empty, 20.0, 19.3, 18.3 and 18.0 h to fill.

The drives of both cells have it, too: of the currents within 30 mA of none, the one that is read most often is -5.1 mA
in 24 of 29 records of the HG2 and 9.8 or 10.6 mA in all 21 of the Panasonic that regenerate. In a drive of three hours
that is 1 % of the charge, and it is left in: taken out of all records of both cells before a fit, with -4.9 and 9.8 mA,
it moved the median error of 38 records that chose nothing by 1 mV at most in chambers of 0 to 40 degC, to either side,
and in colder ones by -18 to 5, as descents end elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.calibration.start import LONG_CHARGE, charge_by_row_ah
from aesi.constants import MILLI, SECONDS_PER_HOUR
from aesi.errors import DataError
from aesi.numerics.typing import BoolArray
from aesi.physics.cell import Cell
from aesi.physics.initial_state import initial_state
from aesi.physics.rest.open_circuit import GOOD_READING_V
from aesi.records import Measurement

SLOW_C_RATE = 0.15
"""Slow records: below this rate the zero offset of a cycler's current is a notable share of it, and is fitted."""
ZERO_SHARE = 5e-4
"""Standard deviation of a cycler's zero where no cycle determines it, as a share of the largest current among the
records; 0.1 % of a cycler's range is usual."""


REST_SHARE = 0.05
"""Share of the usual current of a slow record, at or below which half of its charge flows, below which the cell rests:
the noise of a cycler is of its range, and not of the current that it gives. In six C/20 records of four cells rests
read 0, where there are any, and the least that flows is 32 % of the usual current, but for one first row of half a step
(0.4 %)."""


@dataclass(frozen=True)
class Zero:
    """Zero offset of a cycler's current: mean and standard deviation, A, the same for all slow records.

    sentences : on the cycles that determine it, and on those that do not, with the reason.
    """

    mean_a: float
    sd_a: float
    sentences: tuple[str, ...] = ()

    def at(self, z: float) -> float:
        """The zero, A, at a working coordinate."""
        return self.mean_a + self.sd_a * z

    @property
    def z_at_zero(self) -> float:
        """The working coordinate at which currents stay as they were measured."""
        return -self.mean_a / self.sd_a

    def subtracted_from(self, record: Measurement, nominal_ah: float) -> Measurement:
        """A slow record with the mean subtracted from its current; other records unchanged."""
        if not is_slow(record, nominal_ah):
            return record
        return replace(record, current_a=record.current_a - self.mean_a * steadily_flowing(record))


def is_slow(record: Measurement, nominal_ah: float) -> bool:
    """Whether 95 % of a record's rows stay within SLOW_C_RATE of its nominal capacity (Ah)."""
    return bool(np.quantile(np.abs(record.current_a), 0.95) <= SLOW_C_RATE * nominal_ah)


def steadily_flowing(data: Measurement) -> BoolArray:
    """(n,) True where a current flows in a slow record, beyond the cycler's reading at rest."""
    size = np.abs(data.current_a)
    order = np.argsort(size)
    moved_as = np.cumsum((size * np.diff(data.time_s, prepend=data.time_s[0]))[order])
    usual_a = size[order][int(np.searchsorted(moved_as, 0.5 * moved_as[-1]))]
    return np.asarray(size > REST_SHARE * usual_a)


def zero_of(cell: Cell, records: Sequence[Measurement]) -> Zero:
    """Prior of the zero offset: from the cycles of slow records, (1), else the usual one of cyclers."""
    means, sds, sentences = [], [], []
    for record in records:
        if not is_slow(record, cell.nominal_capacity_ah) or not _is_cycle(cell, record):
            continue
        offset = _cycle_offset(cell, record)
        if isinstance(offset, str):
            sentences.append(
                f"{record.name}: its charge balance does not determine the offset of its current: {offset}."
            )
            continue
        mean, sd = offset
        means.append(mean)
        sds.append(sd)
        sentences.append(
            f"{record.name}: nearly full at both ends; by its charge balance its current reads "
            f"{MILLI * abs(mean):.1f} +/- {MILLI * sd:.1f} mA too {'high' if mean > 0.0 else 'low'}."
        )
    if not means:
        typical_a = ZERO_SHARE * max(float(np.abs(r.current_a).max()) for r in records)
        return Zero(0.0, typical_a, tuple(sentences))
    weights = np.array(sds) ** -2.0
    mean_a = float(np.average(means, weights=weights))
    return Zero(mean_a, float(weights.sum() ** -0.5), tuple(sentences))


def _is_cycle(cell: Cell, data: Measurement) -> bool:
    """Whether a record takes much of a cell's charge and gives much back."""
    moved = charge_by_row_ah(data)
    each_way = min(moved[moved > 0.0].sum(), -moved[moved < 0.0].sum())
    return bool(each_way >= LONG_CHARGE * cell.capacity_ah)


def _cycle_offset(cell: Cell, data: Measurement) -> tuple[float, float] | str:
    """((1), its standard deviation), A, of a cycle; for one that does not go from full to full with a rest there, a
    clause with the reason."""
    flows = steadily_flowing(data)
    last = int(np.flatnonzero(flows)[-1])
    if data.current_a[last] > 0.0:
        return "it ends with a discharge, where the charge after it would have to end"
    if last + 1 >= len(data):
        return "it has no rest after its charge, by which to tell how full that ended"
    try:
        began, ended = (
            initial_state(cell, part, hold=data.hold_taken, potentials_v=GOOD_READING_V)
            for part in (data, data.take(slice(last + 1, None)))
        )
    except DataError as error:
        return f"an end of it cannot be read ({str(error).rstrip('.')})"
    for state, which in ((began, "begins"), (ended, "ends")):
        if state.by_voltage is None:
            return (
                f"it {which} at a state of charge of {state.soc:.2f}, and has to be nearly full at both ends"
            )
    assert began.by_voltage is not None
    assert ended.by_voltage is not None
    flowed_h = float(np.diff(data.time_s, prepend=data.time_s[0])[flows].sum()) / SECONDS_PER_HOUR
    sd_ah = cell.capacity_ah * float(np.hypot(began.sd, ended.sd))
    gained_ah = cell.capacity_ah * (ended.by_voltage - began.by_voltage)
    return (float(charge_by_row_ah(data).sum()) + gained_ah) / flowed_h, sd_ah / flowed_h
