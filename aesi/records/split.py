"""Which records train, which validate, and which test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from aesi.numerics.typing import Array
from aesi.records.error_series import ErrorSeries

Role = Literal["train", "valid", "test"]
ROLES: tuple[Role, ...] = ("train", "valid", "test")


@dataclass(frozen=True, eq=False)
class HeldOutDrive:
    """The training records under physics that was fitted without some samples of one of them.

    series : that one.  place : its place among them.  rows : these samples.
    errors_v : the error of every training record under that physics, (n_i,) V each.
    """

    series: ErrorSeries
    place: int
    rows: slice
    errors_v: tuple[Array, ...]

    @classmethod
    def of(cls, train: Sequence[ErrorSeries], place: int, rows: slice) -> HeldOutDrive:
        """train : all training records under that physics."""
        return cls(train[place], place, rows, tuple(record.error_v for record in train))


@dataclass(frozen=True, eq=False)
class LeftOutDrives:
    """Training drives left out in turn: parts, as a search leaves them out, and drives, whole, where parts are less."""

    parts: tuple[HeldOutDrive, ...] = ()
    drives: tuple[HeldOutDrive, ...] = ()


@dataclass(frozen=True)
class Split:
    """Records by role. The test records choose nothing: they are met once, by the model already chosen."""

    train: tuple[ErrorSeries, ...]
    valid: tuple[ErrorSeries, ...]
    test: tuple[ErrorSeries, ...]
