"""Fewer rows for fits: charge is kept, and a pulse stays a pulse at any rate of sampling.

Drives are averaged over centred windows. Tests of steady currents, pulses and rests, and records with uneven times,
keep rows that are dense after each step of the current and ever sparser with the time since it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.typing import Array, BoolArray
from aesi.records import Measurement

STEP_C_RATE = 0.01
"""A change of the current by more than this is a step."""
STEADY_SHARE = 0.01
"""Of the rows of a record: one with fewer steps is one of steady currents."""
UNEVEN_SHARE = 0.01
"""Of the rows: averages over equal numbers of rows need equal times between them."""


@dataclass(frozen=True)
class Spacing:
    """How rows of a steady record thin out: `first_s` s apart after a step of the current, and further on `growth`
    of the time since that step."""

    first_s: float
    growth: float


def current_steps(data: Measurement, capacity_ah: float) -> BoolArray:
    """(n - 1,) True where the current of a row is another than that of the row before."""
    return np.abs(np.diff(data.current_a)) > STEP_C_RATE * capacity_ah


def _steady(data: Measurement, steps: BoolArray) -> bool:
    """True for a record of steady currents, or of uneven times; False for a drive."""
    gaps = np.diff(data.time_s)
    typical = float(np.median(gaps))
    uneven = float(np.mean(np.abs(gaps - typical) > 0.5 * typical)) > UNEVEN_SHARE
    return uneven or float(np.mean(steps)) < STEADY_SHARE


def averaged_over(data: Measurement, step_s: float) -> Measurement:
    """At most one sample in `step_s`: centred averages of current, voltage and temperature.

    Records sampled more slowly than 0.75 of `step_s` on average are returned as they are.
    """
    t = data.time_s
    typical = float(np.median(np.diff(t)))
    factor = round(step_s / typical)
    if factor < 2:
        return data
    half = factor // 2
    centres = np.arange(half, len(t) - half, factor)
    width = 2 * half + 1
    weights = np.ones(width)
    weights[[0, -1]] = 0.5 if factor % 2 == 0 else 1.0
    weights /= weights.sum()

    def averaged(column: Array) -> Array:
        return np.convolve(column, weights, mode="valid")[centres - half]

    temperature = None if data.temperature_degc is None else averaged(data.temperature_degc)
    first = data.take(slice(0, 1))
    return replace(
        data,
        time_s=np.concatenate([first.time_s, t[centres]]),
        current_a=np.concatenate([first.current_a, averaged(data.current_a)]),
        voltage_v=np.concatenate([first.voltage_v, averaged(data.voltage_v)]),
        temperature_degc=None
        if temperature is None or first.temperature_degc is None
        else np.concatenate([first.temperature_degc, temperature]),
    )


def condensed(
    data: Measurement, capacity_ah: float, longest_s: float, spacing: Spacing
) -> tuple[Measurement, Array] | None:
    """A record of steady currents and rests with few rows where little happens, and how many each stands for.

    None for a drive, which `averaged_over` thins.  capacity_ah : what a step of the current is measured by.
    longest_s : the most that a row may stand for.
    Rows are dense after a step of the current and ever sparser with the time since it: a pulse stays a pulse, at any
    rate of sampling. Voltage, temperature and time are averages of the rows that one stands for; the current is what
    moves the charge of the record, as its logger held it ("backward").
    """
    steps = current_steps(data, capacity_ah)
    if not _steady(data, steps):
        return None
    t = data.time_s
    n = len(t)
    first = np.concatenate([[True], steps])
    began = np.maximum.accumulate(np.where(first, np.arange(n), 0))
    since = t - t[np.maximum(began - 1, 0)]
    even = max(longest_s / spacing.growth - spacing.first_s, 0.0)
    place = np.log1p(np.minimum(since, even) / spacing.first_s) / spacing.growth
    place = np.floor(place + np.maximum(since - even, 0.0) / longest_s)
    opens = first | np.concatenate([[True], np.diff(place) != 0.0])
    opens[[1, -1]] = True
    # The first row of a current by itself, and the last: between them the steps are exact.
    opens[1:] |= first[:-1]
    opens[:-1] |= first[1:]
    starts = np.flatnonzero(opens)
    rows = np.diff(np.append(starts, n)).astype(float)
    if len(starts) == n:
        return data, rows

    def averaged(column: Array) -> Array:
        return np.add.reduceat(column, starts) / rows

    time = averaged(t)
    charge = np.concatenate([[0.0], np.cumsum(data.current_a[1:] * np.diff(t))])
    current = np.diff(np.interp(time, t, charge)) / np.diff(time)
    thin = replace(
        data,
        time_s=time,
        current_a=np.concatenate([data.current_a[:1], current]),
        voltage_v=averaged(data.voltage_v),
        temperature_degc=None if data.temperature_degc is None else averaged(data.temperature_degc),
    )
    return thin, rows
