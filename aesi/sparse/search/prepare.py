"""Training and validation records prepared for a search: checked, and without constant or redundant inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.records import ErrorSeries, Split
from aesi.records.checked import row_words
from aesi.sparse.terms.inputs import same_step, with_inputs
from aesi.sparse.terms.library import Library


def prepared_series(
    split: Split, inputs: tuple[str, ...] | None, library: Library | None
) -> tuple[tuple[ErrorSeries, ...], tuple[ErrorSeries, ...], tuple[str, ...]]:
    """(training records, validation records, a sentence for each input that was left out).

    inputs : names; None takes those of the records. The inputs of a given `library` take precedence.
    Raises DataError without a training record, where the training error, all inputs or an input of a given library are
    constant, where the validation error is zero, and for a record that is too short, sampled otherwise, or not finite.
    """
    if not split.train:
        raise DataError("there are no training records.")
    notes: tuple[str, ...] = ()
    names = inputs or split.train[0].input_names
    if library is not None:
        names = library.variables[1:]
    train = [with_inputs(record, names) for record in split.train]
    for record in train:
        _check_record(record, train[0].dt_s)
    if np.ptp(np.concatenate([record.error_v for record in train])) == 0:
        raise DataError("the voltage error is constant over the training records: there is nothing to learn.")
    if library is None:
        names, notes = _useful_inputs(train)
    else:
        _check_varying(train)
    valid = [with_inputs(record, names) for record in split.valid]
    for record in valid:
        _check_record(record, train[0].dt_s)
    # The first sample is given; the loss is a share of the squares of the others, so that these must not be zero.
    if valid and not any(record.error_v[1:].any() for record in valid):
        raise DataError(
            "the voltage error is zero over the validation records, so that no share of it can be told; validate on "
            "measured records, or on none."
        )
    return tuple(with_inputs(record, names) for record in train), tuple(valid), notes


def _check_record(record: ErrorSeries, dt_s: float) -> None:
    """Raises DataError for a record that is too short, sampled otherwise, or not finite."""
    if len(record) < 3:
        raise DataError(f"{record.name}: {len(record)} samples are too few; a record needs at least 3.")
    if not same_step(record.dt_s, dt_s):
        raise DataError(
            f"{record.name} is sampled every {record.dt_s:g} s, the first record every {dt_s:g} s."
        )
    for name, column in zip(("error_v", *record.input_names), variables(record).T, strict=True):
        if not np.isfinite(column).all():
            k = int(np.flatnonzero(~np.isfinite(column))[0])
            raise DataError(
                f"{record.name}: {name} is not a number in {row_words(k)}; cut or repair the record."
            )


def _is_constant(column: Array) -> bool:
    return bool(np.ptp(column) <= 1e-12 * np.abs(column).max())


def _check_varying(train: Sequence[ErrorSeries]) -> None:
    """Raises DataError for an input that is constant over the training records."""
    for name, column in zip(train[0].input_names, np.vstack([one.inputs for one in train]).T, strict=True):
        if _is_constant(column):
            raise DataError(
                f"{name} is constant over the training records and has no range to be scaled by; build the library "
                "without it."
            )


def _useful_inputs(train: Sequence[ErrorSeries]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """(names of inputs that vary and do not repeat an earlier one up to scaling, notes on the others)."""
    columns = np.vstack([record.inputs for record in train])
    kept: dict[str, Array] = {}
    notes = []
    for name, column in zip(train[0].input_names, columns.T, strict=True):
        if _is_constant(column):
            notes.append(f"{name} is constant over the training records; its terms were left out.")
            continue
        unit = (column - column.min()) / np.ptp(column)
        twin = next((other for other, known in kept.items() if _repeats(unit, known)), None)
        if twin is not None:
            notes.append(f"{name} repeats {twin} up to scale; its terms were left out.")
            continue
        kept[name] = unit
    if not kept:
        raise DataError(
            "every input is constant over the training records, as where they rest: there is nothing to learn from; "
            "train on records with a load."
        )
    return tuple(kept), tuple(notes)


def _repeats(unit: Array, known: Array) -> bool:
    """Whether two columns from 0 to 1 are the same, or one is the other upside down."""
    return any(np.allclose(each, known, rtol=0, atol=1e-12) for each in (unit, 1.0 - unit))


def variables(record: ErrorSeries) -> Array:
    """(n, 1 + n_inputs) error and inputs of a record, the error first."""
    return np.column_stack([record.error_v, record.inputs])
