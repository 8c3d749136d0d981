"""Resampling to fewer or evenly spaced rows, with the charge kept and averages distinguished from samples.

A logger writes a row at the end of an interval: row k's current held over (t[k-1], t[k]]. The average of the
current over any interval then follows from the charge, which is piecewise linear in time, and the charge
between two kept stamps is exact. A current that was declared linear between rows is interpolated linearly
instead: held over the interval before its row it would come half an interval early. The voltage is interpolated
linearly between rows; its average over an interval belongs to the average current there (the ohmic drop is
linear in the current). Where rows are no denser than the new step there is nothing to average, and the voltage is
the value at the stamp.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.records import Hold, Measurement
from aesi.records.checked import check_whole_number, is_finite_number
from aesi.records.steps import TOLERANCE, after_gap

DENSE = 0.75
"""Rows closer than this share of the new step count as denser, and the voltage is averaged."""
AVERAGES, AT_STAMPS = "averaged over each interval", "interpolated between rows"
UNEVEN_SHARE = 0.01
"""Share of uneven intervals above which a record is not averaged over equal numbers of rows. A convention."""
MOST_EVEN_ROWS = 20_000_000
"""More than a fortnight at 10 Hz: a request for more rows is more likely a wrong step than intended."""


@dataclass(frozen=True, eq=False)
class BetweenStamps:
    """Averages and samples of a record at new stamps.

    time_s : (n,) s, old stamps.  stamps_s : (m,) s, new stamps, inside the old range. Value j of an average belongs
    to (stamps[j-1], stamps[j]], and value 0 to the first stamp itself.
    """

    time_s: Array
    stamps_s: Array

    def held(self, values: Array) -> Array:
        """(m,) averages of a quantity that row k held over (t[k-1], t[k]], such as a logged current."""
        area = np.concatenate([[0.0], np.cumsum(values[1:] * np.diff(self.time_s))])
        first = values[np.searchsorted(self.time_s, self.stamps_s[0])]
        return self._average(np.interp(self.stamps_s, self.time_s, area), first)

    def linear(self, values: Array) -> Array:
        """(m,) averages of a quantity that is linear between rows, such as a voltage."""
        step = np.diff(self.time_s)
        area = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * step)])
        k = np.clip(np.searchsorted(self.time_s, self.stamps_s, side="right") - 1, 0, len(step) - 1)
        since = self.stamps_s - self.time_s[k]
        slope = (values[k + 1] - values[k]) / step[k]
        at_stamps = area[k] + values[k] * since + 0.5 * slope * since**2
        return self._average(at_stamps, self.sampled(values)[0])

    def sampled(self, values: Array) -> Array:
        """(m,) values at the new stamps, interpolated linearly between rows."""
        return np.interp(self.stamps_s, self.time_s, values)

    @property
    def dense(self) -> bool:
        """True where the rows are denser than the stamps, so that there is something to average."""
        return bool(np.median(np.diff(self.time_s)) < DENSE * np.median(np.diff(self.stamps_s)))

    def as_voltage(self, values: Array) -> Array:
        """(m,) V, resampled as `to_even` does a measured voltage: `linear` of dense rows, else `sampled`. A model's
        voltage at the rows is resampled in the same way, or the two would differ even for an exact model."""
        return self.linear(values) if self.dense else self.sampled(values)

    def _average(self, area: Array, first: float) -> Array:
        return np.concatenate([[first], np.diff(area) / np.diff(self.stamps_s)])


def even_stamps(time_s: Array, dt_s: float) -> Array:
    """(m,) s, stamps dt_s apart from the first row to the end of the record."""
    count = int(np.floor((time_s[-1] - time_s[0]) / dt_s * (1 + 1e-12))) + 1
    return np.minimum(time_s[0] + dt_s * np.arange(count), time_s[-1])


def is_even(time_s: Array, dt_s: float) -> bool:
    """True where the rows are already dt_s apart."""
    return bool(np.all(np.abs(np.diff(time_s) - dt_s) <= TOLERANCE * dt_s))


def mostly_even(time_s: Array) -> bool:
    """True where at most `UNEVEN_SHARE` of the intervals differ from the median one by more than half of it."""
    gaps = np.diff(time_s)
    typical = float(np.median(gaps))
    return bool(np.mean(np.abs(gaps - typical) > 0.5 * typical) <= UNEVEN_SHARE)


def is_sparse(time_s: Array, current_a: Array, dt_s: float) -> bool:
    """True where most of the charge flows in intervals longer than dt_s, so that most of the current would be
    interpolated. Rests may have rows at any distance."""
    moved = np.abs(current_a[1:]) * np.diff(time_s)
    return bool(2.0 * moved[after_gap(time_s, dt_s)[1:]].sum() > moved.sum())


def off_rows(time_s: Array, stamps_s: Array) -> float:
    """Mean distance from each of the even stamps (m,), m >= 2, to its nearest row, in steps between stamps."""
    after = np.clip(np.searchsorted(time_s, stamps_s), 1, len(time_s) - 1)
    nearest_s = np.minimum(np.abs(time_s[after] - stamps_s), np.abs(stamps_s - time_s[after - 1]))
    return float(np.mean(nearest_s) / (stamps_s[1] - stamps_s[0]))


def to_even(measurement: Measurement, dt_s: float, hold: Hold = "backward") -> Measurement:
    """The measurement at stamps dt_s apart (s), with a note; unchanged where it already is.

    Voltage and temperature: interval averages where the rows are denser than dt_s, values at the stamps elsewhere.
    Current: interval averages for hold "backward" (the charge is kept), as the voltage for "linear". Raises DataError
    for a record without rows, and for a step that is not positive, is longer than the record, or would make more than
    20 million rows.
    """
    time = measurement.time_s
    if not len(time):
        raise DataError(f"{measurement.name} has no row to resample; give one that has.")
    length = float(time[-1] - time[0])
    if not (is_finite_number(dt_s) and dt_s > 0):
        raise DataError(
            f"{measurement.name}: a step of {dt_s!r} s is not possible; give a number of seconds above 0."
        )
    if dt_s > length:
        raise DataError(
            f"{measurement.name} lasts {length:g} s, which is less than a step of {dt_s:g} s; give a shorter step, or "
            "a longer record."
        )
    if length / dt_s > MOST_EVEN_ROWS:
        raise DataError(
            f"{measurement.name}: a step of {dt_s:g} s over {length:g} s makes more than "
            f"{MOST_EVEN_ROWS:,} rows; give a longer step."
        )
    if is_even(time, dt_s):
        return measurement
    note = f"Resampled from {len(time):,} rows to {{rows:,}} rows every {dt_s:g} s: {{how}}."
    return _resampled_to(measurement, even_stamps(time, dt_s), note, hold)


def decimate(measurement: Measurement, max_rows: int) -> Measurement:
    """At most max_rows rows: averages over runs of consecutive rows, stamped at their ends, with a note.

    Rows after the last complete run are left out, which the note states. Raises InputError where max_rows is no whole
    number, DataError where it leaves nothing.
    """
    check_whole_number(f"{measurement.name}: max_rows", max_rows, 1)
    n = len(measurement)
    if max_rows < min(n, 2):
        raise DataError(f"{measurement.name}: max_rows = {max_rows} leaves nothing; give at least 2.")
    return in_runs(measurement, run_within(n, max_rows))


def run_within(rows: int, most: int) -> int:
    """Number of rows to average over, so that `rows` become at most `most` (2 or more)."""
    return 1 if rows <= most else -(-(rows - 1) // (most - 1))


def in_runs(measurement: Measurement, run: int) -> Measurement:
    """`decimate` by the number of rows in each run; unchanged where that is one.

    The current is averaged as it is taken to run between the rows. Where even rows are joined by straight lines, so are
    the averages: current and voltage both come half a run late, and a lag between the channels shows as it did. Else
    the averages are declared as held since the row before, which keeps the charge of rests with few rows.

    On ten drives at 10 Hz (the development records of `aesi bench real` with a temperature), two of whose rows were
    averaged, the declared model with the best of six lags left 0.8 mV less to 0.8 mV more than with all rows where the
    averages were held, and 0.0 to 0.3 mV less where they were joined by straight lines.
    """
    if run == 1:
        return measurement
    n = len(measurement)
    left = (n - 1) % run
    last = "the last row, no whole run, was" if left == 1 else f"the last {left} rows, no whole run, were"
    straight = measurement.hold_taken == "linear"
    held = not (straight and mostly_even(measurement.time_s))
    note = f"Decimated from {n:,} to {{rows:,}} rows: runs of {run} rows, {{how}}"
    if held and measurement.hold != "backward":
        note += ", over which the current is constant from here on"
    note += f"; {last} left out." if left else "."
    stamps = measurement.time_s[::run]
    few = _resampled_to(measurement, stamps, note, "backward")
    if straight:
        few = replace(few, current_a=BetweenStamps(measurement.time_s, stamps).linear(measurement.current_a))
    return few.held("backward") if held else few


def _resampled_to(measurement: Measurement, stamps: Array, note: str, hold: Hold) -> Measurement:
    """The measurement at other stamps (m,), s.  note : with places for `rows` and `how`.  hold : of its current."""
    intervals = BetweenStamps(measurement.time_s, stamps)
    along, voltage = intervals.as_voltage, AVERAGES if intervals.dense else AT_STAMPS
    charge, current = (intervals.held, AVERAGES) if hold == "backward" else (along, voltage)
    temperature = measurement.temperature_degc
    how = f"current and voltage {voltage}" if current == voltage else f"current {current}, voltage {voltage}"
    note = f"{measurement.name}: {note.format(rows=len(stamps), how=how)}"
    return replace(
        measurement,
        time_s=stamps,
        current_a=charge(measurement.current_a),
        voltage_v=along(measurement.voltage_v),
        temperature_degc=None if temperature is None else along(temperature),
        notes=(*measurement.notes, note),
    )
