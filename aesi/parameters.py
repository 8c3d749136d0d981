"""A physical parameter, declared once: default, unit, bounds and where the range comes from.

The check, the box of a fit, the range of a search and the table in the documentation all read this record.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from aesi.errors import ParameterError, did_you_mean, in_words


@dataclass(frozen=True)
class Spread:
    """Error of a declared parameter in cell files: standard deviations, of the natural logarithm where the parameter is
    logarithmic.

    tight : in a careful parametrisation of this very cell; None where the parameter is fixed there.
    loose : in a parametrisation of another cell of the same make, or an unchecked one; None where it is fixed even
    there.  source : of the two values.
    """

    tight: float | None
    loose: float | None
    source: str


@dataclass(frozen=True)
class Parameter:
    """One scalar parameter.

    default : a typical value where the effect is present.
    unit : text that stands behind the value; "dimensionless" for a plain number, which SI's "1" becomes.
    bounds : (smallest, largest) value, in `unit`.  source : of the bounds.
    log : True for a logarithmic scale in fits and searches.
    even : True where the voltage depends on its square (a standard deviation). A fit then moves the square, since the
    slope over the parameter itself vanishes at zero.
    neutral : value at which the effect vanishes; None where there is none.
    expected : prior standard deviation of the distance from neutral (or from the default; of the logarithm where
    `log`); None for a uniform prior within the bounds.
    capacity_power : `expected` and `spread` hold for a cell of 1 Ah and scale with this power of the capacity: 1 for a
    current, -1 for a resistance.
    low_is_limit : True where the lower bound stands for zero, which a logarithmic scale does not reach. Zero may then
    be given, and a fit that ends on this bound is an ordinary result.
    spread : error of cell files in this parameter; hypotheses about other effects may move it within this spread.
    counted : relation of a value to the one that the cell file declares: the value `itself`, `added` to it, or a
    `share` of it.
    shift_of : name of the declared quantity that it shifts, with its unit (`declared_degc`), as a discovery writes it;
    empty where there is none.
    """

    default: float
    unit: str
    bounds: tuple[float, float]
    source: str
    log: bool = False
    even: bool = False
    neutral: float | None = None
    description: str = ""
    expected: float | None = None
    capacity_power: int = 0
    low_is_limit: bool = False
    spread: Spread | None = None
    counted: Literal["itself", "added", "share"] = "itself"
    shift_of: str = ""

    def __post_init__(self) -> None:
        low, high = self.bounds
        if self.unit == "1":
            object.__setattr__(self, "unit", "dimensionless")
        if not isinstance(self.unit, str) or not re.search(r"[^\W\d_]|%", self.unit):
            raise ParameterError(
                f"the unit {self.unit!r} is none; give it as text, such as 'ohm', and 'dimensionless' for a plain "
                "number."
            )
        if not (math.isfinite(low) and math.isfinite(high)):
            raise ParameterError(
                f"bounds [{low:g}, {high:g}] {self.unit} have no end; give the smallest and the largest value that a "
                "fit may try."
            )
        if not low < high:
            raise ParameterError(f"bounds [{low:g}, {high:g}] {self.unit} are empty; give low < high.")
        if self.log and low <= 0:
            raise ParameterError(
                f"a logarithmic scale needs a positive lower bound, not {low:g} {self.unit}."
            )
        if self.even and (self.log or low < 0):
            raise ParameterError(
                f"a fit moves the square of what is even: give linear bounds from zero on, not [{low:g}, {high:g}] "
                f"{self.unit}{' on a logarithmic scale' if self.log else ''}."
            )
        if self.log and self.capacity_power:
            raise ParameterError(
                "the standard deviation of a logarithm is that of a cell of any size; leave capacity_power out."
            )
        own = "Give one within, or wider bounds"
        self.check("default", self.default, own)
        # A logarithmic scale does not reach the zero at which an effect may vanish.
        if self.neutral is not None and not (self.log and self.neutral == 0.0):
            self.check("neutral", self.neutral, own)

    def check(self, name: str, value: float, otherwise: str = "") -> float:
        """Return `value` if it lies within the bounds, or is zero where `low_is_limit`.

        otherwise : advice for a user who needs the value.
        Raises ParameterError naming the value, the range and its source.
        """
        low, high = self.bounds
        if low <= value <= high or (self.low_is_limit and value == 0.0):  # this way round, NaN fails too
            return value
        raise ParameterError(
            f"{name} = {value:g} {self.unit} is outside [{low:g}, {high:g}] {self.unit} ({self.source})"
            f"{otherwise and '. '}{otherwise}."
        )


def checked(
    parameters: Mapping[str, Parameter], values: Mapping[str, float], otherwise: str = ""
) -> dict[str, float]:
    """Defaults updated with `values`, each within its bounds.  otherwise : advice for a value out of bounds.

    Raises ParameterError for an unknown name (with the nearest match), no number, or a value out of bounds.
    """
    for name in values:
        if name not in parameters:
            raise ParameterError(
                f"unknown parameter {name!r}{did_you_mean(name, parameters)} Known: {', '.join(parameters) or 'none'}."
            )
    return {
        name: p.check(name, _number(name, values.get(name, p.default)), otherwise)
        for name, p in parameters.items()
    }


def _number(name: str, value: object) -> float:
    try:
        if isinstance(value, bool):
            raise TypeError
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ParameterError(f"{name} = {in_words(value)} is not a number.") from None
    except OverflowError:
        raise ParameterError(
            f"{name} is a whole number of more than 308 digits, which no parameter has; correct it."
        ) from None
