"""Tree ensembles on normalised residuals: a linear quantile band supplies the location and scale.

    Q_tau(e | x) = m(x) + s(x) q_tau(x'),    [m - s/2, m + s/2] the linear quantile band                 (1)

x' holds the features divided by s, the logarithm of s, and the current as it is. Trees are constant in their
leaves: without (1) they would approximate a linear location-scale model by steps, and could give no interval beyond
the largest error of the calibration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from aesi.conformal.regressors.linear import LinearQuantiles
from aesi.conformal.regressors.model import FitTask, Kinds, QuantileModel, RegressorFit
from aesi.numerics.files.restored import LEAST_POSITIVE, saved_count, saved_number
from aesi.numerics.typing import Array, SavedState


@dataclass(frozen=True, eq=False)
class NormalisedQuantiles(QuantileModel):
    """line : m and s of (1), one pair of levels.  inner : q_tau, in units of s."""

    line: LinearQuantiles
    inner: QuantileModel
    n_history: int
    floor_v: float
    kind: ClassVar[str] = "normalised"

    @classmethod
    def fit(cls, task: FitTask, inner: RegressorFit) -> Self:
        """Fit the line, then `inner` on what it leaves."""
        outer = np.array(
            [task.levels[: len(task.levels) // 2].mean(), task.levels[len(task.levels) // 2 :].mean()]
        )
        line = LinearQuantiles.fit(replace(task, levels=outer))
        rows, middle, scale = _normalised(line, task.rows, task.n_history, task.floor_v)
        model = inner(replace(task, rows=rows, targets=(task.targets - middle) / scale))
        return cls(line, model, task.n_history, task.floor_v)

    def quantiles(self, rows: Array) -> Array:
        inside, middle, scale = _normalised(self.line, rows, self.n_history, self.floor_v)
        return np.asarray(middle[:, None] + scale[:, None] * self.inner.quantiles(inside))

    def check_columns(self, count: int) -> None:
        if self.n_history > count:
            raise ValueError(f"n_history is {self.n_history}, and a row has {count} columns")
        self.line.check_columns(count)
        self.inner.check_columns(count + 1)

    def to_state(self) -> SavedState:
        return {
            "line": self.line.to_state(),
            "inner_kind": self.inner.kind,
            "inner": self.inner.to_state(),
            "n_history": self.n_history,
            "floor_v": self.floor_v,
        }

    @classmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        return cls(
            LinearQuantiles.from_state(state["line"], kinds),
            kinds[state["inner_kind"]].from_state(state["inner"], kinds),
            saved_count(state["n_history"], "n_history"),
            saved_number(state["floor_v"], "floor_v", LEAST_POSITIVE),
        )


def _normalised(
    line: LinearQuantiles, rows: Array, n_history: int, floor_v: float
) -> tuple[Array, Array, Array]:
    """x', m and s of (1)."""
    pair = line.quantiles(rows)
    middle = 0.5 * (pair[:, 0] + pair[:, 1])
    scale = np.maximum(np.abs(pair[:, 1] - pair[:, 0]), floor_v)
    inside = np.empty((len(rows), rows.shape[1] + 1))
    inside[:, :n_history] = rows[:, :n_history] / scale[:, None]
    inside[:, n_history] = np.log(scale)
    inside[:, n_history + 1 :] = rows[:, n_history:]
    return inside, middle, scale
