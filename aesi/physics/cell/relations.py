"""Constitutive relations: a constant, an expression in x, a table, and their scaled copies, sums and products.

Relations are frozen and hashable by value, so that results computed from them can be cached.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import numpy as np

from aesi.errors import CellError
from aesi.numerics.typing import Array
from aesi.physics.cell.expression import compile_expression
from aesi.records.checked import row_words

OCP_POINTS = 8193
"""Points of the tables in which the models look up potentials and electrolyte properties. Four times as many change the
voltage by less than 1e-4 mV RMS under the load of `aesi bench espm`. A combination without closed form is written to a
file at these points too, so that the models read the same numbers back."""

LEAST_TRANSPORT = 1e-3
"""Share of a diffusivity at half filling, or of a transport property of the salt at rest, that replaces values which
are not positive; a polynomial may have such values outside the range of its fit."""
WORKING_SPAN = (0.05, 2.0)
"""Concentrations of salt, relative to rest, at which cells work."""

Hashed = TypeVar("Hashed")
HASH = "_hash"


def hashed_once(kind: type[Hashed]) -> type[Hashed]:
    """Class decorator: a frozen dataclass whose hash by value is computed once. Each simulation looks up its model by
    value, and a cell is deeply nested.

    The hash is not pickled, since texts have another hash in each process.
    """
    by_value = kind.__hash__

    def kept_hash(self: Hashed) -> int:
        if HASH not in self.__dict__:
            self.__dict__[HASH] = by_value(self)
        return int(self.__dict__[HASH])

    def state(self: Hashed) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != HASH}

    kind.__hash__ = kept_hash  # type: ignore[method-assign, assignment]
    kind.__getstate__ = state  # type: ignore[method-assign, assignment]
    return kind


ADMISSIBLE = "a number, an expression in x or a table {'x': [...], 'y': [...]}"


@dataclass(frozen=True)
class Constant:
    """The same value everywhere."""

    value: float

    def __call__(self, x: Array) -> Array:
        """(n,) the value."""
        return np.full_like(np.asarray(x, dtype=float), self.value)


@dataclass(frozen=True)
class Expression:
    """An expression in x, as text; refused at construction if it holds anything but arithmetic."""

    text: str

    def __post_init__(self) -> None:
        compile_expression(self.text)

    def __call__(self, x: Array) -> Array:
        """(n,) the expression at x."""
        with np.errstate(all="ignore"):  # outside the fitted range; whoever needs finite values checks
            return np.asarray(compile_expression(self.text)(np.asarray(x, dtype=float)), dtype=float)


@hashed_once
@dataclass(frozen=True)
class LookupTable:
    """Linear interpolation between points; constant beyond the first and the last."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.x) != len(self.y) or len(self.x) < 2:
            raise CellError(f"a table needs x and y of one length >= 2, not {len(self.x)} and {len(self.y)}.")
        x, y = np.array(self.x), np.array(self.y)
        for name, column in (("x", x), ("y", y)):
            finite = np.isfinite(column)
            if not finite.all():
                row = int(np.argmin(finite))
                raise CellError(
                    f"{name} of a table is {column[row]:g} in {row_words(row)}; give finite numbers."
                )
        rises = np.diff(x) > 0.0
        if not rises.all():
            row = int(np.argmin(rises)) + 1
            raise CellError(
                f"x of a table does not rise to {x[row]:g} in {row_words(row)}; sort its rows, and give each x once."
            )

    def __call__(self, x: Array) -> Array:
        """(n,) interpolated."""
        return np.interp(np.asarray(x, dtype=float), *self._points)

    @cached_property
    def _points(self) -> tuple[Array, Array]:
        """(x, y) as arrays; cached, since a balance evaluates a potential hundreds of times."""
        return np.array(self.x), np.array(self.y)


@dataclass(frozen=True)
class Scaled:
    """`factor` times another relation."""

    base: Relation
    factor: float

    def __call__(self, x: Array) -> Array:
        """(n,) factor * base(x)."""
        return self.factor * self.base(x)


@dataclass(frozen=True)
class Sum:
    """Two relations added."""

    first: Relation
    second: Relation

    def __call__(self, x: Array) -> Array:
        """(n,) first(x) + second(x)."""
        return self.first(x) + self.second(x)


@dataclass(frozen=True)
class Product:
    """Two relations multiplied."""

    first: Relation
    second: Relation

    def __call__(self, x: Array) -> Array:
        """(n,) first(x) * second(x)."""
        return self.first(x) * self.second(x)


Relation = Constant | Expression | LookupTable | Scaled | Sum | Product


def scaled(relation: Relation, factor: float) -> Relation:
    """`factor` times `relation`, in the simplest form; the relation itself for a factor of one."""
    if factor == 1.0:
        return relation
    match relation:
        case Constant(value):
            return Constant(value * factor)
        case Scaled(base, already):
            return Scaled(base, already * factor)
        case _:
            return Scaled(relation, factor)


def relation(value: object, what: str) -> Relation:
    """The relation of a value in a BPX file: a number, text, or {"x": [...], "y": [...]}.

    Raises CellError naming `what`.
    """
    if isinstance(value, bool) or value is None:
        raise CellError(f"{what} is {value!r}; give {ADMISSIBLE}.")
    if isinstance(value, int | float):
        return Constant(float(value))
    try:
        if isinstance(value, str):
            return Expression(str(value))
        if isinstance(value, dict) and set(value) == {"x", "y"}:
            return LookupTable(_column(value, "x"), _column(value, "y"))
    except CellError as error:
        raise CellError(f"{what}: {error}") from None
    raise CellError(f"{what} is {type(value).__name__}; give {ADMISSIBLE}.")


