"""The resistance with which a cell answers a step of the current within seconds, over the operating range.

It tells contacts from kinetics, and both from what is slower: contacts have the same resistance at any current, and
slow kinetics a lower one at a larger current.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aesi.numerics.blocks import block_means
from aesi.numerics.typing import Array, BoolArray

WITHIN_S = 5.0
"""Time after a step of the current over which its response is summed, s. A convention: with it a channel that lags by a
second or two shows the same resistance, and little of it is diffusion."""
LONGEST_ROW_S = 2.5
"""Longest row, s: of longer ones fewer than two are within `WITHIN_S`."""
SHORTEST_ROW_S = 1.0
"""Length to which shorter rows are averaged, s."""
STEP_SHARE = 0.05
"""Least change of the current from row to row that counts as a step, as a share of the range of the current. A
convention."""
LEAST_STEPS = 25
"""Fewest steps in a bin, five for each of the five rows of a second that its fit sums over. A convention."""
LARGEST_ERROR = 0.1
"""Largest standard error of a resistance, as a share of it; a less certain one is left out. A convention."""
SOC_EDGES = np.linspace(0.0, 1.0, 11)
CURRENT_BINS = 8
"""Number of equal bins over the range of the current. A convention, as are tenths of the state of charge."""
MEASURED = "measured"


@dataclass(frozen=True, eq=False)
class StepResistance:
    """Resistances in bins of one variable.

    x : (bins,) mean of the variable over the steps in each bin.  ohm : name of a voltage -> (bins,) ohm, NaN where the
    data do not determine it.
    """

    x: Array
    ohm: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class CurrentSteps:
    """Changes from row to row of one or more records that have as many rows within `WITHIN_S`.

    change_a : (n, lags) A, of the current in a row and in the rows before it.  change_v : name of a voltage -> (n,) V.
    current_a, soc : (n,) A and 0 to 1, means of both ends of the row.  is_step : (n,) whether the current steps in it.
    """

    change_a: Array
    change_v: Mapping[str, Array]
    current_a: Array
    soc: Array
    is_step: BoolArray

    @classmethod
    def of(
        cls, time_s: Array, current_a: Array, soc: Array, voltages_v: Mapping[str, Array]
    ) -> CurrentSteps | None:
        """The changes in one record; None where its rows are too long or too few, or its current is constant.

        time_s, current_a, soc : (n,) s, A (discharge positive), 0 to 1.  voltages_v : name -> (n,) V. They are NaN
        where a model cannot be simulated, and so is the state of charge where none can.
        """
        time, table = _averaged(time_s, np.column_stack([current_a, soc, *voltages_v.values()]))
        rows_s = np.diff(time)
        row_s = float(np.median(rows_s)) if len(rows_s) else np.inf
        lags = round(WITHIN_S / row_s) if row_s <= LONGEST_ROW_S else 0
        span_a = float(np.ptp(table[:, 0]))
        if not lags or len(rows_s) < lags or span_a == 0.0:
            return None
        changes = np.diff(table, axis=0)
        uneven = np.abs(rows_s - row_s) > 0.5 * row_s
        uneven_before = np.convolve(uneven, np.ones(lags, dtype=int))[lags - 1 : len(uneven)]
        here = np.arange(lags - 1, len(changes))[uneven_before == 0]
        middle = 0.5 * (table[1:] + table[:-1])[here]
        return cls(
            np.column_stack([changes[here - lag, 0] for lag in range(lags)]),
            {name: changes[here, 2 + j] for j, name in enumerate(voltages_v)},
            middle[:, 0],
            middle[:, 1],
            np.abs(changes[here, 0]) >= STEP_SHARE * span_a,
        )

    @classmethod
    def together(cls, records: Sequence[CurrentSteps]) -> CurrentSteps:
        """The changes in those of one or more records whose number of rows within `WITHIN_S` is the commonest."""
        lags = Counter(one.change_a.shape[1] for one in records).most_common(1)[0][0]
        alike = [one for one in records if one.change_a.shape[1] == lags]
        return cls(
            np.concatenate([one.change_a for one in alike]),
            {name: np.concatenate([one.change_v[name] for one in alike]) for name in alike[0].change_v},
            *(
                np.concatenate([getattr(one, name) for one in alike])
                for name in ("current_a", "soc", "is_step")
            ),
        )

    def by_soc(self) -> StepResistance:
        """The resistances in tenths of the state of charge."""
        return self._in_bins(self.soc, SOC_EDGES)

    def by_current(self) -> StepResistance:
        """The resistances in equal bins of the current."""
        low, high = float(self.current_a.min()), float(self.current_a.max())
        return self._in_bins(self.current_a, np.linspace(low, high, CURRENT_BINS + 1))

    def _in_bins(self, x: Array, edges: Array) -> StepResistance:
        number = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
        bins = [(number == k) & np.isfinite(x) for k in range(len(edges) - 1)]
        filled = [inside for inside in bins if np.count_nonzero(inside & self.is_step) >= LEAST_STEPS]
        return StepResistance(
            np.array([np.mean(x[inside & self.is_step]) for inside in filled]),
            {
                name: np.array([_resistance_ohm(self.change_a[inside], change[inside]) for inside in filled])
                for name, change in self.change_v.items()
            },
        )


def _resistance_ohm(change_a: Array, change_v: Array) -> float:
    """Minus the sum of the coefficients of a least-squares fit of the changes of a voltage (n,) to those of the current
    (n, lags) and a constant drift; NaN where it is not determined."""
    known = np.isfinite(change_v)
    design = np.column_stack([change_a[known], np.ones(np.count_nonzero(known))])
    if np.linalg.matrix_rank(design) < design.shape[1]:
        return np.nan
    covariance = np.linalg.inv(design.T @ design)
    coefficients = covariance @ (design.T @ change_v[known])
    left_v = change_v[known] - design @ coefficients
    sums = np.append(np.ones(change_a.shape[1]), 0.0)
    ohm = -float(sums @ coefficients)
    variance = float(left_v @ left_v) / max(len(left_v) - len(sums), 1)
    error = float(np.sqrt(variance * (sums @ covariance @ sums)))
    return ohm if error <= LARGEST_ERROR * abs(ohm) else np.nan


def _averaged(time_s: Array, table: Array) -> tuple[Array, Array]:
    """(times, table), with rows that are shorter than `SHORTEST_ROW_S` averaged to that length."""
    if len(time_s) < 2 or float(np.median(np.diff(time_s))) >= 0.75 * SHORTEST_ROW_S:
        return time_s, table
    number = np.floor((time_s - time_s[0]) / SHORTEST_ROW_S)
    starts = np.flatnonzero(np.diff(number, prepend=-1.0))
    return time_s[0] + (number[starts] + 0.5) * SHORTEST_ROW_S, block_means(table, starts)
