"""Which records train, which validate, and which test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from aesi.records.error_series import ErrorSeries

Role = Literal["train", "valid", "test"]
ROLES: tuple[Role, ...] = ("train", "valid", "test")


@dataclass(frozen=True, eq=False)
class HeldOutDrive:
    """The training records under physics that was fitted without some samples of one of them.

    place : of that one.  rows : these samples.
    """

    train: tuple[ErrorSeries, ...]
    place: int
    rows: slice

    @property
    def series(self) -> ErrorSeries:
        """The record that the samples are of."""
        return self.train[self.place]


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
