"""Thinning of records for fits: the charge is kept, and pulses are resolved at any sampling rate.

Drives are averaged over centred windows. Tests of constant currents, pulses and rests, and records with uneven times,
keep rows that are dense after each step of the current and sparser with increasing time since it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol, cast

import numpy as np

from aesi.data.resample import mostly_even
from aesi.numerics.blocks import block_means
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records import Hold, Measurement

STEP_C_RATE = 0.01
"""A change of the current between rows by more than this C-rate is a step."""
STEADY_SHARE = 0.01
"""Share of rows with a step of the current below which a record is one of constant currents."""


@dataclass(frozen=True)
class Spacing:
    """Distance of the rows of a record of constant currents: about `growth` times (`first_s` + the time since the last
    step of the current), s.

    first_s : s.  growth : a share.
    """

    first_s: float
    growth: float


def current_steps(data: Measurement, capacity_ah: float) -> BoolArray:
    """(n - 1,) True where the current differs from that of the row before by more than STEP_C_RATE."""
    return np.abs(np.diff(data.current_a)) > STEP_C_RATE * capacity_ah


def _steady(data: Measurement, steps: BoolArray) -> bool:
    """True for a record of constant currents or of uneven times; False for a drive."""
    return not mostly_even(data.time_s) or float(np.mean(steps)) < STEADY_SHARE


class Averages(Protocol):
    """A rule that averages the n rows of a finer record to m rows."""

    @property
    def hold(self) -> Hold:
        """How the current of the finer record runs between its rows."""

    def averages(self, column: Array) -> Array:
        """(m,) averages of a column (n,)."""

    def record(self, time_s: Array, current_a: Array) -> tuple[Array, Array]:
        """(time (m,) s, current (m,) A) of a finer time and current (n,)."""


@dataclass(frozen=True)
class Window:
    """Centred averages over `factor` rows, one every `factor` rows, within each stretch of a record. The first row of a
    stretch is kept, and its last row where another stretch follows.

    ends : row at which each stretch ends; stretches of at most `factor` rows are kept unchanged.  hold : how the
    current runs between the rows of the record, also from one stretch to the next.
    """

    factor: int
    ends: tuple[int, ...]
    hold: Hold

    def averages(self, column: Array) -> Array:
        """(m,) averages of a column (n,)."""
        weights = np.ones(2 * self._half + 1)
        weights[[0, -1]] = 0.5 if self.factor % 2 == 0 else 1.0

        def averaged(stretch: Array) -> Array:
            around = np.lib.stride_tricks.sliding_window_view(stretch, len(weights))[:: self.factor]
            return np.asarray(around @ (weights / weights.sum()))

        return np.concatenate(self._by_stretch(column, averaged))

    def record(self, time_s: Array, current_a: Array) -> tuple[Array, Array]:
        """(time (m,) s, current (m,) A) of a finer time and current (n,); linear between rows, with the charge kept
        from stretch to stretch."""
        times = self._by_stretch(time_s, lambda stretch: stretch[self._centres(stretch)])
        current = self.averages(current_a)
        if self.hold == "backward":
            last = np.cumsum([len(time) for time in times[:-1]], dtype=int) - 1
            current[last] = current[last + 1]
        return np.concatenate(times), current

    def _by_stretch(self, column: Array, within: Callable[[Array], Array]) -> list[Array]:
        out = []
        for begin, end in zip((0, *self.ends[:-1]), self.ends, strict=True):
            stretch = column[begin:end]
            if len(stretch) > self.factor:
                last = stretch[-1:] if end < len(column) else stretch[:0]
                stretch = np.concatenate([stretch[:1], within(stretch), last])
            out.append(stretch)
        return out

    @property
    def _half(self) -> int:
        return self.factor // 2

    def _centres(self, stretch: Array) -> IntArray:
        return np.arange(self._half, len(stretch) - self._half, self.factor)


@dataclass(frozen=True, eq=False)
class Runs:
    """Averages over successive rows.

    rows : (m,) number of rows in each average.  hold : how the current runs between the rows, before and after.
    """

    rows: Array
    hold: Hold

    def averages(self, column: Array) -> Array:
        """(m,) averages of a column (n,)."""
        return means_of_rows(column, self.rows)

    def record(self, time_s: Array, current_a: Array) -> tuple[Array, Array]:
        """(time (m,) s, current (m,) A) of a finer time and current (n,); the charge of a current with hold "backward"
        is kept."""
        time = self.averages(time_s)
        return time, _held(time_s, current_a, time) if self.hold == "backward" else self.averages(current_a)


@dataclass(frozen=True, eq=False)
class Averaged(Measurement):
    """A record whose rows are averages of rows of a finer record.

    finer : the finer record.  window : the averaging rule.  rows : indices of these rows among all averages.
    """

    finer: Measurement = field(kw_only=True)
    window: Averages = field(kw_only=True)
    rows: IntArray = field(kw_only=True)

    def take(self, rows: slice | Array) -> Averaged:
        """The given rows, with the same finer record."""
        return replace(cast(Averaged, super().take(rows)), rows=self.rows[rows])

    def with_record(self, time_s: Array, current_a: Array) -> Averaged:
        """This record with the averages of another time (s) and current (A) of the finer record."""
        time, current = self.window.record(time_s, current_a)
        finer = replace(self.finer, time_s=time_s, current_a=current_a)
        return replace(self, time_s=time[self.rows], current_a=current[self.rows], finer=finer)

    @cached_property
    def power_w(self) -> Array:
        """(m,) W at the terminals, positive on discharge: the averages of the products of current and voltage."""
        return self._as_current(self.finer.current_a * self.finer.voltage_v)

    def unresolved_heat_w(self, hold: Hold) -> Array:
        """(m,) W, mean over the step to each row (0 for the first) of the heat that a simulation of these rows lacks.

            -(mean(I V) - mean(I) mean(V))        I > 0 on discharge

        Within a row current and voltage swing against each other, so that more heat is released than by their averages.
        Straight lines between the rows (`hold`) lose more, since they swing less than the rows; so do, less, those of
        the finer record.
        """
        finer, current, voltage = self.finer, self.current_a, self._as_current(self.finer.voltage_v)
        lost = current * voltage - self.power_w
        if hold == "linear":
            lost[1:] = 0.5 * (lost[1:] + lost[:-1])
            lost_j = _lost_by_lines_j(self.time_s, current, voltage)
            if self.window.hold == "linear":
                lost_j -= np.interp(
                    self.time_s,
                    finer.time_s,
                    _lost_by_lines_j(finer.time_s, finer.current_a, finer.voltage_v),
                )
            lost[1:] += np.diff(lost_j) / np.diff(self.time_s)
        lost[:1] = 0.0
        return lost

    def _as_current(self, column: Array) -> Array:
        """(m,) averages of a column (n,) over the times that the current of these rows is averaged over."""
        return self.window.record(self.finer.time_s, column)[1][self.rows]


def averaged_over(data: Measurement, step_s: float) -> Measurement:
    """About one row in `step_s`: centred averages of current, voltage and temperature over step_s / (median interval)
    rows, rounded. No average spans an interval longer than its window, where rows are missing.

    A record is returned unchanged where that is fewer than two rows, or where it is no longer than one window.
    """
    if len(data) < 2:
        return data
    steps = np.diff(data.time_s)
    typical = float(np.median(steps))
    factor = round(step_s / typical)
    if factor < 2 or len(data) <= factor:
        return data
    missing = np.flatnonzero(steps > factor * typical) + 1
    return _averaged(data, Window(factor, (*missing.tolist(), len(data)), data.hold_taken))


def condensed(
    data: Measurement, capacity_ah: float, longest_s: float, spacing: Spacing, hold: Hold = "backward"
) -> tuple[Measurement, Array] | None:
    """A record of constant currents and rests with few rows where little changes, and the number of original rows in
    each. None for a drive, which `averaged_over` thins.

    capacity_ah : converts STEP_C_RATE to A.  longest_s : longest time that a row may cover.  hold : how the current
    runs between the rows, before and after.
    Rows are dense after a step of the current and sparser with increasing time since it, so pulses are resolved at any
    sampling rate. Voltage, temperature and time are averages over the original rows. So is a current that is linear
    between rows, since rows at a step are kept; a current held since the row before ("backward") is the one that moves
    the charge of the record.
    """
    steps = current_steps(data, capacity_ah)
    if not _steady(data, steps):
        return None
    starts = np.flatnonzero(_begins_a_run(data.time_s, np.insert(steps, 0, True), longest_s, spacing))
    rows = np.diff(np.append(starts, len(data))).astype(float)
    if len(starts) == len(data):
        return data, rows
    return _averaged(data, Runs(rows, hold)), rows


def _begins_a_run(time_s: Array, new_current: BoolArray, longest_s: float, spacing: Spacing) -> BoolArray:
    """(n,) True for the rows with which an average of `condensed` begins.

    new_current : (n,) True for the first row of each current.
    """
    began = np.maximum.accumulate(np.where(new_current, np.arange(len(time_s)), 0))
    since_s = time_s - time_s[np.maximum(began - 1, 0)]
    begins: BoolArray = new_current | np.insert(np.diff(_slot(since_s, longest_s, spacing)) != 0.0, 0, True)
    begins[[1, -1]] = True
    # The first and the last row of each current are kept unaveraged, so that the steps between them are exact.
    begins[1:] |= new_current[:-1]
    begins[:-1] |= new_current[1:]
    return begins


def _slot(since_s: Array, longest_s: float, spacing: Spacing) -> Array:
    """(n,) number of the slot that a time since a step of the current lies in: slots grow as `spacing` says, and are
    longest_s (s) from where they would be longer."""
    grown_s = max(longest_s / spacing.growth - spacing.first_s, 0.0)
    grown = np.log1p(np.minimum(since_s, grown_s) / spacing.first_s) / spacing.growth
    return np.asarray(np.floor(grown + np.maximum(since_s - grown_s, 0.0) / longest_s))


def _averaged(data: Measurement, window: Averages) -> Averaged:
    time, current = window.record(data.time_s, data.current_a)
    return Averaged(
        time,
        current,
        window.averages(data.voltage_v),
        None if data.temperature_degc is None else window.averages(data.temperature_degc),
        data.name,
        data.source,
        data.notes,
        data.hold,
        finer=data,
        window=window,
        rows=np.arange(len(time)),
    )


def _lost_by_lines_j(time_s: Array, current_a: Array, voltage_v: Array) -> Array:
    """(n,) J since the first row, by which the heat of a current that is linear between rows is less than that of the
    mean of its rows."""
    steps = -np.diff(current_a) * np.diff(voltage_v) * np.diff(time_s) / 6.0
    return np.concatenate([[0.0], np.cumsum(steps)])


def _held(time_s: Array, current_a: Array, at_s: Array) -> Array:
    """(m,) A at the times at_s (m,), held since the time before, with the charge of a current (n,) that was held since
    the row before."""
    charge = np.concatenate([[0.0], np.cumsum(current_a[1:] * np.diff(time_s))])
    current = np.diff(np.interp(at_s, time_s, charge)) / np.diff(at_s)
    return np.concatenate([current_a[:1], current])


def means_of_rows(column: Array, rows: Array) -> Array:
    """(m,) means of a column (n,) over successive runs of `rows` (m,) rows."""
    starts = np.concatenate([[0], np.cumsum(rows[:-1])]).astype(int)
    return block_means(column, starts)
