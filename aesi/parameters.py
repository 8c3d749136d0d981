"""A physical parameter, declared once: default, unit, bounds and where the range comes from.

The check, the box of a fit, the range of a search and the table in the documentation all read this record.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from aesi.errors import ParameterError, did_you_mean


@dataclass(frozen=True)
class Spread:
    """By how much a declared parameter is off in cell files: standard deviations, of the natural logarithm where the
    parameter is logarithmic.

    tight : of a careful parametrisation of this very cell, None where it leaves nothing open.
    loose : of one of a cell of the same make, or of one that was not checked, None where even that leaves nothing open.
    source : where the two are from.
    """

    tight: float | None
    loose: float | None
    source: str


@dataclass(frozen=True)
class Parameter:
    """One scalar parameter.

    default : the value at which an effect is typically seen.
    bounds : the least and the greatest value, in `unit`; source : where they are from.
    log : a search goes on a logarithmic scale.
    even : the voltage moves with its square, as with a standard deviation. A fit then moves the square: from nought it
    could not move the parameter itself.
    neutral : the value at which an effect vanishes, None where it has none.
    expected : standard deviation of the distance from neutral (or from the default; of the logarithm where `log`)
    where small ones are likelier than large ones, None where all within bounds are alike.
    capacity_power : the power of the capacity that `expected` and `spread`, which are those of a cell of one
    ampere-hour, go with: of a current 1, of a resistance -1.
    linear : the voltage is all but linear in it, so that a fit need not take its slope anew at every step.
    low_is_limit : the lower bound stands for nought, which a logarithmic scale does not reach. To end there is a value
    like others, and nought itself may be given.
    spread : by how much cell files are off in it, so that a hypothesis about something else may move it by that much.
    counted : how a value stands to what the cell file declares of the same: by itself, `added` to it, or a `share` of
    it.
    shift_of : what it is a shift of, as a discovery writes that with its unit (`declared_degc`); empty where of none.
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
    linear: bool = False
    low_is_limit: bool = False
    spread: Spread | None = None
    counted: Literal["itself", "added", "share"] = "itself"
    shift_of: str = ""

    def __post_init__(self) -> None:
        low, high = self.bounds
        if not low < high:
            raise ParameterError(f"bounds [{low:g}, {high:g}] {self.unit} are empty; give low < high.")
        if self.log and low <= 0:
            raise ParameterError(
                f"a logarithmic scale needs a positive lower bound, not {low:g} {self.unit}."
            )
        if self.even and (self.log or low < 0):
            raise ParameterError(
                f"a fit moves the square of what is even: give linear bounds from nought on, not [{low:g}, {high:g}] "
                f"{self.unit}{' on a logarithmic scale' if self.log else ''}."
            )
        if self.log and self.capacity_power:
            raise ParameterError(
                "the standard deviation of a logarithm is that of a cell of any size; leave capacity_power out."
            )
        own = "Give one within, or wider bounds"
        self.check("default", self.default, own)
        if self.neutral is not None and not self.log:
            self.check("neutral", self.neutral, own)

    def check(self, name: str, value: float, otherwise: str = "") -> float:
        """Return `value` if it lies within the bounds, or is the nought that the lower one stands for.

        otherwise : what can be done where the value is meant.
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
    """Defaults overlaid with `values`, each within its bounds; otherwise : what can be done where one is not.

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
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ParameterError(f"{name} = {value!r} is not a number.") from None
