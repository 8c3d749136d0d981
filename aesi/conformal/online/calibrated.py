"""A calibrated method: replays a record, or runs online with a cell one sample at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.conformal.bands.band import Band
from aesi.conformal.intervals import Intervals
from aesi.conformal.online.records import checked_current, checked_record
from aesi.conformal.online.scale import Scale
from aesi.conformal.online.tracker import adapt_log_ratio, initial_log_ratio, replay, scaled_band
from aesi.errors import InputError, in_words
from aesi.numerics.drive import N_RECENT
from aesi.numerics.typing import Array, SavedState
from aesi.records.checked import is_one_number

SCHEMA = "aesi.conformal/1"


@dataclass(frozen=True, eq=False)
class Calibrated:
    """Intervals of the next residual at miss rate `alpha`, from the residuals before it.

    method : registered name.  window : number of past samples that are used.
    band : the fitted rule.  scale : initial factor on its width.  rate : of the adaptive step; 0 for none.
    marginal_v : (low, high) V, used while the history is too short.
    floor_v : least width of an interval, V (the resolution of the calibration residuals).

    A missing residual (NaN, a gap) ends the history. The marginal interval is then used, and `Intervals.warm` is False,
    until there are enough residuals again.
    """

    method: str
    alpha: float
    window: int
    band: Band
    scale: Scale
    rate: float
    marginal_v: tuple[float, float]
    floor_v: float

    def __repr__(self) -> str:
        return f"Calibrated({self.method}, {100 * (1 - self.alpha):g} %, window {self.window})"

    @property
    def needs_current(self) -> bool:
        """True where it was calibrated with the current, so that predictions need the current too."""
        return self.band.needs_current or self.scale.needs_current

    def intervals(self, residuals: Array, current_a: Array | None = None) -> Intervals:
        """The intervals along one continuous record. That of sample k uses the residuals before k and the current up to
        and at k.

        residuals : (n,) V, evenly sampled as in the calibration; NaN where the voltage is missing.
        current_a : (n,) A, discharge positive; needed where `needs_current`, else ignored.
        """
        residuals = checked_record(residuals)
        current = self._current(current_a, len(residuals))
        raw = self.band.batch(residuals, current)
        low = np.where(raw.ready, raw.low, self.marginal_v[0])
        high = np.where(raw.ready, raw.high, self.marginal_v[1])
        groups = np.zeros(len(residuals), dtype=np.int64) if current is None else self.scale.groups(current)
        start = self.scale.log_ratio
        replay(low, high, raw.ready, residuals, groups, start, self.rate, self.alpha, self.floor_v)
        return Intervals(low, high, raw.ready)

    def stream(self) -> Stream:
        """A fresh stream, at the start of a record."""
        return Stream(self)

    def to_dict(self) -> SavedState:
        """Plain values and numpy arrays only; `aesi.conformal.calibrated_from_dict` restores the same
        intervals to the last bit."""
        return {
            "schema": SCHEMA,
            "method": self.method,
            "alpha": self.alpha,
            "window": self.window,
            "band_kind": self.band.kind,
            "band": self.band.to_state(),
            "scale": self.scale.to_state(),
            "rate": self.rate,
            "marginal_v": list(self.marginal_v),
            "floor_v": self.floor_v,
        }

    def _current(self, current_a: Array | None, n: int) -> Array | None:
        if not self.needs_current:
            return None
        if current_a is None:
            raise InputError(
                f"these {self.method} intervals were calibrated with the current; give current_a."
            )
        return checked_current(current_a, n)


class Stream:
    """Intervals online with a running cell: call `interval()` before a sample, `update(error_v)` after it.

    The memory is fixed (twice the window). The intervals equal those of `Calibrated.intervals` on the same residuals.
    The object is mutable and belongs to one continuous record; call `gap()` after an interruption.
    """

    def __init__(self, calibrated: Calibrated) -> None:
        self._calibrated = calibrated
        self._past = _RecentValues(calibrated.window)
        self._currents = _RecentValues(N_RECENT - 1)
        self._log_ratio = initial_log_ratio(calibrated.scale.log_ratio)
        self._pending: _Pending | None = None
        self._warm = False

    def __repr__(self) -> str:
        return f"Stream({self._calibrated!r}, {len(self._past.values)} residuals known)"

    def interval(self, current_a: float | None = None) -> tuple[float, float]:
        """(low, high) V of the next residual.

        current_a : A, current at that sample; needed where `needs_current`. It may be called again before `update`,
        also with another current.  Raises InputError for what is no number.
        """
        current_a = None if current_a is None else _number(current_a, "current_a")
        pending = self._pending
        if pending is None or pending.current_a != current_a:
            pending = self._pending = self._make_interval(current_a)
            self._warm = pending.warm
        return pending.low, pending.high

    @property
    def warm(self) -> bool:
        """False while the history is too short, so that the last `interval` was the marginal one, before the first one
        and after a gap; an `update` changes nothing of it."""
        return self._warm

    def update(self, error_v: float) -> None:
        """Add the residual of the sample of the last interval, V; NaN or infinity where it is missing.

        Raises InputError where `interval` was not called for this sample although it needs the current, and for what is
        no number, which changes nothing.
        """
        error_v = _number(error_v, "error_v")
        calibrated = self._calibrated
        low, high = self.interval() if self._pending is None else (self._pending.low, self._pending.high)
        pending, self._pending = self._pending, None
        assert pending is not None
        if pending.current_a is not None:
            self._currents.append(pending.current_a)
        if not np.isfinite(error_v):
            self._past.clear()
            return
        if pending.warm and calibrated.rate > 0:
            missed = error_v < low or error_v > high
            adapt_log_ratio(
                self._log_ratio, pending.group, missed, pending.held, calibrated.rate, calibrated.alpha
            )
        self._past.append(error_v)

    def gap(self) -> None:
        """Begin anew after an interruption: the history is dropped, the scale is kept."""
        self._past.clear()
        self._currents.clear()
        self._pending = None
        self._warm = False

    def _make_interval(self, current_a: float | None) -> _Pending:
        calibrated, group = self._calibrated, 0
        recent = np.empty(0)
        if calibrated.needs_current:
            if current_a is None or not np.isfinite(current_a):
                raise InputError(
                    f"these {calibrated.method} intervals were calibrated with the current; "
                    f"call interval(current_a) with its value at the coming sample, not {current_a}."
                )
            recent = np.append(self._currents.values, current_a)
            group = int(np.searchsorted(calibrated.scale.edges_a, current_a))
        else:
            current_a = None
        raw = calibrated.band.row(self._past.values, recent)
        if raw is None:
            return _Pending(current_a, *calibrated.marginal_v, group, held=False, warm=False)
        low, high, held = scaled_band(raw[0], raw[1], self._log_ratio[group], calibrated.floor_v)
        return _Pending(current_a, low, high, group, held, warm=True)


def _number(value: float, name: str) -> float:
    """One number as a float.  Raises InputError for anything else, which a stream has no sample for."""
    if not is_one_number(value):
        raise InputError(f"{name} = {in_words(value)} is not a number; give that of one sample.")
    return float(value)


@dataclass(frozen=True)
class _Pending:
    """The last interval, before its residual is known."""

    current_a: float | None
    low: float
    high: float
    group: int
    held: bool
    warm: bool


class _RecentValues:
    """The last `size` values, contiguous, in fixed memory."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._buffer = np.empty(2 * size)
        self._start = self._stop = 0

    @property
    def values(self) -> Array:
        """(m,) m <= size, most recent last; a view."""
        return self._buffer[self._start : self._stop]

    def append(self, value: float) -> None:
        if self._stop == len(self._buffer):
            self._buffer[: self._size] = self._buffer[-self._size :]
            self._stop = self._size
        self._buffer[self._stop] = value
        self._stop += 1
        self._start = max(0, self._stop - self._size)

    def clear(self) -> None:
        self._start = self._stop = 0
