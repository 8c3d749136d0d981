"""What a measurement must be before anyone computes with it. Nothing is repaired here:
each check passes, or raises a DataError that names file, column and first row.

The limits are those of one lithium cell, wide enough for anything sold: 0 to 6 V, -60 to 150 degC. What only the
columns together tell (a unit, a sign that was left out) is in `aesi.data.channels.implausible`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import DataError
from aesi.numerics.typing import Array, BoolArray

HIGHEST_VOLTAGE_V = 6.0
"""No lithium cell reaches it, and two in series exceed it."""
HIGHEST_PLAIN_VOLT = 1000.0
"""A typical voltage above it is one in millivolts."""
TEMPERATURE_RANGE_DEGC = (-60.0, 150.0)
"""Colder than any cell is cycled, warmer than any survives; kelvins lie above."""
HIGHEST_CURRENT_A = 20_000.0
"""Above what any single cell takes; a smaller current in mA is told by `check_scale`."""
GAP_FLOOR_S = 5.0
"""A gap is an interval longer than this, and longer than GAP_RATIO times the longest of NEIGHBOURS intervals either
side: loggers that write by change of voltage stay within that."""
GAP_RATIO = 10.0
NEIGHBOURS = 10
REST_GAP_S = SECONDS_PER_HOUR
REST_CURRENT_SHARE = 0.02
"""A gap is a rest where the current beside it is below this share of the largest and the voltage moved by less than
REST_VOLTAGE_V."""
REST_VOLTAGE_V = 0.005
STEP_SHARE = 0.05
"""A step of the current counts where it is above this share of the largest step; ENOUGH_STEPS of them have to."""
ENOUGH_STEPS = 5
CLEAR_CORRELATION = 0.5
"""Of current and voltage steps: beyond it they say which sign the current has. Voltage falls with the current, so
that measured records lie near -1."""
VOLTAGE_TREND_V = 0.05
"""A voltage that moves by less than this along the test has no trend."""
TREND_POINTS = 200
"""Strides that a record is cut into, over which noise averages out."""


@dataclass(frozen=True)
class Context:
    """Names for the sentences: the file, each quantity's column there, and where a row is."""

    file: str
    header: Mapping[str, str]
    where: Callable[[int], str]

    def at(self, quantity: str, row: int) -> str:
        """'drive.csv, row 5 (line 6), column voltage_v'."""
        name = self.header[quantity]
        column = quantity if name == quantity else f"{quantity} ({name!r})"
        return f"{self.file}, {self.where(row)}, column {column}"


Columns = dict[str, Array]


def check_finite(columns: Columns, context: Context) -> None:
    """No empty cell, NaN or infinity in any column in use; the first row at fault is named."""
    faults = {q: int(np.argmin(np.isfinite(v))) for q, v in columns.items() if not np.all(np.isfinite(v))}
    if not faults:
        return
    quantity = min(faults, key=lambda q: faults[q])
    row = faults[quantity]
    what = "is empty or NaN" if np.isnan(columns[quantity][row]) else "is infinite"
    also = " or leave the column out (--column temperature_degc=)" if quantity == "temperature_degc" else ""
    count = int(np.sum(~np.isfinite(columns[quantity])))
    raise DataError(
        f"{context.at(quantity, row)} {what} ({count} such cells): remove or correct these rows{also}."
    )


def check_time(time_s: Array, context: Context) -> None:
    """Time runs forward, and no stamp is there twice."""
    step = np.diff(time_s)
    if np.all(step > 0):
        return
    row = int(np.argmax(step <= 0)) + 1
    before, here = float(time_s[row - 1]), float(time_s[row])
    if here == before:
        count = int(np.sum(step == 0))
        raise DataError(
            f"{context.at('time_s', row)}: the stamp {here:.10g} s is there twice ({count} such rows): "
            "keep one row of each, or choose: --duplicates first, or last."
        )
    raise DataError(
        f"{context.at('time_s', row)}: time runs back from {before:.10g} s to {here:.10g} s; "
        "one file should hold one continuous test: split it there."
    )


def check_ranges(columns: Columns, context: Context) -> None:
    """Voltage, current and temperature are those of one cell, in V, A and degC."""
    voltage, current = columns["voltage_v"], columns["current_a"]
    typical = float(np.median(voltage))
    if typical > HIGHEST_PLAIN_VOLT:
        row = int(np.argmax(voltage > HIGHEST_PLAIN_VOLT))
        raise DataError(
            f"{context.at('voltage_v', row)}: {voltage[row]:.6g} V is plainly in mV; "
            "declare it: --unit voltage_v=mV."
        )
    bad: BoolArray = (voltage <= 0) | (voltage > HIGHEST_VOLTAGE_V)
    if np.any(bad):
        row = int(np.argmax(bad))
        raise DataError(
            f"{context.at('voltage_v', row)}: {voltage[row]:.6g} V is not the voltage of one cell (0 to "
            f"{HIGHEST_VOLTAGE_V:g} V; {int(np.sum(bad))} such rows): check the column and its unit."
        )
    large = np.abs(current) > HIGHEST_CURRENT_A
    if np.any(large):
        row = int(np.argmax(large))
        raise DataError(
            f"{context.at('current_a', row)}: {current[row]:.6g} A is beyond any cell; "
            "check the row, or declare the unit: --unit current_a=mA."
        )
    temperature = columns.get("temperature_degc")
    if temperature is not None:
        low, high = TEMPERATURE_RANGE_DEGC
        absurd = (temperature < low) | (temperature > high)
        if np.any(absurd):
            row = int(np.argmax(absurd))
            kelvin = " (in kelvin? --unit temperature_degc=K)" if temperature[row] > high else ""
            raise DataError(
                f"{context.at('temperature_degc', row)}: {temperature[row]:.6g} degC is outside "
                f"{low:g} to {high:g} degC{kelvin}; correct the column or leave it out: --column temperature_degc=."
            )


