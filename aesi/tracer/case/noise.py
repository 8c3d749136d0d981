"""The noise of a record's voltage: how large it is, how much of it is rounding, and how many rows share one value.

It is estimated from differences between rows where the current is steady, which leave out whatever varies slowly.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.special import ndtri

from aesi.data.thinning import STEP_C_RATE
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.records import Measurement

FEWEST_ROWS = 8
"""Fewest rows from which noise is estimated; a shorter record gets SMALLEST_NOISE_V."""
STEADIEST_SHARE = 0.3
"""Share of the rows, those at which the current changes least, from which the noise is estimated. A convention."""
LARGEST_SDS = 3.5
"""A difference larger than this many standard deviations is a step of the voltage, not noise. A convention."""
HELD_SHARE = 0.75
"""Quantile of the differences in a steady stretch from which the scale of the noise is read: where a channel holds its
values for several rows, up to half of the differences are zero."""
HARMONICS = 200
"""Harmonics of the rounding error that are summed; 0.1 % of its mean square is in the others."""
SETTLED_S = 5.0
"""Time, s, for which the current must have been steady before noise is estimated at longer lags: faster relaxation is
then over."""
LONGEST_SMOOTH_S = 8.0
"""Longest lag, s, at which the noise of a filtered or holding channel is looked for: a convention, between the seconds
that such channels take and the minutes over which the voltage relaxes."""
SMOOTH_LAGS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
"""Lags that are tried, rows."""
FEWEST_SPANS = 50
"""Fewest spans without overlap from which the noise at a lag is estimated, to a tenth of its value."""
EVEN_TIMES = 1.5
"""Longest duration of a span, over the typical time of so many rows: no third difference reaches over a gap."""
SMOOTH_TIMES = 1.25
"""Least ratio of the noise at a longer lag to that of neighbouring rows for a channel to count as filtered or holding:
two and a half of the standard deviations that `FEWEST_SPANS` leave. Otherwise the noise is white, as estimated from
neighbouring rows."""
LEAST_MOVES = 0.01
"""Share of the moves between neighbouring rows, or of the rows that repeat a value where those are fewer, up to which
the least moves are looked at for the resolution. In the records of the Panasonic NCR18650PF 0.2 % of the moves are less
than its 0.64 mV: its two grids, on charge and on discharge, are offset."""
SMALLEST_NOISE_V = 5e-5
"""Least noise that is assumed, V. No cycler has less, and in a virtual record without noise each microvolt would count
as evidence."""


class Noise(NamedTuple):
    """Noise of a record's rows.

    sd_v : standard deviation, V.  resolution_v : the part of it that averaging over rows does not reduce, V: the
    rounding error, where noise does not scatter the voltage over several steps of the resolution.
    rows : number of consecutive rows that share one value of the remaining noise; 1 where that is white.
    """

    sd_v: float
    resolution_v: float
    rows: int

    def sd_of_means_v(self, rows: Array) -> Array:
        """(m,) V, standard deviations of means over `rows` (m,) rows each."""
        values = np.maximum(rows / self.rows, 1.0)
        return np.sqrt((self.sd_v**2 - self.resolution_v**2) / values + self.resolution_v**2)


def noise_of(data: Measurement, capacity_ah: float) -> Noise:
    """The noise of a record's voltage: white, unless differences over several rows show more of it than those of
    neighbouring rows (`_noise_by_lag_v`).

    capacity_ah : of the cell; a current counts as steady by its C-rate.
    """
    if len(data) < FEWEST_ROWS:
        return Noise(SMALLEST_NOISE_V, 0.0, 1)
    sd_v, rows = noise_floor_v(data.voltage_v, data.current_a), 1
    by_lag_v = _noise_by_lag_v(data, capacity_ah)
    most_v = max(by_lag_v.values(), default=0.0)
    if most_v > SMOOTH_TIMES * sd_v:
        sd_v, rows = most_v, next(lag for lag, v in by_lag_v.items() if SMOOTH_TIMES * v > most_v)
    scattered_v = max(_second_difference_sd_v(data.voltage_v, data.current_a), most_v)
    return Noise(sd_v, min(_rounding_error_v(quantum_v(data.voltage_v), scattered_v), sd_v), rows)


def noise_floor_v(voltage_v: Array, current_a: Array) -> float:
    """Standard deviation of the white noise, V, from second differences where the current is steady.

    voltage_v, current_a : (n,) V, A.  The estimate is robust to voltage steps that remain. It is at least `quantum_v`
    over the root of twelve.
    """
    if len(voltage_v) < FEWEST_ROWS:
        return SMALLEST_NOISE_V
    rounding = quantum_v(voltage_v) / np.sqrt(12.0)
    return max(_second_difference_sd_v(voltage_v, current_a), float(rounding), SMALLEST_NOISE_V)


def _second_difference_sd_v(voltage_v: Array, current_a: Array) -> float:
    """As `noise_floor_v`, without its lower limits: RMS of the second differences over the root of 6, V, without the
    ohmic drop of a current that is never steady."""
    second_v, second_a = (one[2:] - 2.0 * one[1:-1] + one[:-2] for one in (voltage_v, current_a))
    change = np.abs(np.diff(current_a))
    change = np.maximum(change[1:], change[:-1])
    steadiest = change <= np.quantile(change, STEADIEST_SHARE)
    return _rms_without_outliers(_without_drop(second_v[steadiest], second_a[steadiest])) / float(
        np.sqrt(6.0)
    )


def _without_drop(second_v: Array, second_a: Array) -> Array:
    """(m,) V, second differences of a voltage minus their part that is proportional to those of the current (m,) A.

    Of the US06 schedule at 1 Hz, whose current changes in every row, 3.9 mV of noise were told where there are 0.2,
    and 0.5 are so; of the UDDS with 1 mV 1.8, and 1.0 are so.
    """
    left_v = second_v
    for _ in range(2):  # the second time without the outliers about the first drop
        kept = np.abs(left_v) <= LARGEST_SDS * _sd_of_quantile(left_v, 0.5)
        square = float(second_a[kept] @ second_a[kept])
        if not square > 0.0:
            return left_v
        left_v = second_v - float(second_a[kept] @ second_v[kept]) / square * second_a
    return left_v


def _sd_of_quantile(differences: Array, share: float) -> float:
    """Standard deviation of differences (m,), V, read from a quantile of their magnitude as of a normal distribution;
    at least 1 nV.  share : of that quantile."""
    sd = float(np.quantile(np.abs(differences), share)) / float(ndtri(0.5 * (1.0 + share)))
    return max(sd, 1e-9)


def _rms_without_outliers(differences: Array, share: float = 0.5) -> float:
    """RMS of differences (m,), without those of more than `LARGEST_SDS` standard deviations, which are no noise.

    share : quantile of their magnitude from which that standard deviation is read, as of a normal distribution.
    """
    kept = differences[np.abs(differences) <= LARGEST_SDS * _sd_of_quantile(differences, share)]
    return rms(kept if len(kept) > 5 else differences)


def quantum_v(voltage_v: Array) -> float:
    """The resolution of a voltage (n,), V: the typical least move between neighbouring rows; zero where no two
    neighbours share a value.

    Noise of at least the resolution moves neighbours by one step twice as often as it leaves them at one value, so that
    the `LEAST_MOVES` smallest moves are single steps. Values of rows far apart say nothing: between the 150 values of a
    discharge the least gap is one of chance, and the grid of a channel may shift when it is adjusted, or between charge
    and discharge.
    """
    moves = np.abs(np.diff(np.round(voltage_v, 6)))
    moved = moves[moves > 0.0]
    repeats = len(moves) - len(moved)
    if not repeats or not len(moved):
        return 0.0
    rank = int(LEAST_MOVES * min(repeats, len(moved)))
    return float(np.partition(moved, rank)[rank])


def _rounding_error_v(quantum_v: float, scattered_v: float) -> float:
    """RMS error, V, of the mean of a constant voltage with white noise whose rows are rounded to multiples of a
    quantum: quantum / sqrt(12) without noise, a 200th of that with noise of half a quantum, which scatters the rows
    over neighbouring multiples.

    scattered_v : standard deviation of the rows, V, the part that rounding adds included.
    Widrow & Kollar, Quantization Noise (2008), chapter 4: the k-th harmonic of the error is q / (pi k) sin(2 pi k v/q),
    and is multiplied by exp(-2 (pi k s / q)**2) in the mean over noise of standard deviation s.
    """
    if not quantum_v:
        return 0.0
    noise_v2 = max(scattered_v**2 - quantum_v**2 / 12.0, 0.0)
    k = np.arange(1, HARMONICS + 1)
    harmonics_v2 = (
        0.5 * (quantum_v / (np.pi * k)) ** 2 * np.exp(-4.0 * np.pi**2 * k**2 * noise_v2 / quantum_v**2)
    )
    return float(np.sqrt(harmonics_v2.sum()))


def _noise_by_lag_v(data: Measurement, capacity_ah: float) -> dict[int, float]:
    """Lag (rows) -> standard deviation of the noise, V, from differences at that lag. It is the same at each lag for
    white noise, and grows with the lag for a channel that is filtered or holds its values.

    It comes from third differences in stretches of steady current, `SETTLED_S` after they begin. A relaxing voltage
    adds a part that grows as the cube of the lag: the lags end before one at which the noise grows by a larger factor
    than the lag, or which has fewer than `FEWEST_SPANS` spans that do not overlap.
    """
    typical = float(np.median(np.diff(data.time_s)))
    settled = max(int(np.ceil(SETTLED_S / typical)), 1)
    out: dict[int, float] = {}
    for lag in (one for one in SMOOTH_LAGS if one == 1 or one * typical <= LONGEST_SMOOTH_S):
        span = settled + 3 * lag
        if len(data) <= span:
            break
        v = data.voltage_v[settled:]
        third = v[3 * lag :] - 3.0 * v[2 * lag : -lag] + 3.0 * v[lag : -2 * lag] - v[: -3 * lag]
        steady = _steady_spans(data, span, EVEN_TIMES * span * typical, STEP_C_RATE * capacity_ah)
        if np.count_nonzero(steady) < FEWEST_SPANS * lag:
            break
        found_v = _rms_without_outliers(third[steady], HELD_SHARE) / float(np.sqrt(20.0))
        before = max(out, default=lag)
        if out and found_v > lag / before * max(out[before], SMALLEST_NOISE_V):
            break
        out[lag] = found_v
    return out


def _steady_spans(data: Measurement, span: int, longest_s: float, most_a: float) -> BoolArray:
    """(n - span,) True where the current is steady from a row to the one `span` rows later: among the spans of at most
    `longest_s` (s) whose current varies by at most `most_a` (A), the `STEADIEST_SHARE` that vary least."""
    inside = slice((span + 1) // 2, (span + 1) // 2 + len(data) - span)
    highest, lowest = (of(data.current_a, span + 1)[inside] for of in (maximum_filter1d, minimum_filter1d))
    moves = highest - lowest
    calm = (data.time_s[span:] - data.time_s[:-span] <= longest_s) & (moves <= most_a)
    return calm & (moves <= np.quantile(moves[calm], STEADIEST_SHARE)) if calm.any() else calm
