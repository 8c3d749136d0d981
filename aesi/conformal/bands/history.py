"""The inputs of a regression: the raw window of residuals or features of it, and the current where it is used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self, get_args

import numpy as np

from aesi.numerics.drive import N_DRIVE_FEATURES, drive_features, drive_row
from aesi.numerics.files.restored import saved_count
from aesi.numerics.typing import Array, BoolArray, SavedState
from aesi.numerics.windows import N_LAGS, history_features, history_row, n_features, raw_lags, spans

View = Literal["features", "lags"]


@dataclass(frozen=True)
class History:
    """window : samples.  view : "features" (lags, rolling means, deviations, steps: `numerics.windows`),
    ready after N_LAGS samples; or "lags" (the last `window` residuals as they are), ready after `window`.
    with_current : the columns of `numerics.drive` follow those of the residuals."""

    window: int
    view: View
    with_current: bool

    @property
    def needed(self) -> int:
        """Number of samples before the first row."""
        return N_LAGS if self.view == "features" else self.window

    @property
    def n_history(self) -> int:
        """Number of columns that are made of residuals, V; they come first."""
        return n_features(self.window) if self.view == "features" else self.window

    @property
    def n_columns(self) -> int:
        """Number of columns of a row."""
        return self.n_history + (N_DRIVE_FEATURES if self.with_current else 0)

    def rows(self, residuals: Array, current_a: Array | None) -> tuple[Array, BoolArray]:
        """(features (n, p) of every sample of a record, (n,) True where the history suffices)."""
        if self.view == "features":
            rows, ready = history_features(residuals, self.window)
        else:
            rows, ready = raw_lags(residuals, self.window)
        if not self.with_current:
            return rows, ready
        assert current_a is not None
        return np.column_stack([rows, drive_features(current_a)]), ready

    def row(self, past: Array, recent_current: Array) -> Array | None:
        """The row after `past` (most recent last, at most the window), None where it is too short.

        recent_current : up to N_RECENT currents, A, the coming sample's own at the end; may be empty without.
        """
        if len(past) < self.needed:
            return None
        if self.view == "lags":
            out = past[::-1].copy()
        else:
            out = np.empty(n_features(self.window))
            history_row(past, spans(self.window), out)
        return np.concatenate([out, drive_row(recent_current)]) if self.with_current else out

    def to_state(self) -> SavedState:
        """The three fields."""
        return {"window": self.window, "view": self.view, "with_current": self.with_current}

    @classmethod
    def from_state(cls, state: SavedState) -> Self:
        """Inverse of `to_state`.  Raises ValueError for anything else."""
        view = state["view"]
        if view not in get_args(View):
            raise ValueError(f"view = {view!r} is not known")
        return cls(saved_count(state["window"], "window"), view, bool(state["with_current"]))
