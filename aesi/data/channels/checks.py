"""Checks of a measurement. Nothing is repaired: each passes, or raises a DataError naming file, column and first row.

The limits are those of one lithium cell, wide enough for anything sold: 0 to 6 V, -60 to 150 degC. Gaps are checked in
`aesi.data.channels.gaps`, and units and signs, which need several columns, in `aesi.data.channels.implausible`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from aesi.constants import COLDEST_DEGC, SECONDS_PER_HOUR, WARMEST_DEGC
from aesi.errors import DataError
from aesi.numerics.typing import Array, BoolArray
from aesi.records.checked import check_plain_volts

HIGHEST_VOLTAGE_V = 6.0
"""No lithium cell reaches it, and two in series exceed it."""
LOWEST_TYPICAL_V = 0.5
"""Lowest median voltage of one cell: lithium titanate cells rest at 2 V, and no cell below 1 V is sold."""
HIGHEST_CURRENT_A = 20_000.0
"""More than any single cell takes; a smaller current in mA is found by `check_scale`."""
ENOUGH_ROWS = 10
"""Number of rows from which a voltage that never changes counts as not measured."""
ROUNDED_SHARE = 0.2
"""Share of rows above which the time counts as rounded: rows with the stamp of the row before but other values. Cyclers
write the end of a step and the start of the next with one stamp: at most 0.4 % of the rows in 212 of their files."""
CLOCK_JUMPS_S = (SECONDS_PER_HOUR, 24 * SECONDS_PER_HOUR)
"""Steps by which a time of day runs back: at the end of daylight saving time, and at midnight."""
FEW_TURNS = 0.05
"""Largest share of intervals that run back, or at which rows in the order of their time were apart in the file, in a
file of ordered pieces. Where the rows themselves are unordered it is about half of them. A convention: pieces of twenty
rows and more."""
MOST_RELAXED_V = 0.5
"""No cell's voltage changes by more than this without a current: relaxation after a load is about 0.3 V at most."""


@dataclass(frozen=True)
class Context:
    """Names for messages.

    file : file name.  header : quantity -> column name in the file.  where : row index -> its place in the file.
    unit : quantity -> unit in which its column was read; SI where absent.
    """

    file: str
    header: Mapping[str, str]
    where: Callable[[int], str]
    unit: Mapping[str, str] = field(default_factory=dict)

    def at(self, quantity: str, row: int) -> str:
        """'drive.csv, row 5 (line 6), column voltage_v'."""
        name = self.header.get(quantity, quantity)  # a stated temperature has no column
        column = quantity if name == quantity else f"{quantity} ({name!r})"
        return f"{self.file}, {self.where(row)}, column {column}"


Columns = dict[str, Array]

OF_MEDIAN = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


def scatter(column: Array) -> float:
    """Standard deviation of the noise of a voltage or a current (n,), n > 2, in its unit, from its second differences:
    they are noise alone where the column is smooth or runs in steps, so this overestimates where it moves."""
    return float(np.median(np.abs(np.diff(column, 2)))) * OF_MEDIAN / np.sqrt(6.0)


def check_finite(columns: Columns, context: Context) -> None:
    """Refuse an empty cell, NaN or infinity in any column in use, naming the first such row."""
    faults = {q: int(np.argmin(np.isfinite(v))) for q, v in columns.items() if not np.all(np.isfinite(v))}
    if not faults:
        return
    quantity = min(faults, key=lambda q: faults[q])
    row = faults[quantity]
    what = "is empty or NaN" if np.isnan(columns[quantity][row]) else "is infinite"
    also = " or leave the column out (--column temperature_degc=)" if quantity == "temperature_degc" else ""
    rows = len(columns[quantity])
    count = int(np.sum(~np.isfinite(columns[quantity])))
    mend = f"remove or correct these rows{_beside_one_hole(columns, quantity, row)}"
    if quantity == "temperature_degc" and rows / 2 < count < rows:  # without them little would be left
        mend = "where its sensor was read less often than the others, interpolate it to all rows,"
    raise DataError(f"{context.at(quantity, row)} {what} (cells like it: {count}): {mend}{also}.")


def _beside_one_hole(columns: Columns, quantity: str, row: int) -> str:
    """How to read one side of several cells in succession that are the only ones without a number: removed, they may
    leave a gap."""
    bad, time = ~np.isfinite(columns[quantity]), columns["time_s"]
    end = row + int(np.sum(bad))
    if end == row + 1 or not np.all(bad[row:end]) or not np.all(np.isfinite(time)):
        return ""
    sides = [f"--to-s {time[row - 1]:.10g}"] if row > 0 else []
    sides += [f"--from-s {time[end]:.10g}"] if end < len(time) else []
    return f", or read one side of them: {' or '.join(sides)}" if sides else ""


