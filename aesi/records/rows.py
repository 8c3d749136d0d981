"""Two records compared: their rows to the decimals in which they are written, and what they share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records.measurement import Measurement

FEWEST_ROWS = 30
"""That have to agree where current or voltage move: fewer are a seam between two parts, or chance."""
MOVES = 3.0
"""Of the last decimal, by which a row is another than the one before: rows of a voltage that slides by less are the
same in every cycle under one current."""
MOST_DECIMALS = 5
"""Of seconds, amperes and volts: more than a file of 4-byte numbers keeps."""
WHOLE = 1e-3
"""Of the last decimal, within which a number is written in so many: what a file in other units leaves of round-off."""


@dataclass(frozen=True)
class Overlap:
    """What the second of two records shares with the first.

    rows, share : number of rows that agree, and their share of the sparser record's rows at common times.
    from_s, to_s : first and last time of them in the second record, s.  ahead_s : how far the clock of the second is
    ahead of the first's, s.  resampled : True where they lie between the rows of the other record, not on them.
    """

    rows: int
    share: float
    from_s: float
    to_s: float
    ahead_s: float
    resampled: bool = False

    def reversed(self) -> Overlap:
        """The same overlap with the two records exchanged."""
        times = self.from_s - self.ahead_s, self.to_s - self.ahead_s
        return Overlap(self.rows, self.share, *times, -self.ahead_s, self.resampled)


class Rows:
    """A record, with the decimals in which its columns are written."""

    def __init__(self, record: Measurement) -> None:
        self.time_s, self.current_a, self.voltage_v = record.time_s, record.current_a, record.voltage_v
        self.decimals = tuple(map(written_decimals, (self.time_s, self.current_a, self.voltage_v)))
        self.step_s = float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else np.inf
        self._unique: dict[tuple[int, int], tuple[IntArray, IntArray]] = {}

    def unique_rows(self, of_current: int, of_voltage: int) -> tuple[IntArray, IntArray]:
        """(keys in ascending order, numbers) of the rows whose magnitude of the current and voltage occur once.

        of_current, of_voltage : decimals to which these are rounded. A key encodes both.
        """
        at = of_current, of_voltage
        if at not in self._unique:
            known = np.flatnonzero(np.isfinite(self.voltage_v))
            current = np.round(np.abs(self.current_a[known]) * 10.0**of_current).astype(np.int64)
            voltage = np.round(self.voltage_v[known] * 10.0**of_voltage).astype(np.int64)
            keys, first, counts = np.unique(
                current * 10 ** (MOST_DECIMALS + 2) + voltage, return_index=True, return_counts=True
            )
            self._unique[at] = keys[counts == 1], known[first[counts == 1]]
        return self._unique[at]

    def moving(self, of_current: int, of_voltage: int) -> BoolArray:
        """(n,) True where current or voltage differ from those of the row before by more than `MOVES` of the last
        decimal.

        of_current, of_voltage : number of decimals.
        """
        moves = np.zeros(len(self.time_s), dtype=bool)
        for column, digits in ((self.current_a, of_current), (self.voltage_v, of_voltage)):
            moves[1:] |= np.abs(np.diff(column)) > MOVES * 10.0**-digits
        return moves

    @cached_property
    def sums(self) -> tuple[Array, Array]:
        """(n + 1,) of the currents and the voltages before each row."""
        current, voltage = (
            np.concatenate([[0.0], np.cumsum(column)]) for column in (self.current_a, self.voltage_v)
        )
        return current, voltage

    @cached_property
    def areas(self) -> tuple[Array, Array, Array]:
        """(n,) from the first row up to each: A s of the current held since the row before, A s of it straight between
        rows, V s of the voltage straight between rows."""
        steps = np.diff(self.time_s)
        held, current, voltage = (
            np.concatenate([[0.0], np.cumsum(heights * steps)])
            for heights in (
                self.current_a[1:],
                0.5 * (self.current_a[1:] + self.current_a[:-1]),
                0.5 * (self.voltage_v[1:] + self.voltage_v[:-1]),
            )
        )
        return held, current, voltage

    def areas_at(self, at_s: Array) -> tuple[Array, Array, Array]:
        """(m,) each, the `areas` up to these times."""
        held, current, voltage = self.areas
        row = np.clip(np.searchsorted(self.time_s, at_s, side="right") - 1, 0, len(self.time_s) - 2)
        since, step = at_s - self.time_s[row], self.time_s[row + 1] - self.time_s[row]

        def straight(area: Array, column: Array) -> Array:
            slope = (column[row + 1] - column[row]) / step
            return np.asarray(area[row] + column[row] * since + 0.5 * slope * since**2)

        return (
            np.interp(at_s, self.time_s, held),
            straight(current, self.current_a),
            straight(voltage, self.voltage_v),
        )


def written_decimals(column: Array) -> int:
    """Number of decimals in which a column (n,) is written, at most MOST_DECIMALS."""
    known = column[np.isfinite(column)]
    moves = bool(np.any(known != known[:1]))
    for digits in range(MOST_DECIMALS):
        scaled = known * 10.0**digits
        whole = np.round(scaled)
        if np.all(np.abs(scaled - whole) < WHOLE) and (not moves or np.any(whole != whole[0])):
            return digits
    return MOST_DECIMALS
