"""The free scalars of a hypothesis: what may move, how far, and how far it is expected to move anyway.

A knob is free (within the bounds that its effect declares: flat, or normal where the effect says what size is to be
expected) or tolerated (normal around the declared value: what a careful parametrisation leaves open and what every
hypothesis, the empty one included, may use).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array
from aesi.parameters import Parameter

SOC0 = "soc0"
"""Owner of the knobs that shift a record's initial state of charge."""

TOLERATED_SDS = 3.0
"""A tolerated knob may not leave this many of its tolerances: beyond, it is an effect and has to compete as
one."""

BOUND_MARGIN = 0.02
"""Share of the range next to a bound that counts as the bound."""


@dataclass(frozen=True)
class Knob:
    """One scalar: who owns it, its range, and its tolerance if it has one.

    `sd` is the tolerance: relative (on the logarithm) where `log`, else in `unit`; None for a free knob.
    `start` is where it is when nothing is wrong, or the typical value where an effect has no such point.
    `amplitude` is False for parameters that only shape an effect (a rate, a time constant).
    `expected` is the standard deviation of a free knob's distance from `start`, in `unit`; None where it is flat.
    `linear` says that its slope may be kept through a descent, `low_is_limit` that the lower bound stands for nought.
    """

    owner: str
    name: str
    unit: str
    low: float
    high: float
    log: bool
    start: float
    typical: float
    amplitude: bool = True
    sd: float | None = None
    expected: float | None = None
    linear: bool = False
    low_is_limit: bool = False

    @property
    def key(self) -> tuple[str, str]:
        """(owner, name)."""
        return self.owner, self.name

    @property
    def scale(self) -> float:
        """What one unit of the working coordinate is: the tolerance, or the range."""
        if self.sd is not None:
            return self.sd
        return float(np.log(self.high / self.low)) if self.log else self.high - self.low

    @property
    def prior_root(self) -> float:
        """Root of the prior's precision in the working coordinate; nought where it is flat."""
        if self.sd is not None:
            return 1.0
        return 0.0 if self.expected is None else self.scale / self.expected

    def to_working(self, value: float) -> float:
        """The coordinate in which fits move: a distance from `start` in units of `scale`."""
        if self.log:
            return float(np.log(value / self.start)) / self.scale
        return (value - self.start) / self.scale

    def to_value(self, x: float) -> float:
        """Inverse of `to_working`, clipped to the bounds against round-off."""
        value = self.start * float(np.exp(x * self.scale)) if self.log else self.start + x * self.scale
        return min(max(value, self.low), self.high)

    @property
    def working_bounds(self) -> tuple[float, float]:
        """Bounds in the working coordinate."""
        return self.to_working(self.low), self.to_working(self.high)

    def at_bound(self, value: float) -> bool:
        """True where a free knob ended on a bound of what is plausible.

        Its neutral point does not count, nor the ends of what a linear shape can mean at all (a state of
        hysteresis of one, a share of nought).
        """
        if self.sd is not None or not (self.amplitude or self.log):
            return False
        low, high = self.working_bounds
        x = self.to_working(value)
        near = BOUND_MARGIN * (high - low)
        below = x - low < near and abs(low) > near and not self.low_is_limit
        return below or (high - x < near and abs(high) > near)


def free_knobs(effect: str, parameters: Mapping[str, Parameter]) -> list[Knob]:
    """The knobs of an effect under test: flat within the declared bounds."""
    return [_free(effect, name, p) for name, p in parameters.items()]


def _free(effect: str, name: str, p: Parameter) -> Knob:
    low, high = p.bounds
    neutral = p.neutral
    inside = neutral is not None and low <= neutral <= high
    log = p.log and (neutral is None or neutral > 0)
    start = float(neutral) if inside and neutral is not None else p.default
    return Knob(
        effect, name, p.unit, low, high, log, start, p.default,
        amplitude=neutral is not None, expected=p.expected, linear=p.linear, low_is_limit=p.low_is_limit,
    )  # fmt: skip


def tolerated_knob(effect: str, name: str, p: Parameter, sd: float) -> Knob:
    """A knob that every hypothesis may use within a tolerance (relative where the parameter is
    logarithmic)."""
    start = p.default if p.neutral is None else p.neutral
    log = p.log and start > 0
    reach = TOLERATED_SDS * sd
    low, high = (start * np.exp(-reach), start * np.exp(reach)) if log else (start - reach, start + reach)
    low, high = max(low, p.bounds[0]), min(high, p.bounds[1])
    return Knob(effect, name, p.unit, float(low), float(high), log, start, start, sd=sd, linear=p.linear)


def soc_knob(record: str, soc0: float, sd: float) -> Knob:
    """Initial state of charge of a record, known to `sd`."""
    low, high = soc0 - TOLERATED_SDS * sd, soc0 + TOLERATED_SDS * sd
    return Knob(SOC0, record, "1", low, high, False, soc0, soc0, sd=sd)


def values_by_owner(knobs: Sequence[Knob], x: Array) -> dict[str, dict[str, float]]:
    """owner -> name -> value of the working vector `x` (n_knobs,)."""
    out: dict[str, dict[str, float]] = {}
    for knob, coordinate in zip(knobs, x, strict=True):
        out.setdefault(knob.owner, {})[knob.name] = knob.to_value(float(coordinate))
    return out


def placed_in(knobs: Sequence[Knob], known: Mapping[tuple[str, str], float], elsewhere: Array) -> Array:
    """(n_knobs,) working coordinates of the known values (by owner and name), and of `elsewhere` for the others."""
    return np.array(
        [k.to_working(known[k.key]) if k.key in known else x for k, x in zip(knobs, elsewhere, strict=True)]
    )


def starts(knobs: Sequence[Knob]) -> list[Array]:
    """Working vectors to start a fit from.

    The first has every amplitude a third of the way to its typical value and every shape at its typical
    value;
    two more move the shapes to the quarters of their ranges, where there are shapes.
    """
    first = np.array([_first_start(k) for k in knobs])
    shapes = np.array([k.sd is None and not k.amplitude for k in knobs], dtype=bool)
    vectors = [first]
    if shapes.any():
        bounds = np.array([k.working_bounds for k in knobs])
        for share in (0.25, 0.75):
            other = first.copy()
            other[shapes] = (bounds[:, 0] + share * (bounds[:, 1] - bounds[:, 0]))[shapes]
            vectors.append(other)
    return vectors


def _first_start(knob: Knob) -> float:
    if knob.sd is not None:
        return 0.0
    share = 1.0 / 3.0 if knob.amplitude else 1.0
    return share * knob.to_working(knob.typical)