def check_sign(columns: Columns, context: Context, advice: str) -> None:
    """Discharge lowers the voltage: at steps of the current, or else along the test.

    advice : what the user can do about it, from '; ' on.
    """
    found = steps(columns)
    if found is not None and abs(found[1]) > CLEAR_CORRELATION:
        contradicts, evidence = found[1] > 0, "at its steps"
    else:
        trend = _trend(columns)
        contradicts, evidence = trend > CLEAR_CORRELATION, "along the test"
    if contradicts:
        row = int(np.argmax(np.abs(np.diff(columns["current_a"])))) + 1
        raise DataError(
            f"{context.at('current_a', row)}: the voltage rises with the current {evidence}, so its sign "
            f"contradicts the one declared{advice}."
        )


def check_alive(columns: Columns, context: Context) -> None:
    """The voltage answers: it is not one value throughout while the current varies."""
    voltage, current = columns["voltage_v"], columns["current_a"]
    if np.ptp(voltage) == 0 and len(voltage) >= NEIGHBOURS and np.ptp(current) > 0:
        raise DataError(
            f"{context.at('voltage_v', 0)}: the voltage is {voltage[0]:.6g} V in all {len(voltage)} rows "
            "while the current varies; check the sensor or the column."
        )


def find_gaps(columns: Columns) -> list[int]:
    """Rows k after which rows seem to be missing: an interval much longer than those around it."""
    step = np.diff(columns["time_s"])
    gaps = []
    for k in np.flatnonzero(step > GAP_FLOOR_S):
        around = np.concatenate([step[max(0, k - NEIGHBOURS) : k], step[k + 1 : k + 1 + NEIGHBOURS]])
        if len(around) and step[k] > GAP_RATIO * np.max(around):
            gaps.append(int(k))
    return gaps


def is_rest(columns: Columns, k: int) -> bool:
    """Whether the cell simply rested between rows k and k + 1, so that nothing is lost without rows there."""
    pair = slice(k, k + 2)
    current = columns["current_a"]
    small = REST_CURRENT_SHARE * float(np.max(np.abs(current)))
    return bool(
        columns["time_s"][k + 1] - columns["time_s"][k] <= REST_GAP_S
        and np.all(np.abs(current[pair]) <= small)
        and np.ptp(columns["voltage_v"][pair]) <= REST_VOLTAGE_V
    )


def gap_error(columns: Columns, k: int, context: Context) -> DataError:
    """The sentence for a gap between rows k and k + 1."""
    time = columns["time_s"]
    last, first = float(time[k]), float(time[k + 1])
    return DataError(
        f"{context.at('time_s', k + 1)}: a gap of {first - last:.6g} s after {last:.10g} s, "
        f"where rows come every {np.median(np.diff(time)):.3g} s; what the cell did there is unknown. "
        f"Split the file there, or read one side of it: --to-s {last:.10g} or --from-s {first:.10g}."
    )


def steps(columns: Columns) -> tuple[float, float] | None:
    """Slope dV/dI in ohm and its correlation over the clear steps of the current; None without enough."""
    rise = np.diff(columns["current_a"])
    answer = np.diff(columns["voltage_v"])
    clear = np.abs(rise) > STEP_SHARE * np.max(np.abs(rise), initial=0.0)
    if int(np.sum(clear)) < ENOUGH_STEPS or np.all(answer[clear] == 0):
        return None
    x, y = rise[clear], answer[clear]
    slope = float(np.sum(x * y) / np.sum(x * x))
    return slope, float(np.sum(x * y) / np.sqrt(np.sum(x * x) * np.sum(y * y)))


def _trend(columns: Columns) -> float:
    """How one-sidedly the voltage follows a held current: -1 as it must, 1 as it cannot.

    Looked at row by row and in strides of a two-hundredth, over which noise averages out. 0 without evidence.
    """
    stride = max(1, len(columns["time_s"]) // TREND_POINTS)
    both = (_following(columns, slice(None)), _following(columns, slice(None, None, stride)))
    return max(both, key=abs)


def _following(columns: Columns, rows: slice) -> float:
    """Steps and rests do not count: after a pulse the voltage comes back."""
    current, voltage = columns["current_a"][rows], columns["voltage_v"][rows]
    size = STEP_SHARE * float(np.max(np.abs(current)))
    held = (np.abs(np.diff(current)) <= size) & (np.abs(current[1:]) > size)
    moved = np.diff(voltage)[held]
    along = float(np.sum(np.sign(current[1:][held]) * moved))
    if int(np.sum(held)) < NEIGHBOURS or abs(along) < VOLTAGE_TREND_V:
        return 0.0
    return along / float(np.sum(np.abs(moved)))
