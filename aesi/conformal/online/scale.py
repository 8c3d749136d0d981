"""The factor on the half-width of the raw band that calibrates it, for each range of the current."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from aesi.numerics.files.restored import saved_array
from aesi.numerics.quantiles import conformal_quantile
from aesi.numerics.typing import Array, IntArray, SavedState

GROUP_LEVELS = (0.05, 0.2, 0.4, 0.6, 0.8, 0.95)
"""Quantiles of the calibration currents that separate the groups: rest, mild and hard use either way."""
CONSTANT_SHARE = 0.05
"""Share of the rows, as of the smallest group, from which a single current is a group of its own, such as rest. All
but constant there, a voltage that is written in millivolts is hit nearly always, and in one group with charging it pays
for the misses of that. Records of which 20, 10 and 5 % are driven by currents of either sign alike, under errors that
grow with them (spci_boosted at 90 %): charging is covered 91.2, 91.6 and 91.4 %, in one group with rest 85.1, 79.8 and
69.5; discharging 90.9, 90.3 and 91.5, and 92.4, 92.6 and 96.0."""
ROUND_OFF = 1e-14
"""Share by which a factor is rounded up. It is the score of a residual, and those that equal this one, of which rounded
residuals have many, would else be left out by round-off: of residuals in steps of 1 mV a constant band at 70 % held 58
to 59 % in three draws, and holds 78 to 80."""
ENOUGH_SCORES = 200
"""Fewest held-out samples for a group to be scaled by its own scores; a smaller one is scaled by all."""


@dataclass(frozen=True, eq=False)
class Scale:
    """edges_a : (n_groups - 1,) A, increasing.  log_ratio : (n_groups,) log of the factor on the half-width."""

    edges_a: Array
    log_ratio: Array

    @classmethod
    def none(cls) -> Self:
        """Factor one, whatever the current."""
        return cls(np.empty(0), np.zeros(1))

    @classmethod
    def fit(cls, scores: Array, alpha: float, current_a: Array | None) -> Self:
        """scores : (n,) |e - middle| / half-width of held-out samples.  current_a : (n,) A, or None for one
        group. The factor is the conformal quantile of the scores."""
        log_ratio_of_all = _log_factor(scores, alpha)
        if current_a is None:
            return cls(np.empty(0), np.array([log_ratio_of_all]))
        edges = _edges(current_a)
        scale = cls(edges, np.full(len(edges) + 1, log_ratio_of_all))
        groups = scale.groups(current_a)
        for g in range(len(edges) + 1):
            own = scores[groups == g]
            if own.size >= max(ENOUGH_SCORES, 1 / alpha):
                scale.log_ratio[g] = _log_factor(own, alpha)
        return scale

    @property
    def needs_current(self) -> bool:
        """True where there is more than one group."""
        return self.edges_a.size > 0

    def groups(self, current_a: Array) -> IntArray:
        """(n,) group of each current."""
        return np.searchsorted(self.edges_a, current_a).astype(np.int64)

    def to_state(self) -> SavedState:
        """Edges and factors."""
        return {"edges_a": self.edges_a, "log_ratio": self.log_ratio}

    @classmethod
    def from_state(cls, state: SavedState) -> Self:
        """Inverse of `to_state`.  Raises ValueError for anything else."""
        edges = saved_array(state["edges_a"], "edges_a", (None,))
        if (np.diff(edges) <= 0.0).any():
            raise ValueError("edges_a does not increase")
        return cls(edges, saved_array(state["log_ratio"], "log_ratio", (len(edges) + 1,), -np.inf))


def _log_factor(scores: Array, alpha: float) -> float:
    """Log of the factor that the scores ask for; minus infinity where they are zero, as in a rest of constant voltage
    (`initial_log_ratio`)."""
    with np.errstate(divide="ignore"):
        return float(np.log(conformal_quantile(scores, alpha))) + ROUND_OFF


def _edges(current_a: Array) -> Array:
    """(n_edges,) A, increasing, between the groups of these currents, with one on either side of each that is that of
    CONSTANT_SHARE of the rows or more."""
    values, rows = np.unique(current_a, return_counts=True)
    constant = values[rows >= CONSTANT_SHARE * len(current_a)]
    # A current at an edge is in the group below it.
    return np.unique([*np.quantile(current_a, GROUP_LEVELS), *constant, *np.nextafter(constant, -np.inf)])
