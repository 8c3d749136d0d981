"""Which records train, which validate, and which test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from aesi.records.error_series import ErrorSeries

Role = Literal["train", "valid", "test"]
ROLES: tuple[Role, ...] = ("train", "valid", "test")


@dataclass(frozen=True, eq=False)
class HeldOutDrive:
    """A training record under physics that was fitted without some of its samples.

    rows : these samples.
    """

    series: ErrorSeries
    rows: slice


@dataclass(frozen=True)
class Split:
    """Records by role. The test records choose nothing: they are met once, by the model already chosen."""

    train: tuple[ErrorSeries, ...]
    valid: tuple[ErrorSeries, ...]
    test: tuple[ErrorSeries, ...]
