"""SPCI with the regressor of its paper: a quantile forest on raw lags, refitted along the record.

    [Q_t(alpha / 2), Q_t(1 - alpha / 2)],    Q_t a quantile regression forest of the residual on the `window` before it

In the paper the forest is refitted at every step, which at 10 Hz takes longer than the drive. Here it is refitted every
`REFIT` steps, at most `MOST_FORESTS` times per record, on the `HISTORY_WINDOWS` windows of residuals before the step,
at first those of the calibration. Rows in between are predicted from their own past. There is no factor on the width
and no adaptive step. The method is for comparison in the tables of a run only; no saved model uses it.

Xu & Xie, ICML 2023, doi:10.48550/arXiv.2212.03463; Meinshausen, J. Mach. Learn. Res. 7 (2006) 983.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from aesi.conformal.intervals import Intervals
from aesi.conformal.online.method import check_settings, marginal_interval
from aesi.conformal.online.records import checked_record, checked_records
from aesi.errors import FitError
from aesi.numerics.typing import Array

NAME = "spci_refitted"
REFIT = 500
"""Steps of the record between two forests; with MOST_FORESTS it bounds the time that a long record takes."""
MOST_FORESTS = 40
HISTORY_WINDOWS = 10
"""Residuals that a forest is grown on, in windows."""
TREES = 10
"""Trees, as in Xu and Xie's algorithm 1. Their depth of two is replaced by a least number of residuals in a leaf."""
MIN_LEAF_RESIDUALS = 10
"""Residuals in a leaf, at least: a convention."""
FEATURE_SHARE = 1 / 3
"""Share of the lags that a split may choose from, the usual one for regression."""


@dataclass(frozen=True)
class RefittedForest:
    """The method.  refit : steps between two forests."""

    name: str = NAME
    refit: int = REFIT

    def check(self, alpha: float, window: int) -> None:
        """See `Method.check`."""
        check_settings(alpha, window)

    def fit(
        self,
        residuals: Sequence[Array],
        alpha: float = 0.1,
        window: int = 200,
        rng: np.random.Generator | None = None,
        current_a: Sequence[Array] | None = None,
    ) -> RefittedIntervals:
        """The method with the end of the calibration residuals, one (n_i,) array per record, V. No current is used.

        Raises InputError and FitError as `Method.fit`, and FitError where no record holds two windows without a gap.
        """
        self.check(alpha, window)
        records = checked_records(residuals)
        parts = [
            part for record in records for part in np.split(record, np.flatnonzero(~np.isfinite(record)))
        ]
        runs = [part[np.isfinite(part)] for part in parts]  # each but a record's first begins with its gap
        longest = max(runs, key=len, default=np.empty(0))
        if len(longest) < 2 * window:
            raise FitError(
                f"{self.name} has {len(longest)} calibration residuals in a row and needs {2 * window}; give a "
                "shorter window."
            )
        seed = int((rng or np.random.default_rng(0)).integers(2**31))
        tail = longest[-HISTORY_WINDOWS * window :]
        return RefittedIntervals(alpha, window, self.refit, tail, marginal_interval(records, alpha), seed)


@dataclass(frozen=True, eq=False)
class RefittedIntervals:
    """A calibrated method, for replay only.  before_v : calibration residuals for the first forest, V.
    marginal_v : (low, high) V, the interval after a gap."""

    alpha: float
    window: int
    refit: int
    before_v: Array
    marginal_v: tuple[float, float]
    seed: int

    def intervals(self, residuals: Array, current_a: Array | None = None) -> Intervals:
        """The intervals along one continuous record (n,) V; NaN where the voltage is missing. See
        `Calibrated.intervals`."""
        residuals = checked_record(residuals)
        n, w = len(residuals), self.window
        low, high = np.full(n, self.marginal_v[0]), np.full(n, self.marginal_v[1])
        ready = np.zeros(n, dtype=bool)
        lags = sliding_window_view(np.concatenate([np.full(w, np.nan), residuals[:-1]]), w)
        step = max(self.refit, -(-n // MOST_FORESTS))
        for start in range(0, n, step):
            rows = np.arange(start, min(start + step, n))
            rows = rows[np.isfinite(lags[rows]).all(axis=1)]
            if len(rows):
                low[rows], high[rows] = self._forest_at(residuals[:start], start).quantiles(lags[rows])
                ready[rows] = True
        return Intervals(low, high, ready)

    def _forest_at(self, seen: Array, start: int) -> _Forest:
        """A forest on the last residuals before a step that follow a window without a gap.

        Where the record is still short, it is extended to the front by the calibration residuals.
        """
        known = np.concatenate([self.before_v, [np.nan], seen])  # no window spans two records
        windows = sliding_window_view(known, self.window + 1)
        without_gap = windows[np.isfinite(windows).all(axis=1)][-(HISTORY_WINDOWS - 1) * self.window :]
        return _Forest.grown(without_gap[:, :-1], without_gap[:, -1], self.alpha, self.seed + start)


@dataclass(frozen=True, eq=False)
class _Forest:
    """A grown forest and the levels asked of it."""

    forest: object
    levels: list[float]

    @classmethod
    def grown(cls, rows: Array, targets: Array, alpha: float, seed: int) -> _Forest:
        from quantile_forest import RandomForestQuantileRegressor

        forest = RandomForestQuantileRegressor(
            TREES,
            min_samples_leaf=MIN_LEAF_RESIDUALS,
            max_features=FEATURE_SHARE,
            max_samples_leaf=None,  # its default keeps one sample a leaf, and the bands cover far too little
            random_state=seed % 2**31,
        )
        return cls(forest.fit(rows, targets), [alpha / 2, 1 - alpha / 2])

    def quantiles(self, rows: Array) -> tuple[Array, Array]:
        """(n,) V, (n,) V."""
        # Meinshausen's weights: every tree counts alike, not every sample of a leaf.
        both = np.asarray(self.forest.predict(rows, quantiles=self.levels, weighted_leaves=True))  # type: ignore[attr-defined]
        return both[:, 0], both[:, 1]
