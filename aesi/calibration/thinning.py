"""Fewer rows for fits: charge is kept, and a pulse stays a pulse at any rate of sampling.

Drives are averaged over centred windows. Tests of steady currents, pulses and rests keep rows that are dense after each
step of the current and ever sparser with the time since it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.typing import Array, BoolArray
from aesi.records import Hold, Measurement

WINDOW_S = 1.0
"""Of a drive: solid diffusion and the electrolyte are slower than this."""
STEADY_ROWS = 400
"""Rows that a steady record is spread over, besides those after its steps."""
STEP_C_RATE = 0.01
"""A change of the current by more than this is a step."""
STEADY_SHARE = 0.01
"""A record whose current changes in fewer of its rows than this is one of steady currents."""
FIRST_S = 0.2
"""Distance of the first rows after a step."""
SOON_S = 1.0
"""A row after a step that another follows this soon need not be believed."""
GROWTH = 0.4
"""Rows of a steady record are this share of the time since the current's last step apart."""


@dataclass(frozen=True, eq=False)
class Thinned:
    """What a fit simulates.

    data : the rows.  hold : how the current runs between them.  longest_s : of the model's steps.
    trusted : (rows,) False where a step of the current lies within the row: instruments read current and voltage some
    hundredths of a second apart.
    """

    data: Measurement
    trusted: BoolArray
    hold: Hold
    longest_s: float


def thinned(data: Measurement, capacity_ah: float, window_s: float = WINDOW_S) -> Thinned:
    """The rows that a fit sees.  capacity_ah : what a step of the current is measured by."""
    steps = np.abs(np.diff(data.current_a)) > STEP_C_RATE * capacity_ah
    gaps = np.diff(data.time_s)
    typical = float(np.median(gaps))
    uneven = float(np.mean(np.abs(gaps - typical) > 0.5 * typical)) > STEADY_SHARE
    if uneven or float(np.mean(steps)) < STEADY_SHARE:
        rows = _log_spaced(data, steps)
        spacing = np.diff(rows.time_s)
        stepped = np.abs(np.diff(rows.current_a)) > STEP_C_RATE * capacity_ah
        followed = np.append(spacing[1:], np.inf) < SOON_S
        trusted = np.concatenate([[True], ~(stepped & followed)])
        return Thinned(rows, trusted, "backward", min(max(float(np.median(spacing)), 1.0), 30.0))
    rows = _windowed(data, window_s)
    return Thinned(rows, np.ones(len(rows), dtype=bool), "linear", max(window_s, 1.0))


def _windowed(data: Measurement, window_s: float) -> Measurement:
    """Centred averages over windows of about `window_s`; the first row stays."""
    factor = round(window_s / float(np.median(np.diff(data.time_s))))
    if factor < 2:
        return data
    half = factor // 2
    centres = np.arange(half, len(data) - half, factor)
    weights = np.ones(2 * half + 1)
    weights[[0, -1]] = 0.5 if factor % 2 == 0 else 1.0
    weights /= weights.sum()

    def averaged(column: Array) -> Array:
        kept = np.convolve(column, weights, mode="valid")[centres - half]
        return np.concatenate([column[:1], kept])

    temperature = data.temperature_degc
    return replace(
        data,
        time_s=np.concatenate([data.time_s[:1], data.time_s[centres]]),
        current_a=averaged(data.current_a),
        voltage_v=averaged(data.voltage_v),
        temperature_degc=None if temperature is None else averaged(temperature),
    )


def _log_spaced(data: Measurement, steps: BoolArray) -> Measurement:
    """Averages over rows whose spacing grows with the time since the current's last step, to a share of the record.

    The current of a row is what moves the record's charge from the row before it, as loggers hold it.
    """
    t, n = data.time_s, len(data)
    longest = float(t[-1] - t[0]) / STEADY_ROWS
    opens = np.concatenate([[True], steps])
    began = np.maximum.accumulate(np.where(opens, np.arange(n), 0))
    since = t - t[np.maximum(began - 1, 0)]
    even = max(longest / GROWTH - FIRST_S, 0.0)
    place = np.log1p(np.minimum(since, even) / FIRST_S) / GROWTH + np.maximum(since - even, 0.0) / longest
    first = opens | np.concatenate([[True], np.diff(np.floor(place)) != 0.0])
    first[[1, -1]] = True
    # The first row of a current by itself, and the last: between them the steps are exact.
    first[1:] |= opens[:-1]
    first[:-1] |= opens[1:]
    starts = np.flatnonzero(first)
    rows = np.diff(np.append(starts, n))

    def averaged(column: Array) -> Array:
        return np.add.reduceat(column, starts) / rows

    time = averaged(t)
    charge = np.concatenate([[0.0], np.cumsum(data.current_a[1:] * np.diff(t))])
    current = np.diff(np.interp(time, t, charge)) / np.diff(time)
    temperature = data.temperature_degc
    return replace(
        data,
        time_s=time,
        current_a=np.concatenate([data.current_a[:1], current]),
        voltage_v=averaged(data.voltage_v),
        temperature_degc=None if temperature is None else averaged(temperature),
    )
