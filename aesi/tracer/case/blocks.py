"""Blocks of rows for cross-validation, and the folds (by block and by condition) in which they are left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.tracer.case.problem import InverseProblem

BLOCKS = 24
"""Number of blocks over all records, each left out in turn: enough of them for a sum of scores, and each long against
the correlation time of a model error. A convention."""
FEWEST_BLOCKS = 4
"""Fewest blocks that one record is cut into."""
SEEN_SHARE = 2.0 / 3.0
"""Share of the blocks, from the first on, that is kept in the fold "end", which leaves out the rest."""
MEASURED_BLOCKS = 6
"""Most blocks of a record of a measured cell, or as many as it has independent samples of the model error where these
are more: the error of such a cell's model has the longer correlation time."""
RANGES = 3
"""Number of ranges of RMS current, and of state of charge. The blocks of one range are left out together."""
WINDOW_S = 20.0
"""Length of the window, s, that tells an error within seconds from a lasting one: what differs from the window's
mean counts as an error within seconds. Its correlation time is 4 to 6 s on six development records; with windows of
60 s it is 7 to 10 s, since part of the slow drift is then counted in (`python -m aesi.bench.fast_error`)."""
DISTINCT_RATES = 1.1
"""Least ratio of the largest to the smallest mean RMS current of the ranges. Below it they count as one rate, as with a
current that never changes, and the partition "rate" is left out. A convention."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Short stretches of time, for means over seconds.

    of_row : (n,) number of each row's window.  row_duration_s : (n,) s, duration that each row stands for.
    """

    of_row: IntArray
    row_duration_s: Array

    @classmethod
    def within(cls, starts: IntArray, time_s: Array, row_duration_s: Array, length_s: float) -> Windows:
        """Windows of `length_s` (s) that do not cross blocks.

        starts : (b + 1,) first row of each block, then n.  time_s : (n,) s.
        """
        of_row = np.zeros(len(time_s), dtype=int)
        n_windows = 0
        for rows in _slices(starts):
            since = time_s[rows] - time_s[rows.start]
            of_row[rows] = n_windows + np.unique(np.floor(since / length_s), return_inverse=True)[1]
            n_windows = int(of_row[rows.stop - 1]) + 1
        return cls(of_row, row_duration_s)

    @cached_property
    def row_weight(self) -> Array:
        """(n,) weight of each row in the mean of its window: its share of the window's duration."""
        return np.asarray(
            self.row_duration_s / np.bincount(self.of_row, self.row_duration_s)[self.of_row], dtype=float
        )

    @cached_property
    def fast_dof(self) -> Array:
        """(n,) degrees of freedom of each row's deviation from the mean of its window: 1 - weight, so 0 for a window
        of one row."""
        return 1.0 - self.row_weight

    @cached_property
    def _first_rows(self) -> IntArray:
        """First row of each window."""
        return np.flatnonzero(np.diff(self.of_row, prepend=-1))

    def means(self, columns: Array) -> Array:
        """(n, m) for each row, the mean of each column (n, m) over the row's window."""
        weighted = columns * self.row_weight[:, None]
        return np.asarray(np.add.reduceat(weighted, self._first_rows, axis=0)[self.of_row])


@dataclass(frozen=True, eq=False)
class Blocks:
    """Contiguous blocks of the fitted rows, and the folds of a cross-validation.

    starts : (b + 1,) first row of each block, then the number of rows n.  record : (b,) number of each block's record.
    folds : partition -> folds, each a set of blocks. "block": one block each. "record", "rate", "charge": the blocks of
    one record, of one range of RMS current, of one range of state of charge, where there are several. "end": the last
    third, in one fold.
    compared : (n,) True for the rows that count in an error on unseen data, see `InverseProblem.compared`.
    windows : of `WINDOW_S` within each block; None where the model error has no separate part within seconds.
    """

    starts: IntArray
    record: IntArray
    folds: dict[str, tuple[tuple[int, ...], ...]]
    compared: BoolArray
    windows: Windows | None = None

    def __len__(self) -> int:
        return len(self.record)

    @property
    def rows(self) -> list[slice]:
        """Rows of each block."""
        return _slices(self.starts)

    @cached_property
    def of_row(self) -> IntArray:
        """(n,) block of each row."""
        return np.repeat(np.arange(len(self)), np.diff(self.starts))


def blocks_of(problem: InverseProblem) -> Blocks:
    """The blocks of all records, and their folds."""
    starts, record = _record_blocks(problem)
    windows = None
    if problem.two_scales:
        windows = Windows.within(starts, problem.time_s, problem.row_duration_s, WINDOW_S)
    return Blocks(starts, record, _folds(problem, _slices(starts), record), problem.compared, windows)


def _record_blocks(problem: InverseProblem) -> tuple[IntArray, IntArray]:
    """`Blocks.starts` and `Blocks.record`: as many blocks of each record as its share of the rows, but no fewer than
    `FEWEST_BLOCKS`, and of a measured cell no more than `MEASURED_BLOCKS` or its number of independent samples,
    whichever is larger."""
    total = len(problem.measured)
    starts: list[int] = []
    record: list[int] = []
    for i, rows in enumerate(problem.slices):
        length = rows.stop - rows.start
        pieces = max(FEWEST_BLOCKS, round(BLOCKS * length / total))
        if problem.coarse:
            pieces = min(pieces, max(MEASURED_BLOCKS, int(problem.independent[rows].sum())))
        starts += np.linspace(rows.start, rows.stop, pieces + 1).astype(int)[:-1].tolist()
        record += [i] * pieces
    return np.array([*starts, total]), np.array(record)


def _folds(
    problem: InverseProblem, rows_of: Sequence[slice], record: IntArray
) -> dict[str, tuple[tuple[int, ...], ...]]:
    """`Blocks.folds`.  rows_of : of each block.  record : (b,)."""
    every = range(len(record))
    current = np.concatenate([m.current_a for m in problem.fit_parts])
    rate = np.array([rms(current[rows]) for rows in rows_of])
    charge = np.array([np.mean(problem.declared_soc[rows]) for rows in rows_of])
    folds: dict[str, tuple[tuple[int, ...], ...]] = {"block": tuple((b,) for b in every)}
    if len(problem.records) > 1:
        folds["record"] = tuple(
            tuple(b for b in every if record[b] == k) for k in range(len(problem.records))
        )
    by_rate = _folds_by_range(rate)
    if _are_distinct([rate[list(blocks)] for blocks in by_rate]):
        folds["rate"] = by_rate
    folds["charge"] = _folds_by_range(charge)
    folds["end"] = (tuple(b for b in every if b >= round(SEEN_SHARE * len(record))),)
    return folds


def _slices(bounds: IntArray) -> list[slice]:
    """Rows between each two successive bounds (b + 1,)."""
    return [slice(int(a), int(b)) for a, b in pairwise(bounds)]


def _are_distinct(rates: Sequence[Array]) -> bool:
    """Whether the ranges have several rates.  rates : RMS current, A, of the blocks of each range."""
    means = [float(np.mean(r)) for r in rates]
    return max(means) > DISTINCT_RATES * min(means)


def _folds_by_range(of_block: Array) -> tuple[tuple[int, ...], ...]:
    """Blocks by `RANGES` ranges of a quantity (b,), with about as many blocks in each."""
    order = np.argsort(of_block, kind="stable")
    return tuple(tuple(sorted(part.tolist())) for part in np.array_split(order, RANGES) if len(part))
