"""Missing rows: a sparsely logged rest or steady current and a single row long before or after the test get a note, any
other gap is refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.channels.checks import Columns, Context
from aesi.data.channels.load_columns import keep_rows
from aesi.errors import DataError
from aesi.numerics.typing import AnyArray, Array
from aesi.over_time import range_words
from aesi.records.measurement import Hold, assumed_hold

GAP_FLOOR_S = 5.0
"""A gap is an interval longer than this, than GAP_RATIO times both adjacent intervals, and than GAP_RATIO times the
usual ones among NEIGHBOURS on either side. Loggers that write on a change of voltage have intervals of all lengths, the
longest two or more in a row."""
GAP_RATIO = 10.0
NEIGHBOURS = 10
BUNCH_SHARE = 0.25
"""Share of the neighbouring intervals that may be gaps themselves. In a logger that writes a pair of rows at each step,
and else slowly, every other interval is long. Of 322 measured and virtual records, and of 720 thinned to rows at a
change of voltage, only two more are refused than with the longest neighbour as limit, both thinned from one record with
an hour missing."""
REST_CURRENT_SHARE = 0.02
"""The cell rests at currents of at most this share of the largest, and currents that differ by no more are the same."""
REST_VOLTAGE_V = 0.005
"""How far a voltage that relaxes, or runs on under a steady current, may seem to go the other way."""
STRAY_S = SECONDS_PER_HOUR
"""A first or last row that is further than this from the others is of another test, though the cell rests in it: that
of the Panasonic's C/20 is 14 h later, and 14 K colder. A convention."""
SUMMER_TIME_S = SECONDS_PER_HOUR
"""Step by which clocks are put forward in spring, which looks like a gap."""
UNTOLD_SHARE = 0.05
"""Largest share of the charge moved, in both directions, that may depend on how the current runs between the rows. It
is at most 0.003 in 94 measured records and 0.015 in 19 public exports of six makers, but 0.25 where cycles were logged
only at the ends of their steps, and 0.87 where pulses were."""
FEW_STRETCHES = 3
"""Up to this number, sparsely logged stretches get a note each; more get one note together."""
RESTED = "the cell rested"
RAN_ON = "the current before and after them is the same, and is taken to have run on"


def without_gaps(data: Columns, context: Context, notes: list[str]) -> tuple[Columns, Context]:
    """Refuse gaps; keep a sparsely logged rest or steady current and drop a single row long before or after the test,
    with a note."""
    gaps = find_gaps(data)
    if not gaps:
        return data, context
    n = len(data["time_s"])
    kept = np.arange(n)
    steady: dict[str, list[tuple[float, float]]] = {RESTED: [], RAN_ON: []}
    currents = _Currents.of(data)
    for k in gaps:
        seconds = float(data["time_s"][k + 1] - data["time_s"][k])
        stray = k in (0, n - 2) and seconds > STRAY_S
        if currents.rested(k) and not stray:
            steady[RESTED].append((float(data["time_s"][k]), seconds))
        elif currents.ran_on(k):
            steady[RAN_ON].append((float(data["time_s"][k]), seconds))
        elif k == 0:
            notes.append(
                f"The first row, {seconds:.6g} s before the one after it, is not of this test and was dropped."
            )
            kept = kept[1:]
        elif k == n - 2:
            notes.append(
                f"The last row, {seconds:.6g} s after the one before it, is not of this test and was dropped."
            )
            kept = kept[:-1]
        else:
            raise gap_error(data, k, context)
    for words, stretches in steady.items():
        notes += _stretch_notes(stretches, words)
    return (data, context) if len(kept) == n else keep_rows(data, context, kept)


def _stretch_notes(stretches: Sequence[tuple[float, float]], words: str) -> list[str]:
    """A note on each of up to FEW_STRETCHES sparsely logged stretches (start s, length s), or one note on more of
    them.  words : on what the cell did there."""
    if len(stretches) <= FEW_STRETCHES:
        return [f"No rows for {length:.6g} s from {start:.10g} s on; {words}." for start, length in stretches]
    lengths = [length for _, length in stretches]
    seconds = range_words(f"{min(lengths):.3g}", f"{max(lengths):.3g}")
    return [
        f"No rows for {seconds} s at {len(stretches)} places, the first at {stretches[0][0]:.10g} s; {words}."
    ]


def find_gaps(columns: Columns) -> list[int]:
    """Rows k after which rows seem to be missing: the interval after k is much longer than the usual ones around it,
    even where a few of those are gaps too."""
    step = np.diff(columns["time_s"])
    padded = np.pad(step, NEIGHBOURS, constant_values=np.nan)
    around = sliding_window_view(padded, 2 * NEIGHBOURS + 1)
    beside = np.fmax(around[:, NEIGHBOURS - 1], around[:, NEIGHBOURS + 1])  # NaN of a single interval
    long = np.flatnonzero((step > GAP_FLOOR_S) & (step > GAP_RATIO * beside))
    usual = [_longest_usual(np.delete(around[k], NEIGHBOURS)) for k in long]
    return long[step[long] > GAP_RATIO * np.asarray(usual)].tolist()


