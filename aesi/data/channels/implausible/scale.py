"""A current in mA, and a time in ms, minutes, hours or days: read as A and s, no cell is like that."""

from __future__ import annotations

import numpy as np

from aesi.constants import MILLI
from aesi.data import units
from aesi.data.channels.checks import Columns, Context
from aesi.data.channels.implausible.responses import (
    constant_stretches,
    moved_ah,
    step_resistance_ohm,
    strides_of,
)
from aesi.data.channels.stamps import longer_unit
from aesi.errors import DataError

HIGHEST_CHARGE_AH = 1_500.0
"""More charge in one direction means a current in mA: the largest cells sold hold about 1,000 Ah."""
LOWEST_RESISTANCE_OHM = 30e-6
"""A smaller resistance at steps means a current in mA: cells of 1,000 Ah have about 150 microohm."""
HIGHEST_CHARGE_RESISTANCE_OHM_AH = 10.0
"""A larger charge moved x resistance means time in ms, which makes it a thousand times too large: capacity x resistance
is 0.05 to 0.8 ohm Ah for 46 of those records."""
LEAST_CHARGE_RESISTANCE_AH_A = 3e-3
"""Least charge moved x resistance over the slide of the voltage (its range without the ohmic drop). It is 0.042 or more
for the 140 of 210 measured records that show both, and 0.0018 or more for 210 pieces of them of 5 and 10 min, two of
which are below this limit; with time in hours it is 3,600 times less."""
MOST_CHARGE_RESISTANCE_AH_A = 20.0
"""Most charge moved x resistance over the slide of the voltage (at least FLAT_V). It is 0.022 to 0.62 in the 34
measured and virtual records whose steps show a resistance, and a thousand times that with time in ms. A completely flat
potential of a cell of 0.8 ohm Ah makes 16."""
FLAT_V = 0.05
"""Slide that is assumed at least, for flat potentials."""
USUAL_RESISTANCE_OHM_AH = (0.02, 0.9)
"""Range of (resistance at steps of the current) x (capacity of the cell): 0.024 to 0.85 in those records."""
CLEAR_SLIDE_V = 0.15
"""Smallest slide that is used: range of the voltage without its ohmic drop, between its 2 % and 98 % quantiles. It is
0.22 V or more in those records."""
FASTEST_SLIDE_S = 30.0
"""No cell's voltage slides by more than SLIDE_V faster than this under a constant current: time is then in minutes or
hours. Only records of at most SHORT_RECORD_S are checked."""
SLIDE_V = 0.5
SHORT_RECORD_S = 200.0


def check_scale(columns: Columns, context: Context) -> None:
    """Refuse a current in mA and a time in ms, hours or minutes: read as A and s, no cell has such a charge, resistance
    or rate of change of the voltage."""
    time, current = columns["time_s"], columns["current_a"]
    moved = moved_ah(columns)
    resistance = step_resistance_ohm(columns)
    row = int(np.argmax(np.abs(current)))
    if resistance is not None and resistance < LOWEST_RESISTANCE_OHM:
        raise DataError(
            f"{context.at('current_a', row)}: {current[row]:.6g} A would show {resistance * 1e6:.3g} microohm at its "
            f"steps: {_unit_clause(context, 'it is plainly in mA', current_a='mA')}."
        )
    if moved > HIGHEST_CHARGE_AH:
        if resistance is not None and moved * resistance > HIGHEST_CHARGE_RESISTANCE_OHM_AH:
            raise DataError(
                f"{context.at('time_s', len(time) - 1)}: {moved:.4g} Ah would have moved, which "
                f"a cell that shows {MILLI * resistance:.3g} mohm at the steps of its current does not hold: "
                f"{_unit_clause(context, 'the time is in ms', time_s='ms')}."
            )
        if resistance is not None:
            raise DataError(
                f"{context.at('current_a', row)}: at {current[row]:.6g} A {moved:.4g} Ah would have moved: "
                f"{_unit_clause(context, 'it is plainly in mA', current_a='mA')}."
            )
        raise DataError(
            f"{context.at('current_a', row)}: at {current[row]:.6g} A {moved:.4g} Ah would have moved: "
            f"{_unit_clause(context, 'it is plainly in mA, or the time in ms', current_a='mA', time_s='ms')}."
        )
    if resistance is not None:
        _check_slide(columns, context, moved, resistance)
    _check_pace(columns, context)


