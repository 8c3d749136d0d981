"""Checks of residuals and currents, one array per continuous record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.errors import InputError
from aesi.numerics.typing import Array
from aesi.records.checked import numbers, row_words


def checked_record(residuals: Array) -> Array:
    """(n,) V as contiguous floats, missing values (NaN, infinity) as NaN; raises InputError for another shape, and
    for what are no numbers."""
    record = numbers(residuals, "residuals")
    if record.ndim != 1:
        raise InputError(f"residuals have shape {record.shape}; give one (n,) array a continuous record.")
    return np.where(np.isinf(record), np.nan, record)


def checked_current(current_a: Array, n: int) -> Array:
    """(n,) A, finite; raises InputError naming the first sample that is not."""
    current = np.ascontiguousarray(numbers(current_a, "current_a"))
    if current.shape != (n,):
        raise InputError(
            f"current_a has shape {current.shape}, the residuals ({n},); give one value a sample."
        )
    missing = np.flatnonzero(~np.isfinite(current))
    if missing.size:
        raise InputError(f"current_a has no value in {row_words(int(missing[0]))}; split the record there.")
    return current


def checked_records(residuals: Sequence[Array]) -> list[Array]:
    """`checked_record` of each; raises InputError for one row of numbers: it would be as many records of a sample."""
    if len(residuals) and all(np.ndim(record) == 0 for record in residuals):
        raise InputError(
            f"residuals is one row of {len(residuals)} numbers; give a list of records, as in [residuals], and the "
            "currents as another."
        )
    return [checked_record(r) for r in residuals]


def checked_currents(current_a: Sequence[Array] | None, records: Sequence[Array]) -> list[Array] | None:
    """`checked_current` of each record, or None; raises InputError where their number differs."""
    if current_a is None:
        return None
    if len(current_a) != len(records):
        raise InputError(f"there are {len(current_a)} currents for {len(records)} records; give one each.")
    return [checked_current(i, len(r)) for i, r in zip(current_a, records, strict=True)]
