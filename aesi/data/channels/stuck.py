"""A voltage that is constant while the current changes, or the reverse: a failed sensor, or a cycler's constant
voltage."""

from __future__ import annotations

import numpy as np

from aesi.data.channels.checks import Columns, Context, scatter
from aesi.data.channels.implausible.responses import (
    ENOUGH_STEPS,
    STEP_SHARE,
    clearest_step_response,
    step_response,
)
from aesi.errors import DataError
from aesi.numerics.typing import Array

CLEAR_RESOLUTIONS = 3.0
"""Multiple of the resolution of the voltage, and of the smallest change of the current where that is below STEP_SHARE
of the largest, below which a change may be lost in the resolution. ENOUGH_STEPS unanswered steps in each direction are
a stuck voltage. In 342 measured and virtual records, or parts of them, at most four steps in each direction are
unanswered at any multiple from 2 to 10, seven at 1. In their 96 drives, with the voltage held constant for 60 rows, 2,
3 and 5 find 34, 27 and 20 % of the cases; for 600 rows 91 %: in most of the others the cell rests."""
HOLD_V = 0.005
"""Largest distance of a voltage that a cycler holds from the highest of the charge (lowest of the discharge): at most
1.5 mV in the 84 charges of those records that end at constant voltage."""
HOLD_SHARE = 0.1
"""Largest increase of the current while a cycler holds the voltage, as a share of its largest value: 0.034 in a chamber
that varies by 3.5 K at -20 degC, but 0.19 or more in long stretches of braking whose voltage stays within 10 mV."""
TURN_V = 0.05
"""Rise and fall of the voltage for a turn to count. Under a constant current it is monotonic: in 137 records no stretch
of one value of the current has a single turn by 0.01 V. A drive whose current was set to 0 for 1000 s has 37 turns by
TURN_V."""
STILL_SHARE = 0.01
"""Range, as a share of the largest current, within which a current counts as constant, with its noise."""
FOLLOWS = 0.2
"""Correlation of the steps of current and voltage, at the clearest of three strides, below which they do not belong
together. It is 0.85 or more in 99 measured and virtual records whose voltage turns that often; with the noise of a dead
sensor as current, at most 0.04."""
UNANSWERED_SHARE = 0.2
"""Largest share of clear steps of the current at which the voltage keeps the value of the row before: at most 0.026 in
those 99 records, and 0.64 or more where every third of their voltages is held for three rows."""
FAR_ROWS = 3.0
"""Multiple of the median interval beyond which the current between two rows is not known, as where a file holds only
the rests of a test."""
SCATTERS = 6.0
"""Multiple of the noise of the current in a stretch, times the resistance, below which its steps move no voltage: 4.2
standard deviations of a noise's steps. With a noise of 0.5 % of the largest current, of 226 measured and virtual
records 97 were refused without it, 1 is with 6 and none with 10. With the voltage held for 600 rows, 306 of 390 cases
are found without it and with 6, 300 with 10; for 60 rows 83, 62 and 53 of 516."""
NOISES = 10.0
"""Multiple of the noise of the voltage that a turn has to exceed."""


def check_stuck_current(columns: Columns, context: Context) -> None:
    """Refuse a current that is constant, except for noise, over a stretch of rows in which the voltage rises and falls:
    after a load and under a constant current it is monotonic. Also refuse a current whose steps are not correlated with
    those of such a voltage: the noise of a dead sensor."""
    current, voltage, time = columns["current_a"], columns["voltage_v"], columns["time_s"]
    if len(voltage) < ENOUGH_STEPS:
        return
    least = max(TURN_V, NOISES * scatter(voltage), CLEAR_RESOLUTIONS * _resolution_v(voltage))
    within, step = STILL_SHARE * float(np.max(np.abs(current))), np.diff(time)
    goes_on = (np.abs(np.diff(current)) <= within) & (step <= FAR_ROWS * np.median(step))
    ends = np.concatenate([[-1], np.flatnonzero(~goes_on), [len(current) - 1]])
    for k in np.flatnonzero(np.diff(ends) > 2 * ENOUGH_STEPS):
        rows = slice(int(ends[k]) + 1, int(ends[k + 1]) + 1)
        turns = _turns(voltage[rows], least) if np.ptp(current[rows]) <= within else 0
        if turns >= 2 * ENOUGH_STEPS:
            raise _stands_still(columns, context, rows, turns, least)
    turns = _turns(voltage, least)
    clearest = clearest_step_response(columns) if turns >= 2 * ENOUGH_STEPS else None
    if clearest is not None and abs(clearest.correlation) < FOLLOWS:
        raise DataError(
            f"{context.at('current_a', 0)}: the voltage turns {turns} times, rising and falling by more than "
            f"{least:.2g} V, and the steps of the current ({np.min(current):.4g} to {np.max(current):.4g} A) do "
            f"not move it (their correlation is {abs(clearest.correlation):.2f}, and above 0.8 where they do); check "
            "the sensor, and whether the columns are of one test."
        )


def _stands_still(columns: Columns, context: Context, rows: slice, turns: int, least_v: float) -> DataError:
    """The error for a current that is constant while the voltage turns `turns` times by `least_v` V."""
    current, time = columns["current_a"], columns["time_s"]
    begin, end = rows.start, rows.stop - 1
    count = end - begin + 1
    sides = [f"--to-s {time[begin]:.10g}"] * (begin > 0)
    sides += [f"--from-s {time[end]:.10g}"] * (end < len(current) - 1)
    where = f"{count:,} rows, up to {time[end]:.10g} s," if sides else f"all {count:,} rows"
    aside = f", or read one side of it: {' or '.join(sides)}" if sides else ""
    if current[begin] != 0.0 and not np.min(current) < 0.0 < np.max(current):
        aside += ", or the file holds magnitudes, and another column says which way it flows (--state COLUMN)"
    low, high = float(np.min(current[rows])), float(np.max(current[rows]))
    stays = f"is {low:.6g} A" if low == high else f"stays within {low:.6g} and {high:.6g} A"
    return DataError(
        f"{context.at('current_a', begin)}: the current {stays} in {where} while the voltage turns {turns} times, "
        f"rising and falling by more than {least_v:.2g} V, which only a current makes it do; check the sensor or the "
        f"column{aside}."
    )