def _column(table: Mapping[str, Any], name: str) -> tuple[float, ...]:
    """One column of a table.  Raises CellError for anything but a list of numbers."""
    values = table[name]
    if not isinstance(values, Sequence | np.ndarray) or isinstance(values, str):
        raise CellError(f"{name} of a table is {values!r}, and has to be a list of numbers.")
    numbers = []
    for value in values:
        try:
            if isinstance(value, bool):
                raise TypeError
            numbers.append(float(value))
        except (TypeError, ValueError):
            raise CellError(f"{name} of a table holds {value!r}, which is not a number.") from None
    return tuple(numbers)


def to_bpx(item: Relation, low: float = 0.0, high: float = 1.0) -> float | str | dict[str, list[float]]:
    """The relation as a value in a BPX file; a combination without closed form becomes a table on [low, high].

    The rows of such a table are the points of its own tables and, where it is curved between these, a uniform grid of
    `OCP_POINTS`.  Raises CellError where the combination is not finite inside.
    """
    match item:
        case Constant(value):
            return value
        case Expression(text):
            return text
        case LookupTable(x, y):
            return {"x": list(x), "y": list(y)}
        case _:
            closed = _as_text(item)
            if closed is not None:
                return closed
            grid = _knots(item)
            if not _straight(item):
                inside = grid[(low < grid) & (grid < high)]
                grid = np.union1d(inside, np.linspace(low, high, OCP_POINTS))
            values = without_poles(item(grid))
            if not np.isfinite(values).all():
                bad = grid[np.flatnonzero(~np.isfinite(values))[0]]
                raise CellError(
                    f"a relation is not finite at {bad:g}, between {low:g} and {high:g}, and cannot be written as a "
                    "table; give a table or a formula that holds there."
                )
            return {"x": grid.tolist(), "y": values.tolist()}


def without_poles(values: Array) -> Array:
    """(n,) values on a grid, with values at either end that are not finite replaced by their neighbours."""
    values = values.copy()
    values[0] = values[0] if np.isfinite(values[0]) else values[1]
    values[-1] = values[-1] if np.isfinite(values[-1]) else values[-2]
    return values


def _knots(item: Relation) -> Array:
    """(n,) the points of all tables in it, rising."""
    match item:
        case LookupTable(x, _):
            return np.array(x)
        case Scaled(base, _):
            return _knots(base)
        case Sum(first, second) | Product(first, second):
            return np.union1d(_knots(first), _knots(second))
        case _:
            return np.array([])


def _straight(item: Relation) -> bool:
    """True where the relation is linear between its knots and constant beyond them."""
    match item:
        case Constant() | LookupTable():
            return True
        case Scaled(base, _):
            return _straight(base)
        case Sum(first, second):
            return _straight(first) and _straight(second)
        case Product(first, second):
            either = isinstance(first, Constant) or isinstance(second, Constant)
            return either and _straight(first) and _straight(second)
        case _:
            return False


def _as_text(item: Relation) -> str | None:
    match item:
        case Constant(value):
            return f"{float(value)!r}"
        case Expression(text):
            return f"({text})"
        case LookupTable():
            return None
        case Scaled(base, factor):
            inner = _as_text(base)
            return None if inner is None else f"({float(factor)!r} * {inner})"
        case Sum(first, second):
            return _joined(first, " + ", second)
        case Product(first, second):
            return _joined(first, " * ", second)


def _joined(first: Relation, sign: str, second: Relation) -> str | None:
    left, right = _as_text(first), _as_text(second)
    return None if left is None or right is None else f"({left}{sign}{right})"


def value_at(item: Relation, x: float) -> float:
    """The value at a single x, equal to that for an array to the last digit, in a fifth of the time: root searches need
    thousands."""
    match item:
        case Constant(value):
            return value
        case Scaled(base, factor):
            return factor * value_at(base, x)
        case Sum(first, second):
            return value_at(first, x) + value_at(second, x)
        case Product(first, second):
            return value_at(first, x) * value_at(second, x)
        case Expression(text):
            number: Any = np.float64(x)
            with np.errstate(all="ignore"):
                return float(compile_expression(text)(number))
        case LookupTable():
            return float(item(np.asarray(x)))


@lru_cache(maxsize=16)
def _grid(low: float, high: float, points: int) -> Array:
    return np.linspace(low, high, points)


@lru_cache(maxsize=64)
def _leaf_values(item: Relation, low: float, high: float, points: int) -> Array:
    values = item(_grid(low, high, points))
    values = np.array(values)
    values.flags.writeable = False
    return values


def tabulated(item: Relation, low: float, high: float, points: int) -> Array:
    """(points,) values on a uniform grid; unchanged parts of a relation come from a cache."""
    match item:
        case Scaled(base, factor):
            return factor * tabulated(base, low, high, points)
        case Sum(first, second):
            return tabulated(first, low, high, points) + tabulated(second, low, high, points)
        case Product(first, second):
            return tabulated(first, low, high, points) * tabulated(second, low, high, points)
        case _:
            return _leaf_values(item, low, high, points)
