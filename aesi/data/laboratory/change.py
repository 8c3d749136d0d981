"""One change of the laboratory's cell: the part of the simulation that it changes, and its values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from aesi.errors import DataError
from aesi.numerics.typing import Array

Values = Mapping[str, float]


def _nothing(parameters: Any, values: Values) -> None:
    """Leaves the parameters as they are."""


def _same_current(time_s: Array, current_a: Array, values: Values) -> Array:
    return current_a


def _same_voltage(time_s: Array, current_a: Array, voltage_v: Array, values: Values) -> Array:
    return voltage_v


@dataclass(frozen=True)
class Change:
    """One change. defaults : value name, with unit -> typical value."""

    id: str
    defaults: Values
    options: Mapping[str, Any] = field(default_factory=dict)
    alter: Callable[[Any, Values], None] = _nothing
    cell_current: Callable[[Array, Array, Values], Array] = _same_current
    terminal_voltage: Callable[[Array, Array, Array, Values], Array] = _same_voltage

    def complete(self, values: Values) -> dict[str, float]:
        """The defaults, replaced by the given values.  Raises DataError for an unknown name."""
        unknown = sorted(set(values) - set(self.defaults))
        if unknown:
            known = ", ".join(self.defaults)
            raise DataError(f"The change {self.id} has no value {unknown[0]!r}; it has {known}.")
        return {**self.defaults, **values}
