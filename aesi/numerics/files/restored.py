"""Checks of a saved part as it is read back. A file may hold anything, so that each part checks what it rests on.

`from_dict` of a part reads within `reading_back`. What it is made of raises any ValueError, and no sentence of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from aesi.errors import InputError
from aesi.numerics.typing import Array

LARGEST = float(np.finfo(float).max)
"""Bound of what has to be finite."""
LEAST_POSITIVE = float(np.finfo(float).tiny)
"""Bound of what has to be positive."""


@contextmanager
def reading_back(part: str, raised: type[InputError] = InputError) -> Iterator[None]:
    """Turns whatever the content of a saved part (its name, for the sentence) raises into one sentence of `raised`;
    those of `raised` stay as they are."""
    try:
        yield
    except raised:
        raise
    except KeyError as error:
        raise raised(
            f"the saved {part} cannot be read back: it lacks {error}; save the model again."
        ) from None
    except (TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        cause = str(error).rstrip(".")
        raise raised(f"the saved {part} cannot be read back: {cause}; save the model again.") from None


def saved_array(
    values: object,
    name: str,
    shape: tuple[int | None, ...],
    low: float = -LARGEST,
    high: float = LARGEST,
) -> Array:
    """The numbers of a saved array, or of the lists that it became in JSON.

    shape : None for a dimension of any length.  low, high : within which each number lies.
    Raises ValueError for others, and for what is no array of numbers.
    """
    given = np.asarray(values)
    if given.dtype.kind not in "iuf":
        raise ValueError(f"{name} holds what is no number")
    if len(given.shape) != len(shape) or any(
        n not in (None, m) for n, m in zip(shape, given.shape, strict=True)
    ):
        asked = ", ".join("any" if n is None else str(n) for n in shape)
        raise ValueError(f"{name} has the shape {given.shape} in place of ({asked})")
    numbers = np.asarray(given, dtype=float)
    wrong = ~((numbers >= low) & (numbers <= high))  # this way round, NaN is wrong too
    if wrong.any():
        raise ValueError(f"{name} holds {numbers[wrong][0]:g}, which cannot be")
    return numbers


def saved_number(value: object, name: str, low: float = -LARGEST, high: float = LARGEST) -> float:
    """`saved_array` of a single number."""
    return float(saved_array(value, name, (), low, high))


def saved_count(value: object, name: str, least: int = 1) -> int:
    """A saved whole number of at least `least`.  Raises ValueError for others."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise ValueError(f"{name} is {value!r}, no whole number from {least} on")
    return int(value)