def _longest_usual(neighbours: Array) -> float:
    """The longest of the intervals (n,), without up to BUNCH_SHARE of them that are beyond GAP_RATIO times the next
    shorter one; NaN is ignored."""
    ordered = np.sort(neighbours[np.isfinite(neighbours)])
    few = int(BUNCH_SHARE * len(ordered))
    leaps = ordered[1:] > GAP_RATIO * ordered[:-1]
    leaps[: len(ordered) - 1 - few] = False
    return float(ordered[np.argmax(leaps)] if np.any(leaps) else ordered[-1])


def ambiguous_charge_notes(columns: Columns) -> list[str]:
    """A note where the charge moved depends on how the current runs between the rows, with that which is taken unless
    another is declared; none for a record of so few rows that its first and last currents alone make that
    difference."""
    size, step = np.abs(columns["current_a"]), np.diff(columns["time_s"]) / SECONDS_PER_HOUR
    until, since = float(np.sum(size[:-1] * step)), float(np.sum(size[1:] * step))
    straight = 0.5 * (until + since)
    few = len(size) <= 1.0 / UNTOLD_SHARE
    if few or abs(since - straight) <= UNTOLD_SHARE * straight:  # |until - straight| is the same
        return []
    ways: dict[Hold, str] = {
        "backward": f"{since:.3g} Ah with the current of the row after",
        "linear": f"{straight:.3g} Ah with straight lines between the rows",
    }
    taken = ways.pop(assumed_hold(columns["time_s"]))
    (other,) = ways.values()
    return [
        "Some rows are far apart where the current changes, so that they do not tell the charge that moved: either "
        f"way {taken}, as is assumed unless --hold says otherwise, {other}, {until:.3g} Ah with that of the row "
        "before. Where another is true declare it, or give the rows before and after each change, or leave out where "
        "they are missing (--from-s, --to-s)."
    ]


@dataclass(frozen=True, eq=False)
class _Currents:
    """What the rows around an interval tell of the current within it, where a logger writes on a change.

    current_a, voltage_v : (n,) A, V.  resting : (n,) True at rest.  changes : (n - 1,) True where the current of the
    next row is another.  before_load : (n,) the last row at rest before the load of a row or, at rest, before the load
    that it follows; -1 where none is.
    """

    current_a: Array
    voltage_v: Array
    resting: AnyArray
    changes: AnyArray
    before_load: AnyArray

    @classmethod
    def of(cls, columns: Columns) -> _Currents:
        current = columns["current_a"]
        small = REST_CURRENT_SHARE * float(np.max(np.abs(current)))
        resting, rows = np.abs(current) <= small, np.arange(len(current))
        rest = np.maximum.accumulate(np.where(resting, rows, -1))
        load = np.maximum.accumulate(np.where(resting, -1, rows))
        before = np.where(load >= 0, rest[load], -1)
        return cls(current, columns["voltage_v"], resting, np.abs(np.diff(current)) > small, before)

    def rested(self, k: int) -> bool:
        """True where the cell rested after row k, whose load may have ended there, up to row k + 1: at rest in both, or
        in the last row before a load; and the voltage relaxed at most to where it was before the load."""
        last = k + 1 < len(self.changes) and not self.resting[k + 2]
        if not (self.resting[k + 1] and (self.resting[k] or last)):
            return False
        earlier = self.before_load[k]
        ends = self.voltage_v[[k, k if earlier < 0 else earlier]]
        return bool(np.min(ends) - REST_VOLTAGE_V <= self.voltage_v[k + 1] <= np.max(ends) + REST_VOLTAGE_V)

    def ran_on(self, k: int) -> bool:
        """True where rows k and k + 1 are the first and the last of a steady current, under which the voltage moved its
        way."""
        first_and_last = k > 0 and self.changes[k - 1] and self.changes[k + 1 : k + 2].any()
        if self.resting[k + 1] or self.changes[k] or not first_and_last:
            return False
        moved = float(self.voltage_v[k + 1] - self.voltage_v[k])
        return bool(np.sign(self.current_a[k]) * moved <= REST_VOLTAGE_V)


def gap_error(columns: Columns, k: int, context: Context) -> DataError:
    """The error for a gap between rows k and k + 1."""
    time = columns["time_s"]
    last, first = float(time[k]), float(time[k + 1])
    row_s = float(np.median(np.diff(time)))
    put_forward = abs(first - last - row_s - SUMMER_TIME_S) <= row_s
    summer = (
        " Or it is a clock that was put forward to summer time: give the time in UTC." if put_forward else ""
    )
    return DataError(
        f"{context.at('time_s', k + 1)}: a gap of {first - last:.6g} s after {last:.10g} s, "
        f"where rows come every {row_s:.3g} s; what the cell did there is unknown. "
        f"Split the file there, or read one side of it: --to-s {last:.10g} or --from-s {first:.10g}. Where the logger "
        "writes on a change, and a current ran on there, give its first row as well as its last: the same current in "
        f"both.{summer}"
    )
