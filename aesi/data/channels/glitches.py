"""Rows that contradict their neighbours: one value that leaps and comes back, or a voltage that goes on elsewhere.

What the current explains is a multiple of what its steps do elsewhere in the record, over the rows beside: it answers
by more near empty, and loggers write current and voltage a row apart. The figures are of 137 measured and virtual
records of 5 cells, -20 to 40 degC, at 0.1 to 300 s a row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from aesi.data.channels.checks import Columns, Context, scatter_v
from aesi.data.channels.implausible import ENOUGH_STEPS, STEP_SHARE
from aesi.numerics.typing import Array, BoolArray, IntArray

EXPLAINED = 5.0
"""Times what the steps of the current do elsewhere, that a voltage may answer by. Near empty in the cold it does 8."""
ONE_WAY = 2.0
"""Times that, of a current that does not come back, and so hardly explains a voltage that does."""
ROWS_BESIDE = 2
"""Either side of a row, whose currents may explain its voltage."""
LEAP_V = 0.1
"""For one row, beyond what is explained: 0.013 V at most on those records."""
SLIDES = 2.0
"""Times the step to the row before, which a voltage may slide by to the next: a knee in rows of 60 s falls by 0.21 V,
then by 0.35, and rises by 0.68 as the load ends (a virtual LFP cell)."""
UNANSWERED_V = 0.02
"""Of what the leap of a current would move, beyond EXPLAINED times what the voltage does: 0.0015 V at most there."""
LIKE = 0.5
"""Share by which a step comes back in the next row, of a current that leaps."""
RESOLUTIONS = 3.0
"""Of the smallest change of the voltage, which may be lost in it."""
JUMP_V, JUMP_S = 0.8, 60.0
"""Between two rows no further apart, beyond what is explained: 0.44 V at most where the steps tell a resistance."""
BARE_JUMP_V, BARE_EXPLAINED = 0.35, 20.0
"""As JUMP_V, where the current hardly moves: 0.16 V at most, within the first 0.1 s of a load."""
STILL_JUMP_V, NOISES = 0.04, 10.0
"""As JUMP_V, where the current stands still over ROWS_BESIDE either side, within STILL_SHARE of its largest: beyond
STEPS_BESIDE times the steps before and after it, and NOISES deviations of the noise: 0.005 V at most of 128 records."""
STILL_SHARE, STEPS_BESIDE = 0.002, 3.0


@dataclass(frozen=True, eq=False)
class Glitches:
    """Rows, from 0: where the voltage or the current leaps for one row, and before which the voltage jumps."""

    voltage: IntArray
    current: IntArray
    jumps: IntArray

    @property
    def leaps(self) -> IntArray:
        """Rows of which a value is not of the cell."""
        return np.union1d(self.voltage, self.current)


def glitches(columns: Columns) -> Glitches:
    """The rows of a record that its neighbours contradict."""
    time, current, voltage = columns["time_s"], columns["current_a"], columns["voltage_v"]
    none = np.empty(0, dtype=int)
    if len(time) <= 2 * ROWS_BESIDE:
        return Glitches(none, none, none)
    ohm = _ohm(current, voltage)
    moves = np.abs(np.diff(voltage))
    lost = RESOLUTIONS * float(np.min(moves[moves > 0], initial=np.inf)) if moves.any() else 0.0
    rows = _leaping_voltage(current, voltage, ohm, lost)
    if not ohm:
        return Glitches(rows, none, none)
    # What is left is of the record as it is without a voltage that leaps, whose two steps are no jumps.
    answer = 0.5 * np.abs(voltage[:-2] - 2.0 * voltage[1:-1] + voltage[2:])
    answered = maximum_filter1d(answer, 3, mode="nearest")
    leaping = ohm * _leap(current) > UNANSWERED_V + lost + EXPLAINED * answered
    kept = np.delete(np.arange(len(time)), rows)
    jumps = kept[_jumps(time[kept], current[kept], voltage[kept], ohm, lost) + 1]
    return Glitches(rows, np.flatnonzero(leaping) + 1, jumps)


def glitch_doubts(found: Glitches, columns: Columns, context: Context) -> list[str]:
    """A sentence on each kind of glitch, at the first of them."""
    said = []
    voltage, current, time = columns["voltage_v"], columns["current_a"], columns["time_s"]
    for rows, name, values, unit, words in (
        (found.voltage, "voltage", voltage, "V", "and the current does not explain it"),
        (found.current, "current", current, "A", "and the voltage does not answer"),
    ):
        if len(rows):
            row = int(rows[0])
            said.append(
                f"Its {name} is {values[row]:.4g} {unit} at {context.where(row)} alone, {values[row - 1]:.4g} {unit} "
                f"before and {values[row + 1]:.4g} {unit} after it, {words} (rows like it: {len(rows):,}): more likely "
                "a glitch of the logger than the cell's; correct or remove these rows, which a fit and a score take "
                "as they are."
            )
    if len(found.jumps):
        row = int(found.jumps[0])
        said.append(
            f"Its voltage goes from {voltage[row - 1]:.3f} to {voltage[row]:.3f} V at {context.where(row)}, "
            f"{time[row] - time[row - 1]:.4g} s after the row before it, by more than the current there explains "
            f"(places like it: {len(found.jumps):,}): if two tests are joined there, or rows are missing, read one "
            f"side of it: --to-s {time[row - 1]:.10g} or --from-s {time[row]:.10g}."
        )
    return said


def _ohm(current: Array, voltage: Array) -> float | None:
    """By which the voltage answers to the steps of the current, in the median, which a few rows at fault do not move;
    0 where it does not, None without enough of them."""
    rise, answer = np.diff(current), np.diff(voltage)
    size = np.abs(rise)
    small, large = np.minimum(size[:-1], size[1:]), np.maximum(size[:-1], size[1:])
    back = (rise[:-1] * rise[1:] < 0) & (small > LIKE * large)
    lone = np.append(back, False) | np.insert(back, 0, False)
    largest = float(np.max(size[~lone], initial=0.0)) or float(np.max(size))
    clear = size > STEP_SHARE * largest
    if int(np.sum(clear)) < ENOUGH_STEPS:
        return None
    return max(float(np.median(-answer[clear] / rise[clear])), 0.0)


def _leaping_voltage(current: Array, voltage: Array, ohm: float | None, lost_v: float) -> IntArray:
    """Rows of a voltage that leaps; where the steps tell no resistance, beside a current that stands still."""
    beside = 2 * ROWS_BESIDE + 1
    moved = maximum_filter1d(current, beside, mode="nearest") - minimum_filter1d(
        current, beside, mode="nearest"
    )
    moved, back = moved[1:-1], _there_and_back(current)[1:-1]
    still: BoolArray = moved <= STEP_SHARE * float(np.max(np.abs(current)))
    explained = (ohm or 0.0) * np.maximum(EXPLAINED * back, ONE_WAY * moved)
    found = _leap(voltage, SLIDES) > LEAP_V + lost_v + explained
    return np.flatnonzero(found if ohm else found & still) + 1


def _jumps(time: Array, current: Array, voltage: Array, ohm: float, lost_v: float) -> IntArray:
    """Rows after which the voltage goes on elsewhere."""
    padded = np.pad(current, 1, mode="edge")
    low, high = np.minimum(padded[:-1], padded[1:]), np.maximum(padded[:-1], padded[1:])  # of two rows each
    fall, rise = np.maximum(high[:-2] - low[2:], 0.0), np.maximum(high[2:] - low[:-2], 0.0)
    moved = np.diff(voltage)
    explained = ohm * np.where(moved > 0, fall, rise)
    size = np.abs(moved) - lost_v
    far = (size > JUMP_V + EXPLAINED * explained) | (size > BARE_JUMP_V + BARE_EXPLAINED * explained)
    far |= _still(current) & (
        size > STILL_JUMP_V + NOISES * scatter_v(voltage) + STEPS_BESIDE * _beside(moved)
    )
    return np.flatnonzero(far & (np.diff(time) <= JUMP_S))


def _still(current: Array) -> BoolArray:
    """(n - 1,) between which rows the current stands still, ROWS_BESIDE either side of them included."""
    steps = maximum_filter1d(np.abs(np.diff(current)), 2 * ROWS_BESIDE + 1, mode="nearest")
    return np.asarray(steps <= STILL_SHARE * float(np.max(np.abs(current))))


def _beside(steps: Array) -> Array:
    """(n,) the larger of the steps before and after each; infinite at both ends, where one of them is not known."""
    size = np.abs(steps)
    return np.maximum(np.append(np.inf, size[:-1]), np.append(size[1:], np.inf))


def _there_and_back(current: Array) -> Array:
    """(n,) A by which the current goes one way and comes back, within ROWS_BESIDE either side of each row."""
    padded, n = np.pad(current, ROWS_BESIDE, mode="edge"), len(current)
    rows = np.stack([padded[k : k + n] for k in range(2 * ROWS_BESIDE + 1)])
    out = np.zeros(n)
    for turn in range(1, len(rows) - 1):
        for way in (1.0, -1.0):
            here = way * rows[turn]
            before, after = here - way * rows[:turn], here - way * rows[turn + 1 :]
            np.maximum(out, np.minimum(before.max(axis=0), after.max(axis=0)), out=out)
    return out


def _leap(values: Array, slides: float = 0.0) -> Array:
    """(n - 2,) how far each but the first and the last is from both its neighbours, on one side of them.

    slides : times the step before a row, and the one after it, that go the same way and are no leap.
    """
    steps = np.diff(values)
    there, back = steps[:-1], -steps[1:]
    way = np.sign(there)
    before, after = np.append(0.0, steps[:-2]), np.append(-steps[2:], 0.0)
    far = [np.abs(step) - slides * np.maximum(way * on, 0.0) for step, on in ((there, before), (back, after))]
    return np.where(there * back > 0, np.maximum(np.minimum(*far), 0.0), 0.0)
