"""Fewer rows for the tracer: drives are averaged, steady records keep their rows after each step of the current."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.numerics.typing import Array, BoolArray
from aesi.records import Measurement

FIRST_STEP_S = 0.5
"""Distance of the first rows after a step."""
STEP_GROWTH = 0.25
"""Rows of a steady record are this share of the time since the current's last step apart, and of this much more."""


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


def condensed(data: Measurement, steps: BoolArray, longest_s: float) -> tuple[Measurement, Array]:
    """A record of steady currents and rests with few rows where little happens, and how many each stands for.

    steps : (n - 1,) True where the current changes.  longest_s : the most that a row may stand for.
    Rows are dense after a step of the current and ever sparser with the time since it: a pulse stays a pulse, at any
    rate of sampling. Voltage, temperature and time are averages of the rows that one stands for; the current is what
    moves the charge of the record, as its logger held it ("backward").
    """
    t = data.time_s
    n = len(t)
    first = np.concatenate([[True], steps])
    began = np.maximum.accumulate(np.where(first, np.arange(n), 0))
    since = t - t[np.maximum(began - 1, 0)]
    even = max(longest_s / STEP_GROWTH - FIRST_STEP_S, 0.0)
    place = np.log1p(np.minimum(since, even) / FIRST_STEP_S) / STEP_GROWTH
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
