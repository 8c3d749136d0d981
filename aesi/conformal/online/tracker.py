"""Adaptive conformal inference on the logarithm of the half-width: widen after a miss, narrow after a hit.

    r_g <- r_g exp((rate [g is the sample's group] + shared rate) (1[e outside the band] - a))       (1)

r_g multiplies the half-width of the raw band about its middle; a group is a range of the current, so that
coverage is held within each, not just on average. a = AIM alpha: on a record of some thousand samples the
share of misses still scatters about a, and should fall below alpha more often than not.

A step that the band would not follow is not taken, by its own group nor by the others: a hit where the band is held
at its floor (r would go down for as long as a rest lasts, and that of all groups with it, and the drive that comes next
be missed), and one that would lead r_g further beyond LOG_RATIO_LIMIT. Whatever the residuals do, of the n steps that
were taken in group g, one of G,

    share of misses - a = (D log r_g - shared / (1 + G shared) sum_h D log r_h) / (rate n)                   (2)

with D the change over the record: (1) summed, and solved for the misses. As log r stays within a few times the limit,
however groups push against each other, the share is a in the long run, without assumptions. Of all samples of a group
it is no more, since what was not counted is hits, but at the upper limit, where misses are not counted either.

The rate trades speed against jitter: after a rise of the error by a factor f the band has caught up after
about log(f) / rate misses. rate = 0 leaves the calibrated band as it is.

This is quantile tracking on the logarithm of the score |e - middle| / half-width, which keeps every width
positive. Gibbs & Candes, NeurIPS 2021 (adaptive conformal inference); Angelopoulos, Candes & Tibshirani,
NeurIPS 2023 (conformal PID control: the P part).
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array, BoolArray, IntArray

SHARED = 0.4
"""Share of a step that the other groups take too, as drift of a cell shows at every current. In `aesi bench drift --set
records=60`, where the error doubles over 3,000 samples, the range of the current that is covered least has 87.5 % where
the error grows at all currents (86.2 with half of it, 88.4 with twice, 81.6 with none) and 84.4 % where it grows at the
hardest alone (84.1, 84.9, 83.6), at nominal 90 %; without drift the score is 1.3 % above the best (1.1, 1.6, 0.9).
(numba compiles the number in: NUMBA_DISABLE_JIT=1 before `docs/hooks/constant.py` lets it see another.)"""
AIM = 0.95
"""Share of alpha that is aimed at. On 1,000 draws of 3,000 normal residuals an aim of alpha covers less than 1 -
alpha on 42 %, one of 0.95 alpha on none (docs/theory/conformal.md)."""
LOG_RATIO_LIMIT = 7.0
"""No group takes a step of its own to |log r| beyond this (a factor of 1,100): a sensor that is stuck for hours must
not drive r to zero or infinity, from where it would take as long to come back. Steps of other groups are taken there
too: were they cut off one way alone, a group that always hits would give the other way back to all, and let them miss
more."""


@kept_njit()
def adapt_log_ratio(
    log_ratio: Array, group: int, missed: bool, held: bool, rate: float, alpha: float
) -> None:
    """Equation (1), one step, in place; log_ratio : (n_groups,).

    held : whether the sample's band was held at its floor.
    """
    if held and not missed:
        return
    step = rate * ((1.0 if missed else 0.0) - AIM * alpha)
    if abs(log_ratio[group] + SHARED * step + step) > max(LOG_RATIO_LIMIT, abs(log_ratio[group])):
        return
    for g in range(log_ratio.size):
        log_ratio[g] = log_ratio[g] + SHARED * step + (step if g == group else 0.0)


@kept_njit()
def initial_log_ratio(start: Array) -> Array:
    """(n_groups,) log r at the first sample, from that of the calibration, which is the log of zero where held-out
    residuals lay in the middle of their bands: no step would lead back from there."""
    return np.maximum(start, -LOG_RATIO_LIMIT)


@kept_njit()
def scaled_band(low: float, high: float, log_ratio: float, floor: float) -> tuple[float, float, bool]:
    """The raw band, low <= high, scaled by r about its middle, at least `floor` wide; and whether it is held there."""
    raw, least = 0.5 * (high - low), 0.5 * floor
    half = max(raw, least) * np.exp(log_ratio)
    # Not middle +- half: an end is a residual of the calibration, which others equal where residuals are rounded, and
    # round-off would leave all of them out.
    more = max(half, least) - raw
    return low - more, high + more, half <= least


@kept_njit()
def replay(
    low: Array,
    high: Array,
    ready: BoolArray,
    residuals: Array,
    groups: IntArray,
    start: Array,
    rate: float,
    alpha: float,
    floor: float,
) -> None:
    """Scale the raw bands in place along a record; a row that is not ready keeps its band.

    low, high, residuals : (n,) V.  groups : (n,).  start : (n_groups,) log r of the calibration.
    """
    log_ratio = initial_log_ratio(start)
    for k in range(low.size):
        if not ready[k]:
            continue
        low[k], high[k], held = scaled_band(low[k], high[k], log_ratio[groups[k]], floor)
        if rate > 0 and np.isfinite(residuals[k]):
            missed = residuals[k] < low[k] or residuals[k] > high[k]
            adapt_log_ratio(log_ratio, groups[k], missed, held, rate, alpha)
