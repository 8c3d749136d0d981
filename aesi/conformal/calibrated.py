"""A calibrated method: replay a record, or run beside a cell one sample at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aesi.conformal.band import Band, State
from aesi.conformal.intervals import Intervals
from aesi.conformal.tracker import next_log_ratio, replay, scaled
from aesi.errors import InputError
from aesi.numerics.typing import Array

SCHEMA = "aesi.conformal/1"


@dataclass(frozen=True, eq=False)
class Calibrated:
    """Intervals of the next residual at miss rate `alpha`, from the residuals before it.

    method : the name it is registered under.  window : samples of history that are looked at.
    band : the fitted rule.  marginal_v : (low, high) V, used while the history is too short.
    floor_v : V, no interval is narrower (the resolution of the calibration residuals).
    rate : of the adaptive step; 0 without.  log_ratio : where the adaptive step starts.

    A missing residual (NaN, a gap) ends the history: the marginal interval stands in, flagged by
    `Intervals.warm`, until enough residuals have come.
    """

    method: str
    alpha: float
    window: int
    band: Band
    marginal_v: tuple[float, float]
    floor_v: float
    rate: float = 0.0
    log_ratio: float = 0.0

    def intervals(self, residuals: Array) -> Intervals:
        """Replay one continuous record: the interval of sample k is made from samples before k only.

        residuals : (n,) V, evenly sampled as in the calibration; NaN where the voltage is missing.
        """
        residuals = checked_record(residuals)
        raw = self.band.batch(residuals)
        low = np.where(raw.ready, raw.low, self.marginal_v[0])
        high = np.where(raw.ready, raw.high, self.marginal_v[1])
        replay(low, high, raw.ready, residuals, self.log_ratio, self.rate, self.alpha, self.floor_v)
        return Intervals(low, high, raw.ready)

    def stream(self) -> Stream:
        """A fresh stream, at the start of a record."""
        return Stream(self)

    def adaptive(self, rate: float) -> Calibrated:
        """The same intervals with another rate of the adaptive step (0 turns it off)."""
        return replace(self, rate=rate)

    def to_dict(self) -> State:
        """Plain values and numpy arrays only; `from_dict` restores the same intervals to the last bit."""
        return {
            "schema": SCHEMA,
            "method": self.method,
            "alpha": self.alpha,
            "window": self.window,
            "marginal_v": list(self.marginal_v),
            "floor_v": self.floor_v,
            "rate": self.rate,
            "log_ratio": self.log_ratio,
            "band_kind": self.band.kind,
            "band": self.band.to_state(),
        }

    @staticmethod
    def from_dict(state: State) -> Calibrated:
        """Inverse of `to_dict`; arrays may come back as lists.

        Raises InputError for another schema or a kind of band this version does not know.
        """
        from aesi.conformal.registry import BANDS

        if state.get("schema") != SCHEMA:
            raise InputError(f"intervals have schema {state.get('schema')!r}, this version reads {SCHEMA!r}.")
        kind = state["band_kind"]
        if kind not in BANDS:
            raise InputError(f"unknown kind of band {kind!r}; this version knows {', '.join(sorted(BANDS))}.")
        low, high = state["marginal_v"]
        return Calibrated(
            method=str(state["method"]),
            alpha=float(state["alpha"]),
            window=int(state["window"]),
            band=BANDS[kind].from_state(state["band"]),
            marginal_v=(float(low), float(high)),
            floor_v=float(state["floor_v"]),
            rate=float(state["rate"]),
            log_ratio=float(state["log_ratio"]),
        )


class Stream:
    """Intervals beside a running cell: `interval()` before a sample, `update(error_v)` after it.

    Memory is fixed (twice the window). The intervals equal those of `Calibrated.intervals` on the same
    residuals. The object is mutable and belongs to one continuous record; call `gap()` after an interruption.
    """

    def __init__(self, calibrated: Calibrated) -> None:
        self._calibrated = calibrated
        self._buffer = np.empty(2 * calibrated.window)
        self._start = self._stop = 0
        self._log_ratio = calibrated.log_ratio
        self._current: tuple[float, float, bool] | None = None

    @property
    def warm(self) -> bool:
        """False while the history is too short and the marginal interval stands in."""
        return self._next()[2]

    def interval(self) -> tuple[float, float]:
        """(low, high) V of the next residual; the same until `update` is called."""
        low, high, _ = self._next()
        return low, high

    def update(self, error_v: float) -> None:
        """Take in the residual that the last interval was for; NaN or infinity means that it is missing."""
        low, high, warm = self._next()
        self._current = None
        if not np.isfinite(error_v):
            self.gap()
            return
        calibrated = self._calibrated
        if warm and calibrated.rate > 0:
            missed = error_v < low or error_v > high
            self._log_ratio = next_log_ratio(self._log_ratio, missed, calibrated.rate, calibrated.alpha)
        self._append(error_v)

    def gap(self) -> None:
        """The samples that follow are not adjacent to those before: forget the history, keep the scale."""
        self._start = self._stop = 0
        self._current = None

    def _append(self, error_v: float) -> None:
        window = self._calibrated.window
        if self._stop == len(self._buffer):
            self._buffer[:window] = self._buffer[-window:]
            self._start, self._stop = 0, window
        self._buffer[self._stop] = error_v
        self._stop += 1
        self._start = max(self._start, self._stop - window)

    def _next(self) -> tuple[float, float, bool]:
        if self._current is None:
            calibrated = self._calibrated
            raw = calibrated.band.row(self._buffer[self._start : self._stop])
            if raw is None:
                self._current = (*calibrated.marginal_v, False)
            else:
                low, high = scaled(raw[0], raw[1], self._log_ratio, calibrated.floor_v)
                self._current = (low, high, True)
        return self._current


def checked_record(residuals: Array) -> Array:
    """The record as a contiguous float vector; raises InputError for another shape."""
    record = np.ascontiguousarray(residuals, dtype=float)
    if record.ndim != 1:
        raise InputError(f"residuals have shape {record.shape}; give one (n,) array a continuous record.")
    return record
