"""The interface of a conformal method: a raw band from past residuals, for a whole record and for one step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Self

from aesi.conformal.regressors.model import Kinds
from aesi.numerics.typing import Array, BoolArray, SavedState


@dataclass(frozen=True, eq=False)
class RawBand:
    """An uncalibrated band.  low, high : (n,) V.  ready : (n,) False where the history is too short for a band."""

    low: Array
    high: Array
    ready: BoolArray


class Band(ABC):
    """A fitted rule that makes a raw band from past residuals.

    `batch` and `row` agree: row k of `batch(residuals, current)` is `row(past, current[k - 3 : k + 1])`, with `past`
    the residuals before k since the last missing one, at most `window` of them.
    """

    kind: ClassVar[str]

    @property
    def needs_current(self) -> bool:
        """Whether the current is one of its inputs."""
        return False

    @abstractmethod
    def batch(self, residuals: Array, current_a: Array | None) -> RawBand:
        """The bands of all samples of a record. Each uses the residuals (n,) V before its sample (NaN where missing)
        and the currents (n,) A up to and at it.

        current_a : None where `needs_current` is False.
        """

    @abstractmethod
    def row(self, past: Array, recent_current: Array) -> tuple[float, float] | None:
        """(low, high) V of the next sample; None where `past` is too short.

        past : finite residuals since the last missing one, V, at most `window`, most recent last.  recent_current : A,
        with that of the next sample at the end.
        """

    @abstractmethod
    def to_state(self) -> SavedState:
        """Everything `from_state` needs."""

    @classmethod
    @abstractmethod
    def from_state(cls, state: SavedState, kinds: Kinds) -> Self:
        """Inverse of `to_state`; `kinds` holds the regressors that a band may rest on.  Raises ValueError, or KeyError,
        for anything else."""
