"""`aesi bench spci`: prediction intervals on a series whose best intervals are known, against published methods.

    e[k] = phi e[k-1] + s[k] z[k],    z standard normal,    log(s / s0) = a sin(2 pi k / period)         (1)

Given the past, e[k] is normal with mean phi e[k-1] and standard deviation s[k], so that the best (oracle) interval at
alpha = 0.1 is phi e[k-1] -+ 1.645 s[k]. `score_ratio` is the interval score over that of the oracle.

The time of this package (`ours_s`) covers the calibration and the intervals of all test steps, with compiled code
already loaded. All times are processor times of one thread, which other work on the machine changes little. SPCI as
published (Xu & Xie, ICML 2023, arXiv:2212.03463) refits its forest at every step; a few steps are timed and scaled to
all. So are those of MAPIE, which is asked for one step at a time, as an online method is.
"""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench import AtLeastOne, check_listed
from aesi.conformal import METHODS, Calibrated
from aesi.conformal.scores import interval_score
from aesi.constants import MILLI
from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array

ALPHA = 0.1
"""Nominal share of misses: intervals for 90 %."""
WINDOW = 200
"""Number of past residuals that an interval is predicted from: the default of an experiment."""
NORMAL_95 = 1.6448536269514722
"""95 % quantile of the standard normal distribution."""
PHI, SCALE_V, SWING = 0.9, 1e-4, 0.8
"""phi, s0 (V) and a of (1)."""


@dataclass(frozen=True, eq=False)
class OracleSeries:
    """A series (1) and its best intervals.

    residuals : (n,) V.  lower, upper : (n,) V, bounds of the best interval at alpha = 0.1 given the past.
    """

    residuals: Array
    lower: Array
    upper: Array


def oracle_series(n: int, rng: np.random.Generator, period: int = 3000) -> OracleSeries:
    """A random series (1) of n samples.  period : samples of one period of s."""
    scale = SCALE_V * np.exp(SWING * np.sin(2 * np.pi * np.arange(n) / period))
    residuals: Array = _autoregression(PHI, scale * rng.standard_normal(n))
    middle = PHI * np.concatenate([[0.0], residuals[:-1]])
    return OracleSeries(residuals, middle - NORMAL_95 * scale, middle + NORMAL_95 * scale)


@kept_njit()
def _autoregression(phi: float, shocks: Array) -> Array:
    out = np.empty(shocks.size)
    last = 0.0
    for k in range(shocks.size):
        last = phi * last + shocks[k]
        out[k] = last
    return out


