"""Rows that contradict their neighbours: a single value that jumps and returns (a leap), or a voltage that jumps and
stays (a jump).

The change of voltage that a current explains is a multiple of (its change over the adjacent rows) x (the resistance at
steps of the current in the whole record): the response is larger near empty, and loggers write current and voltage a
row apart. The figures are from 137 measured and virtual records of 5 cells, -20 to 40 degC, at 0.1 to 300 s a row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from aesi.data.channels.checks import Columns, Context, scatter
from aesi.data.channels.implausible.responses import ENOUGH_STEPS, STEP_SHARE
from aesi.numerics.typing import Array, BoolArray, IntArray

EXPLAINED = 5.0
"""Largest response of the voltage, in multiples of that to steps elsewhere; near empty in the cold it reaches 8."""
ONE_WAY = 2.0
"""As EXPLAINED, for a current that does not return and so hardly explains a voltage that does."""
ROWS_BESIDE = 2
"""Number of rows on either side of a row whose currents may explain its voltage."""
LEAP_V = 0.1
"""Smallest leap of the voltage for one row beyond the explained change: at most 0.013 V in those records."""
SLIDES = 2.0
"""Largest ratio of successive steps of a sliding voltage: at a knee in rows of 60 s it falls by 0.21 V, then by 0.35,
and rises by 0.68 as the load ends (a virtual LFP cell)."""
UNANSWERED_V = 0.02
"""Smallest (leap of the current x resistance) beyond EXPLAINED times the measured response: at most 0.0015 V there."""
LIKE = 0.5
"""Smallest ratio of the two steps of a leap of the current, the smaller over the larger."""
RESOLUTIONS = 3.0
"""Multiple of the voltage's smallest change below which a change may be lost in its resolution."""
JUMP_V, JUMP_S = 0.8, 60.0
"""Smallest jump of the voltage between two rows at most JUMP_S apart, beyond the explained change: at most 0.44 V where
the steps show a resistance."""
BARE_JUMP_V, BARE_EXPLAINED = 0.35, 20.0
"""As JUMP_V and EXPLAINED, where the current hardly changes: at most 0.16 V, within the first 0.1 s of a load."""
STILL_JUMP_V, NOISES = 0.04, 10.0
"""As JUMP_V, where the current is constant over ROWS_BESIDE rows on either side, within STILL_SHARE of its largest:
beyond STEPS_BESIDE times the adjacent steps and NOISES standard deviations of the noise. At most 0.005 V in 128
records."""
STILL_SHARE, STEPS_BESIDE = 0.002, 3.0


@dataclass(frozen=True, eq=False)
class Glitches:
    """Row numbers, from 0.  voltage, current : rows where it leaps.  jumps : rows to which the voltage jumps."""

    voltage: IntArray
    current: IntArray
    jumps: IntArray

    @property
    def leaps(self) -> IntArray:
        """Rows where the voltage or the current leaps."""
        return np.union1d(self.voltage, self.current)


def glitches(columns: Columns) -> Glitches:
    """The rows of a record that contradict their neighbours."""
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
    # Jumps are looked for without the rows where the voltage leaps: the two steps of a leap are no jumps.
    answer = 0.5 * np.abs(voltage[:-2] - 2.0 * voltage[1:-1] + voltage[2:])
    answered = maximum_filter1d(answer, 3, mode="nearest")
    leaping = ohm * _leap(current) > UNANSWERED_V + lost + EXPLAINED * answered
    kept = np.delete(np.arange(len(time)), rows)
    jumps = kept[_jumps(time[kept], current[kept], voltage[kept], ohm, lost) + 1]
    return Glitches(rows, np.flatnonzero(leaping) + 1, jumps)


def glitch_doubts(found: Glitches, columns: Columns, context: Context) -> list[str]:
    """A note on each kind of glitch, naming the first one."""
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
    """Resistance, ohm, >= 0: median over the clear steps of the current, which a few bad rows do not change; None for
    fewer than ENOUGH_STEPS."""
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
    """Rows where the voltage leaps; where the steps show no resistance, only those with a constant current."""
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
    """Rows after which the voltage jumps."""
    padded = np.pad(current, 1, mode="edge")
    low, high = np.minimum(padded[:-1], padded[1:]), np.maximum(padded[:-1], padded[1:])  # of row k - 1 and k
    fall, rise = np.maximum(high[:-2] - low[2:], 0.0), np.maximum(high[2:] - low[:-2], 0.0)
    moved = np.diff(voltage)
    explained = ohm * np.where(moved > 0, fall, rise)
    size = np.abs(moved) - lost_v
    far = (size > JUMP_V + EXPLAINED * explained) | (size > BARE_JUMP_V + BARE_EXPLAINED * explained)
    far |= _still(current) & (size > STILL_JUMP_V + NOISES * scatter(voltage) + STEPS_BESIDE * _beside(moved))
    return np.flatnonzero(far & (np.diff(time) <= JUMP_S))


def _still(current: Array) -> BoolArray:
    """(n - 1,) True for intervals in and around which, ROWS_BESIDE rows on either side, the current is constant."""
    steps = maximum_filter1d(np.abs(np.diff(current)), 2 * ROWS_BESIDE + 1, mode="nearest")
    return np.asarray(steps <= STILL_SHARE * float(np.max(np.abs(current))))


def _beside(steps: Array) -> Array:
    """(n,) the larger of the magnitudes of the previous and the next step; infinite for the first and the last."""
    size = np.abs(steps)
    return np.maximum(np.append(np.inf, size[:-1]), np.append(size[1:], np.inf))


def _there_and_back(current: Array) -> Array:
    """(n,) A, largest change of the current that is taken back within ROWS_BESIDE rows on either side of each row."""
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
    """(n - 2,) distance of each inner value to the nearer of its two neighbours, where both are on the same side; else
    0.

    slides : multiple of the adjacent steps in the same direction that is subtracted as a slide.
    """
    steps = np.diff(values)
    there, back = steps[:-1], -steps[1:]
    way = np.sign(there)
    before, after = np.append(0.0, steps[:-2]), np.append(-steps[2:], 0.0)
    far = [np.abs(step) - slides * np.maximum(way * on, 0.0) for step, on in ((there, before), (back, after))]
    return np.where(there * back > 0, np.maximum(np.minimum(*far), 0.0), 0.0)