def check_time(time_s: Array, context: Context) -> None:
    """Refuse a time that does not increase from row to row."""
    step = np.diff(time_s)
    if np.all(step > 0):
        return
    row = int(np.argmax(step <= 0)) + 1
    before, here = float(time_s[row - 1]), float(time_s[row])
    if here == before:
        count = int(np.sum(step == 0))
        raise DataError(
            f"{context.at('time_s', row)}: the stamp {here:.10g} s is there twice (rows like it: {count}): "
            "keep one row of each, or choose: --duplicates first, or last."
        )
    raise DataError(
        f"{context.at('time_s', row)}: time runs back from {before:.10g} s to {here:.10g} s"
        f"{_disorder_clause(time_s, step)}"
    )


def check_resolution(columns: Columns, context: Context) -> None:
    """Refuse a time rounded so that several rows share each stamp; one row of each would lose measured data."""
    time_s = columns["time_s"]
    same = np.diff(time_s) == 0
    others = [np.diff(column) != 0 for name, column in columns.items() if name in ("current_a", "voltage_v")]
    several = same & np.any(others, axis=0)
    if int(np.sum(several)) <= ROUNDED_SHARE * len(time_s):
        return
    row, (stamps, rows) = int(np.argmax(several)) + 1, np.unique(time_s, return_counts=True)
    if len(stamps) == 1:
        raise DataError(
            f"{context.at('time_s', row)}: the time is {stamps[0]:.10g} s in all {len(time_s):,} rows, so that it is "
            "that of no test; name another column: --column time_s=NAME."
        )
    mixed = (
        f" Or the file holds {rows[0]} cells or channels, a row of each at every stamp: give each a file of its own."
        if np.all(rows == rows[0])
        else ""
    )
    raise DataError(
        f"{context.at('time_s', row)}: {np.mean(several):.0%} of the rows have the stamp of the row before and another "
        "current or voltage: the time was written too coarsely for the rate of the rows, with stamps "
        f"{np.median(np.diff(stamps)):.4g} s apart; export it with its decimals, or the whole date and time.{mixed} "
        "(--duplicates first would keep one row of each and drop the rest.)"
    )


def _disorder_clause(time_s: Array, step: Array) -> str:
    """The end of a message, with its leading punctuation: why the time runs back, and what to do about it.

    step : (n - 1,) s, intervals of `time_s` (n,) s.
    """
    first = time_s[1:][step < 0]
    back = -float(np.min(step))
    anew = abs(
        float(first[0]) - float(time_s[0])
    )  # a second test starts at the same time as the first, whatever its length
    if len(first) == 1 and any(abs(back - jump) < 0.01 * jump < anew for jump in CLOCK_JUMPS_S):
        return (
            "; it is a clock that was put back, or that starts anew at midnight: give the time since the start of the "
            "test, or split the file there."
        )
    if len(first) == 1 and step[-1] < 0:
        return "; it is the last row alone, as a line of sums or means below a table is: remove it."
    if _fits_when_sorted(time_s):
        return (
            ": blocks of rows are out of order, since by their time all rows follow one another as elsewhere in the "
            "file; sort the rows by it."
        )
    if len(first) == 1:
        again = ", and starts again there, as that of a second test does"
        return (
            f"{again if anew <= np.median(np.abs(step)) else ''}; one file should hold one continuous test: split it "
            "there."
        )
    if np.all(first <= np.min(time_s) + np.median(np.abs(step))):
        return (
            f", and begins anew {len(first)} times, as the time of a step does: name the column of the whole test's "
            "time, --column time_s=NAME, or read one step alone, --step NUMBER."
        )
    if len(first) <= FEW_TURNS * len(step):
        return (
            f", and {len(first)} times in all, with rows in order between: pieces with clocks of their own, as a "
            "logger writes that starts its time again with each step. Sorting would mix them: export the time of the "
            "whole test, or put them one after the other, or split the file into its tests."
        )
    return f", and {len(first)} times in all: sort the rows by their time, or split the file into its tests."


def _fits_when_sorted(time_s: Array) -> bool:
    """Whether the rows (n,) s are blocks of one test in another order: put in order, they are no closer and no further
    apart where two blocks meet than within one. Tests with clocks of their own leave a gap, or mix row by row."""
    order = np.argsort(time_s, kind="stable")
    interval = np.diff(time_s[order])
    meets = np.diff(order) != 1
    if meets.all() or np.sum(meets) > FEW_TURNS * len(meets):
        return False
    within, round_off = interval[~meets], 2.0 * np.spacing(np.max(np.abs(time_s)))
    least, most = np.min(within) - round_off, np.max(within) + round_off
    return bool(np.all((interval[meets] >= least) & (interval[meets] <= most)))