def _turns(voltage: Array, least_v: float) -> int:
    """Number of times that a voltage (n,) falls by `least_v` after a rise by `least_v`, or the reverse."""
    if np.ptp(voltage) < least_v:
        return 0
    turns, way, low, high = 0, 0, float(voltage[0]), float(voltage[0])
    for here in voltage.tolist():
        low, high = min(low, here), max(high, here)
        if way >= 0 and high - here >= least_v:
            turns, way, low, high = turns + (way != 0), -1, here, here
        elif way <= 0 and here - low >= least_v:
            turns, way, low, high = turns + (way != 0), 1, here, here
    return turns


def _resolution_v(voltage: Array) -> float:
    """Resolution with which a voltage (n,) was written; 0 of one that never changes.

    The smallest distance of the values at which it stands still: a record that was interpolated has others between
    them. At most the median change, since a sensor that failed twice also stands still at two values. Of 49 measured
    records interpolated to twice their rows, the smallest change as resolution had 17 refused, this none, and the same
    100 of 168 stretches of a voltage that was held constant are found.
    """
    moves = np.abs(np.diff(voltage))
    if not moves.any():
        return 0.0
    between = np.diff(np.unique(voltage[1:][moves == 0]))
    if not between.size:
        return _smallest(moves)
    return max(_smallest(moves), min(float(np.min(between)), float(np.median(moves[moves > 0]))))


def check_stuck_voltage(columns: Columns, context: Context) -> None:
    """Refuse a voltage that is constant while the current rises and falls by steps that change it elsewhere, and by
    more than its noise.

    A voltage that a cycler holds is accepted.
    """
    voltage, time = columns["voltage_v"], columns["time_s"]
    found, answer = step_response(columns), np.abs(np.diff(voltage))
    if found is None or found.slope_ohm >= 0 or not answer.any():
        return
    ohm = -found.slope_ohm
    expected = ohm * np.diff(columns["current_a"])
    sizes = np.abs(expected)
    of_current = min(CLEAR_RESOLUTIONS * _smallest(sizes), STEP_SHARE * float(np.max(sizes)))
    least = max(CLEAR_RESOLUTIONS * _resolution_v(voltage), of_current)
    ends = np.concatenate([[-1], np.flatnonzero(answer > 0), [len(answer)]])
    for k in np.flatnonzero(np.diff(ends) > 2 * ENOUGH_STEPS):
        begin, end = int(ends[k]) + 1, int(ends[k + 1])
        moves = expected[begin:end]
        of_noise = SCATTERS * ohm * scatter(columns["current_a"][begin : end + 1])
        ways = [int(np.sum(way * moves > max(least, of_noise))) for way in (1, -1)]
        if min(ways) >= ENOUGH_STEPS and not _is_hold(columns, slice(begin, end + 1)):
            raise DataError(
                f"{context.at('voltage_v', begin)}: the voltage stands still at {voltage[begin]:.6g} V for "
                f"{end - begin + 1:,} rows, up to {time[end]:.10g} s, while the current rises {ways[0]} times and "
                f"falls {ways[1]} times by what moves it elsewhere; check the sensor, or read one side of it: --to-s "
                f"{time[begin]:.10g} or --from-s {time[end]:.10g}."
            )


def held_doubts(columns: Columns) -> list[str]:
    """A note on a voltage that is written less often than the current; else empty."""
    clearest, answer = clearest_step_response(columns), np.abs(np.diff(columns["voltage_v"]))
    if clearest is None or clearest.slope_ohm >= 0 or not answer.any():
        return []
    steps = np.abs(np.diff(columns["current_a"]))
    clear = steps > STEP_SHARE * float(np.max(steps))
    clear &= -clearest.slope_ohm * steps > CLEAR_RESOLUTIONS * _smallest(answer)
    unanswered = float(np.mean(answer[clear] == 0)) if int(np.sum(clear)) >= 2 * ENOUGH_STEPS else 0.0
    if unanswered <= UNANSWERED_SHARE:
        return []
    return [
        f"Its voltage is that of the row before at {unanswered:.0%} of the steps of the current, as where it is "
        "written less often than the current: what a model leaves there is not the cell's; give the rows in which both "
        "are new."
    ]


def _smallest(moves: Array) -> float:
    """The smallest positive one of changes (n,) >= 0."""
    return float(np.min(moves[moves > 0]))


def _is_hold(columns: Columns, rows: slice) -> bool:
    """True where a cycler holds the constant voltage of these rows: a current of one direction brought the voltage to
    its extreme value, and then decreases, except by HOLD_SHARE for changes of the chamber's temperature."""
    current, voltage = columns["current_a"][: rows.stop], columns["voltage_v"]
    way = float(np.sign(current[rows.start]))
    others = np.flatnonzero(way * current <= 0)
    begin = int(others[-1]) + 1 if others.size else 0
    if begin > rows.start:
        return False
    sizes, held = way * current[begin : rows.start + 1], way * current[rows]
    came = -way * (voltage[begin : rows.start + 1] - voltage[rows.start])
    back = held - np.minimum.accumulate(held)
    return bool(np.max(came) <= HOLD_V and np.max(back) <= HOLD_SHARE * np.max(sizes))
