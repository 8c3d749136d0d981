"""Checks of a caller's rows of numbers: the result is an array, or an error of one sentence."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from numbers import Real
from typing import ParamSpec, TypeGuard, TypeVar

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import DataError, InputError, in_words
from aesi.numerics.typing import Array, ComplexArray
from aesi.over_time import stamp

P = ParamSpec("P")
R = TypeVar("R")
LONGEST_STEP_S = 365 * 24 * SECONDS_PER_HOUR
"""Between two rows: a year. A convention: no test stands still for longer, and times in nanoseconds do."""

HIGHEST_PLAIN_VOLT = 1000.0
"""A median voltage above this is in millivolts."""


def of_columns(function: Callable[P, R]) -> Callable[P, R]:
    """The function, which raises InputError, with how to call it, where a record or a table stands for its columns."""
    taken = signature(function)
    needed = [one.name for one in taken.parameters.values() if one.default is one.empty]
    first = int(needed[0] == "self")
    called = function.__qualname__.removesuffix(".__init__")
    words = ", ".join(
        f"data.{name}" if name.endswith(("_s", "_a", "_v")) else name for name in needed[first:]
    )

    @wraps(function)
    def told(*args: P.args, **named: P.kwargs) -> R:
        given = [
            one
            for one in (*args[first:], *named.values())
            if hasattr(one, "columns") or hasattr(one, "time_s")
        ]
        if given:
            raise InputError(
                f"{called} takes columns, not an object of type {type(given[0]).__name__}; give them, as in "
                f"{called}({words})."
            )
        return function(*args, **named)

    return told


def numbers(values: object, name: str) -> Array:
    """Any sequence of numbers as a float64 array of its shape.

    name : how the sentence calls it.
    Raises DataError for what conversion would refuse without saying which (text), or take for other numbers (truth
    values; dates, whose unit is the library's own; complex ones; what is masked).
    """
    if np.ma.isMaskedArray(values):
        masked = np.argwhere(np.atleast_1d(np.ma.getmaskarray(values)))
        if len(masked):
            raise DataError(
                f"{name} is masked in {row_words(int(masked[0, 0]))}; drop or fill what is masked first."
            )
    try:
        # The column's own type first: dates with a time zone, and truth values with gaps, become objects in numpy.
        kind = getattr(getattr(values, "dtype", None), "kind", "O")
        kind = np.asarray(values).dtype.kind if kind == "O" else kind
    except ValueError:  # numpy's word for rows within a row that differ in length
        raise DataError(f"{name} holds rows of several lengths; give one row of numbers.") from None
    if kind == "b" or _has_truth_value(values):
        raise DataError(
            f"{name} holds truth values; give numbers, as np.where(on, 2.5, 0.0) does for 2.5 where on."
        )
    if kind in "mM":
        raise DataError(
            f"{name} holds dates or durations; give numbers, as (dates - dates.min()) / np.timedelta64(1, 's') does "
            "in seconds."
        )
    if kind == "c":
        raise DataError(f"{name} holds complex numbers; give real ones.")
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise DataError(f"{name} holds {in_words(_first_other(values))}, which is not a number.") from None
    except OverflowError:
        raise DataError(
            f"{name} holds a whole number of more than 308 digits, which no float holds; correct it."
        ) from None


def complex_numbers(values: object, name: str) -> ComplexArray:
    """Any sequence of numbers, real or complex, as a complex array of its shape.

    name : how the sentence calls it.  Raises DataError as `numbers` does.
    """
    try:
        given = np.asarray(values)
    except ValueError:  # rows that differ in length, which `numbers` words
        return numbers(values, name).astype(complex)
    if given.dtype.kind == "c" and not np.ma.is_masked(values):
        return given.astype(complex)
    return numbers(values, name).astype(complex)


def check_row(values: Array, name: str) -> None:
    """Raises DataError for what is no row, and for the first value of it that is not finite."""
    if values.ndim != 1:
        raise DataError(f"{name} has the shape {values.shape}; give one row of numbers.")
    wrong = ~np.isfinite(values)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise DataError(
            f"{name} is {values[row]:g} in {row_words(row)}; drop or fill what is not finite first."
        )


def check_times(time_s: Array, name: str) -> None:
    """Raises DataError for the first stamp that is not after the one before it, or more than LONGEST_STEP_S after."""
    steps = np.diff(time_s)
    still = steps <= 0.0
    if still.any():
        row = int(np.argmax(still)) + 1
        raise DataError(
            f"{name} does not increase at {stamp(time_s[row])} s ({row_words(row)}); sort or drop duplicate stamps."
        )
    if steps.size and steps.max() > LONGEST_STEP_S:
        row = int(np.argmax(steps > LONGEST_STEP_S)) + 1
        raise DataError(
            f"{name} has a step of {steps[row - 1]:.4g} s before {row_words(row)}, longer than a year "
            f"({LONGEST_STEP_S:.4g} s); time has to be in seconds."
        )


def check_plain_volts(voltage_v: Array, place: Callable[[int], str]) -> None:
    """Raises DataError, with the first row, for voltages that are plainly in millivolts.

    voltage_v : (n,) V, NaN where it is unknown.  place : row from 0 -> how the sentence calls it.
    """
    known = voltage_v[np.isfinite(voltage_v)]
    if known.size and np.median(known) > HIGHEST_PLAIN_VOLT:
        row = int(np.argmax(voltage_v > HIGHEST_PLAIN_VOLT))
        raise DataError(
            f"{place(row)}: {voltage_v[row]:.6g} V is plainly in mV; "
            "give it in V, or declare it: --unit voltage_v=mV."
        )


def checked_dt(dt_s: object) -> float:
    """A time step, s.  Raises InputError for what is no positive number."""
    if not (is_finite_number(dt_s) and dt_s > 0.0):
        raise InputError(f"dt_s = {in_words(dt_s)} has to be a positive number of seconds.")
    return float(dt_s)


def check_whole_number(name: str, value: object, least: int, most: float = np.inf) -> None:
    """Raises InputError where an argument is no whole number from `least` to `most`."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not least <= value <= most:  # type: ignore[operator]
        upper = f" up to {most:.0f}" if np.isfinite(most) else ""
        raise InputError(f"{name} = {in_words(value)} is not a whole number from {least}{upper}.")


def is_one_number(value: object) -> bool:
    """Whether an argument is one number, of Python or numpy; NaN and infinity are, a truth value and a list are not."""
    given = np.asarray(value)
    return given.ndim == 0 and given.dtype.kind in "iuf"


def is_finite_number(value: object) -> TypeGuard[float]:
    """Whether a single argument is a number, and finite; a truth value is none."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return False
    try:
        return bool(np.isfinite(float(value)))
    except OverflowError:  # a whole number that no float holds
        return False


def row_words(row: int) -> str:
    """How a sentence calls a row: as readers and tables do, not as an index.

    row : from 0.
    """
    return f"row {row + 1}, counted from 1"


def _has_truth_value(values: object) -> bool:
    """Whether a list, or a column of objects, holds one among its numbers, which numpy would take for 0 or 1."""
    if getattr(getattr(values, "dtype", None), "kind", "O") != "O":
        return False
    return any(isinstance(value, bool | np.bool_) for value in np.asarray(values, dtype=object).ravel())


def _first_other(values: object) -> object:
    for value in np.asarray(values, dtype=object).ravel():
        try:
            float(value)
        except (TypeError, ValueError):
            return value
    return values