def check_ranges(columns: Columns, context: Context) -> None:
    """Refuse voltages, currents and temperatures that one cell cannot have in V, A and degC."""
    voltage, current = columns["voltage_v"], columns["current_a"]
    typical = float(np.median(voltage))
    check_plain_volts(voltage, partial(context.at, "voltage_v"))
    bad: BoolArray = (voltage <= 0) | (voltage > HIGHEST_VOLTAGE_V)
    if np.any(bad):
        row = int(np.argmax(bad))
        lone = "" if 2 * np.sum(bad) > len(bad) else "remove or correct these rows, or "
        in_series = "" if lone else ", and divide a voltage of cells in series by their number"
        raise DataError(
            f"{context.at('voltage_v', row)}: {voltage[row]:.6g} V is not the voltage of one cell (above 0 and at "
            f"most {HIGHEST_VOLTAGE_V:g} V; rows like it: {int(np.sum(bad))}): {lone}check the column and its unit"
            f"{in_series}{_leave_out_clause(columns['time_s'], bad)}."
        )
    if typical < LOWEST_TYPICAL_V:
        taken = context.unit.get("voltage_v", "V")
        unit = "" if taken == "V" else f", taken in {taken} as declared or as its header says"
        raise DataError(
            f"{context.at('voltage_v', 0)}: the voltage is {typical:.4g} V in the median{unit}, which is that of no "
            "cell: check its unit, and whether a sign between thousands was read as a decimal one."
        )
    large = np.abs(current) > HIGHEST_CURRENT_A
    if np.any(large):
        row = int(np.argmax(large))
        raise DataError(
            f"{context.at('current_a', row)}: {current[row]:.6g} A is beyond any cell; "
            "check the row, give it in A, or declare the unit: --unit current_a=mA."
        )
    if "temperature_degc" in columns:
        _check_temperature(columns["temperature_degc"], context)


def _check_temperature(temperature_degc: Array, context: Context) -> None:
    absurd = (temperature_degc < COLDEST_DEGC) | (temperature_degc > WARMEST_DEGC)
    if not np.any(absurd):
        return
    row = int(np.argmax(absurd))
    warm = temperature_degc[row] > WARMEST_DEGC and context.unit.get("temperature_degc") != "K"
    kelvin = " (in kelvin? --unit temperature_degc=K)" if warm else ""
    stated = "temperature_degc" not in context.header
    place = f"{context.file}: stated for every row" if stated else context.at("temperature_degc", row)
    mend = "state another" if stated else "correct the column"
    raise DataError(
        f"{place}: {temperature_degc[row]:.6g} degC is outside {COLDEST_DEGC:g} to {WARMEST_DEGC:g} degC{kelvin}; "
        f"{mend} or leave it out: --column temperature_degc=."
    )


def _leave_out_clause(time_s: Array, bad: BoolArray) -> str:
    """The end of a message, from ', ' on: options that leave out bad rows at the beginning or end, where the cell was
    not connected; '' where bad rows are elsewhere too."""
    good = np.flatnonzero(~bad)
    if good.size < 2 or bad[good[0] : good[-1]].any():
        return ""
    ends = [f"--from-s {time_s[good[0]]:.10g}"] * bool(bad[0]) + [f"--to-s {time_s[good[-1]]:.10g}"] * bool(
        bad[-1]
    )
    return f", or leave out where the cell was not connected: {' '.join(ends)}"


def check_constant(columns: Columns, context: Context) -> None:
    """Refuse a current of 0 A under a moving voltage, and a constant voltage under a moving current."""
    voltage, current = columns["voltage_v"], columns["current_a"]
    if not current.any() and np.ptp(voltage) > MOST_RELAXED_V:
        raise DataError(
            f"{context.at('current_a', 0)}: the current is 0 A in all {len(current)} rows while the voltage moves by "
            f"{np.ptp(voltage):.2f} V; check the sensor or the column."
        )
    if np.ptp(voltage) == 0 and len(voltage) >= ENOUGH_ROWS and np.ptp(current) > 0:
        raise DataError(
            f"{context.at('voltage_v', 0)}: the voltage is {voltage[0]:.6g} V in all {len(voltage)} rows "
            "while the current varies; check the sensor or the column."
        )