def _check_slide(columns: Columns, context: Context, charge_ah: float, resistance_ohm: float) -> None:
    """Refuse a charge moved that is far too small for the slide of the voltage and the resistance of the cell, or so
    large that it would have emptied the cell many times.

    Too small is judged with the largest resistance over STRIDES. In dense rows, or where current and voltage are some
    rows apart, the resistance from row to row is only a part of it, and the rest of the drop looks like a slide.
    """
    slower = max(filter(None, (step_resistance_ohm(each) for each in strides_of(columns))))
    slide, last = _slide_v(columns, slower), len(columns["time_s"]) - 1
    if slide > CLEAR_SLIDE_V and charge_ah * slower < LEAST_CHARGE_RESISTANCE_AH_A * slide:
        raise DataError(
            f"{context.at('time_s', last)}: the voltage slides by {slide:.2f} V while {MILLI * charge_ah:.3g} mAh move "
            f"in {columns['time_s'][last] - columns['time_s'][0]:.3g} s, of a cell that shows {MILLI * slower:.3g} "
            f"mohm at the steps of its current: {_longer_unit_clause(columns, context)}."
        )
    slide = _slide_v(columns, resistance_ohm)
    if charge_ah * resistance_ohm > MOST_CHARGE_RESISTANCE_AH_A * max(slide, FLAT_V):
        raise DataError(
            f"{context.at('time_s', last)}: {charge_ah:.4g} Ah would have moved while the voltage slides by "
            f"{slide:.2f} V, of a cell that shows {MILLI * resistance_ohm:.3g} mohm at the steps of its current: "
            f"{_unit_clause(context, 'the time is in ms', time_s='ms')}."
        )


def _slide_v(columns: Columns, resistance_ohm: float) -> float:
    """Slide of the voltage, V: its range without the ohmic drop, between the 2 % and 98 % quantiles."""
    low, high = np.quantile(columns["voltage_v"] + resistance_ohm * columns["current_a"], [0.02, 0.98])
    return float(high - low)


def _check_pace(columns: Columns, context: Context) -> None:
    """Refuse a voltage of a short record that moves faster under a constant current than that of any cell."""
    time, voltage = columns["time_s"], columns["voltage_v"]
    if time[-1] - time[0] > SHORT_RECORD_S:
        return
    for rows in constant_stretches(columns):
        slide, seconds = float(np.ptp(voltage[rows])), float(np.ptp(time[rows]))
        if slide > SLIDE_V and seconds < FASTEST_SLIDE_S:
            raise DataError(
                f"{context.at('time_s', rows.start)}: the voltage moves by {slide:.2f} V in {seconds:.3g} s of one "
                f"held current, faster than any cell's: {_longer_unit_clause(columns, context)}."
            )


def _unit_clause(context: Context, claim: str, **units_of: str) -> str:
    """The end of a message on implausible numbers: `claim` and the options that declare the unit; where a column was
    not read as SI, its declared unit in place of the claim.

    units_of : quantity -> the unit that its numbers more likely have.
    """
    taken = {quantity: context.unit.get(quantity, units.SI[quantity]) for quantity in units_of}
    other = [
        f"{quantity} was taken in {unit}" for quantity, unit in taken.items() if unit != units.SI[quantity]
    ]
    if other:
        return f"{' and '.join(other)}, as declared or as its header says; check that first"
    wanted = " and ".join(units.SI[quantity] for quantity in units_of)
    options = ", or ".join(f"--unit {quantity}={unit}" for quantity, unit in units_of.items())
    return f"{claim}; give {wanted}, or declare it: {options}"


def _longer_unit_clause(columns: Columns, context: Context) -> str:
    """The end of a message on times that are too close for seconds."""
    return _unit_clause(context, "the time is in another unit", time_s=longer_unit(columns["time_s"]))