def run(
    n_calibration: PositiveInt = 88_200,
    n_test: PositiveInt = 40_000,
    methods: AtLeastOne[str] = tuple(METHODS),
    peer_steps: NonNegativeInt = 1,
    mapie_steps: NonNegativeInt = 200,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One row per method: processor times of this package and of the peer for all test steps, s; coverage, per cent;
    width and scores, V; peak memory, MiB.

    n_calibration, n_test : samples.  methods : keys of METHODS.  peer_steps : steps of the published procedure that are
    timed (20 s or more each at full size), 0 for none.  mapie_steps : steps of MAPIE that are timed. There are at most
    n_test of either.  seed : of the series.
    Raises InputError for an unknown method.
    """
    check_listed("methods", methods, METHODS)
    from threadpoolctl import threadpool_limits

    rng = np.random.default_rng(seed)
    past, future = oracle_series(n_calibration, rng), oracle_series(n_test, rng)
    with threadpool_limits(1):
        lines = [_ours(name, past.residuals, future) for name in methods]
        # The peers run afterwards, so that the peak memory above is that of this package.
        steps_s: dict[str, float] = {}
        for line in lines:
            peer, steps = _peer(line["method"], min(peer_steps, n_test), min(mapie_steps, n_test))
            if steps and peer not in steps_s:
                steps_s[peer] = PEERS[peer](past.residuals, future.residuals, steps)
            yield line | _compared(peer, steps, steps_s.get(peer), n_test, line["ours_s"])


def _ours(name: str, past: Array, future: OracleSeries) -> dict[str, Any]:
    METHODS[name].fit([past[:3000]], ALPHA, WINDOW).intervals(future.residuals[:500])  # loads compiled code
    started = process_time()
    calibrated = METHODS[name].fit([past], ALPHA, WINDOW)
    fitted = process_time()
    intervals = calibrated.intervals(future.residuals)
    done = process_time()
    score = interval_score(intervals.lower_v, intervals.upper_v, future.residuals, ALPHA)
    oracle = interval_score(future.lower, future.upper, future.residuals, ALPHA)
    return {
        "method": name,
        "n_calibration": len(past),
        "n_test": len(intervals),
        "ours_s": done - started,
        "fit_s": fitted - started,
        "coverage_pct": 100 * float(intervals.covers(future.residuals).mean()),
        "width": float(intervals.width_v.mean()),
        "interval_score": score,
        "oracle_score": oracle,
        "score_ratio": score / oracle,
        "stream_ms": _stream_ms(calibrated, future.residuals[:2000]),
        "peak_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
    }


def _stream_ms(calibrated: Calibrated, residuals: Array) -> float:
    """Mean processor time of one step online, ms: the interval, then the update with the residual."""
    stream = calibrated.stream()
    started = process_time()
    for error in residuals.tolist():
        stream.interval()
        stream.update(error)
    return MILLI * (process_time() - started) / len(residuals)


def _peer(method: str, peer_steps: int, mapie_steps: int) -> tuple[str, int]:
    """(key of PEERS that a method is compared with, number of its steps that are timed)."""
    if method.startswith("spci"):
        return "SPCI as published", peer_steps
    return ("MAPIE EnbPI" if method == "enbpi" else "MAPIE ACI"), mapie_steps


def _compared(peer: str, steps: int, step_s: float | None, n_test: int, ours_s: float) -> dict[str, Any]:
    if step_s is None:
        return {"peer": peer, "peer_s": None, "peer_steps_timed": 0, "ratio": None}
    return {
        "peer": peer,
        "peer_s": round(step_s * n_test, 1),
        "peer_steps_timed": steps,
        "peer_step_s": step_s,
        "ratio": round(step_s * n_test / ours_s, 1),
    }


def _published_step_s(past: Array, future: Array, steps: int) -> float:
    """Processor time per step of SPCI as published, s: fit a forest of ten trees of depth two to all windows, then
    predict the quantiles of one row."""
    from quantile_forest import RandomForestQuantileRegressor

    betas = np.linspace(0, ALPHA, 5)
    levels = [*betas, *(1 - ALPHA + betas)]
    series = np.concatenate([past, future[:steps]])
    started = process_time()
    for k in range(len(past), len(past) + steps):
        windows = np.lib.stride_tricks.sliding_window_view(series[:k], WINDOW)
        forest = RandomForestQuantileRegressor(10, max_depth=2, max_samples_leaf=None, random_state=0)
        forest.fit(windows[:-1], series[WINDOW:k])
        forest.predict(windows[-1:], quantiles=[float(level) for level in levels])
    return (process_time() - started) / steps


def _mapie_step_s(method: str, past: Array, future: Array, steps: int) -> float:
    """Processor time per step of MAPIE's time-series regressor around a prediction of zero, s: predict an interval,
    then update with the residual.  method : 'enbpi' or 'aci'."""
    import warnings

    from mapie.regression import TimeSeriesRegressor
    from sklearn.dummy import DummyRegressor

    kept = past[-WINDOW:] if method == "enbpi" else past
    zero = DummyRegressor(strategy="constant", constant=0.0).fit(np.zeros((2, 1)), np.zeros(2))
    with warnings.catch_warnings(action="ignore"):  # MAPIE warns of changes in its interface at every step
        regressor = TimeSeriesRegressor(zero, method=method, cv="prefit").fit(np.zeros((len(kept), 1)), kept)
        x = np.zeros((1, 1))
        started = process_time()
        for error in future[:steps]:
            regressor.predict(x, confidence_level=1 - ALPHA)
            if method == "enbpi":
                regressor.update(x, np.array([error]))
            else:
                regressor.adapt_conformal_inference(
                    x, np.array([error]), gamma=0.005, confidence_level=1 - ALPHA
                )
        return (process_time() - started) / steps


PEERS: dict[str, Callable[[Array, Array, int], float]] = {
    "SPCI as published": _published_step_s,
    "MAPIE EnbPI": lambda past, future, steps: _mapie_step_s("enbpi", past, future, steps),
    "MAPIE ACI": lambda past, future, steps: _mapie_step_s("aci", past, future, steps),
}
"""Name of a peer -> function of the past residuals, (n,) V, the future residuals, (m,) V, and the number of timed steps
that returns the processor time per step, s."""
