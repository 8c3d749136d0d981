"""What a conformal method has to supply: a raw band from the past, for a whole record and for one step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Self

from aesi.conformal.regressors.model import Kinds
from aesi.numerics.typing import Array, BoolArray, SavedState


@dataclass(frozen=True, eq=False)
class RawBand:
    """low, high : (n,) V.  ready : (n,) False where the band cannot be made (history too short)."""

    low: Array
    high: Array
    ready: BoolArray


class Band(ABC):
    """A fitted rule from the past to a raw band.

    `batch` and `row` agree: row k of `batch(residuals, current)` is `row(past, current[k - 3 : k + 1])`, `past` the
    residuals before k since the last missing one, at most the window.
    """

    kind: ClassVar[str]

    @property
    def needs_current(self) -> bool:
        """Whether the current is one of its inputs."""
        return False

    @abstractmethod
    def batch(self, residuals: Array, current_a: Array | None) -> RawBand:
        """The band of every sample of a record, (n,) V, from the residuals before it (NaN is missing) and the
        current (n,) A up to and at it; None where the band does not need it."""

    @abstractmethod
    def row(self, past: Array, recent_current: Array) -> tuple[float, float] | None:
        """The band after `past`: the finite residuals since the last missing one, at most the window,
        most recent last. recent_current : A, the coming sample's at the end. None where `past` is too short."""

    @abstractmethod
    def to_state(self) -> SavedState:
        """Everything `from_state` needs."""

    @classmethod
    @abstractmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        """Inverse of `to_state`; `kinds` holds the regressors that a band may rest on."""
