"""A scalar that a fit may move, in the coordinate in which its prior is a standard normal.

    x = (phi(value) - phi(centre)) / sd        phi the natural logarithm, the square or the identity

The prior of an own parameter (one that the cell declares) has the spread declared with it. That of a parameter of an
effect under test is as wide as the effect allows. The initial state of charge of a record, and the cell's share of its
capacity during the record, have a standard deviation each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array, BoolArray
from aesi.parameters import Parameter
from aesi.physics.effect import Effect

STATE_OF_CHARGE = "soc0"
"""Owner of the parameters that shift a record's initial state of charge."""
CAPACITY_SHARE = "capacity_share"
"""Owner of the parameters that give a cell's capacity during a record, as a share of the file's."""
RECORD_OWNERS = (STATE_OF_CHARGE, CAPACITY_SHARE)
"""Owners of parameters that belong to one record, not to the cell. The parameter's name is the record's number."""
SHARED_SUFFIX = " of all records"
"""Ending of the owner of a declared parameter where good records are given: all records share it, the good ones too.
The parameter of the same name of an effect under test, which acts on the other records alone, has none."""
FURTHEST_SDS = 4.0
"""An own parameter may not leave this many of its standard deviations."""
ON_BOUND_SDS = 1e-6
"""A coordinate counts as on a bound where it is nearer than this, in standard deviations of the prior."""


@dataclass(frozen=True)
class FreeParameter:
    """One scalar: who owns it, its bounds, and its normal prior.

    owner : id of an effect, or one of RECORD_OWNERS with the number of a record as the name.
    low, high, centre : in `unit`.  sd : of the natural logarithm where `log`, of the square where `even`, else in
    `unit`.
    own : True for a parameter of the declared model, False for one of an effect under test.
    amplitude : False for parameters that only shape an effect (a rate, a time constant).
    typical : usual value where the effect is present, in `unit`.  low_is_limit : the lower bound stands for zero.
    """

    owner: str
    name: str
    unit: str
    low: float
    high: float
    log: bool
    centre: float
    sd: float
    own: bool
    amplitude: bool = True
    typical: float = 0.0
    low_is_limit: bool = False
    even: bool = False

    @property
    def key(self) -> tuple[str, str]:
        """(owner, name)."""
        return self.owner, self.name

    @property
    def record(self) -> int | None:
        """Number of the record that it belongs to; None for what all records share."""
        return int(self.name) if self.owner in RECORD_OWNERS else None

    def coordinate(self, value: float) -> float:
        """x of a value."""
        if self.log:
            return float(np.log(value / self.centre)) / self.sd
        if self.even:
            return (value**2 - self.centre**2) / self.sd
        return (value - self.centre) / self.sd

    def value(self, x: float) -> float:
        """Inverse of `coordinate`, held within the bounds against round-off."""
        if self.log:
            value = self.centre * float(np.exp(x * self.sd))
        elif self.even:
            value = float(np.sqrt(max(self.centre**2 + x * self.sd, 0.0)))
        else:
            value = self.centre + x * self.sd
        return min(max(value, self.low), self.high)

    @property
    def bounds(self) -> tuple[float, float]:
        """(lower, upper) of x."""
        return self.coordinate(self.low), self.coordinate(self.high)

    @property
    def start(self) -> float:
        """Where x starts for an effect's parameter: an amplitude a third of the way to its typical value."""
        return (1.0 / 3.0 if self.amplitude else 1.0) * self.coordinate(self.typical)

    def ends(self, x: float) -> tuple[bool, bool]:
        """(x is on its lower bound, x is on its upper bound)."""
        lowest, highest = at_ends(x, *self.bounds)
        return bool(lowest), bool(highest)

    def reported(self, value: float) -> float:
        """A value for reports: the bound itself where the value differs from it by round-off only."""
        lowest, highest = self.ends(self.coordinate(value))
        return self.low if lowest else self.high if highest else value

    def on_bound(self, x: float) -> bool:
        """True where an effect's parameter ended on a bound of its plausible range. A bound at the neutral value does
        not count, nor one that stands for zero, nor one that no value can pass (a share of 0 or 1)."""
        if self.own or not (self.amplitude or self.log):
            return False
        (low, high), (lowest, highest) = self.bounds, self.ends(x)
        below = lowest and abs(low) > ON_BOUND_SDS and not self.low_is_limit
        return below or (highest and abs(high) > ON_BOUND_SDS)


def at_ends(x: Array | float, low: Array | float, high: Array | float) -> tuple[BoolArray, BoolArray]:
    """(at the lower end, at the upper end) of its range for each coordinate: two boolean arrays of the shape of x."""
    return np.asarray(x - low < ON_BOUND_SDS), np.asarray(high - x < ON_BOUND_SDS)


def effect_parameters(
    effect: str, parameters: Mapping[str, Parameter], capacity_ah: float
) -> list[FreeParameter]:
    """The parameters of an effect under test, in a cell of this capacity (Ah). The prior is as wide as the effect's
    usual size where that is known, else as its range."""
    return [_effect_parameter(effect, name, p, capacity_ah) for name, p in parameters.items()]


def _effect_parameter(effect: str, name: str, p: Parameter, capacity_ah: float) -> FreeParameter:
    low, high = p.bounds
    centre = p.default if p.neutral is None or not low <= p.neutral <= high else float(p.neutral)
    log = p.log and centre > 0
    scale = np.log if log else np.square if p.even else float
    reach = max(scale(high) - scale(centre), scale(centre) - scale(low))
    return FreeParameter(
        owner=effect,
        name=name,
        unit=p.unit,
        low=low,
        high=high,
        log=log,
        centre=centre,
        sd=_effect_prior_sd(p, capacity_ah)
        or float(reach) / 2.0,  # ends of the range at two standard deviations
        own=False,
        amplitude=p.neutral is not None,
        typical=p.default,
        low_is_limit=p.low_is_limit,
        even=p.even,
    )


def _effect_prior_sd(p: Parameter, capacity_ah: float) -> float | None:
    """Prior standard deviation of an effect's parameter about its neutral value, in its unit or of its natural
    logarithm; None where none is known. For what every cell file declares, it is the scatter between files of cells of
    one make.
    """
    spread = p.spread if p.log and p.neutral is not None else None
    sd = p.expected if spread is None or spread.tight is None else spread.loose
    return None if sd is None else sd * capacity_ah**p.capacity_power


def own_parameter(effect: str, name: str, p: Parameter, sd: float) -> FreeParameter:
    """A parameter of the declared model that may be off by `sd`, in its unit, or in its natural logarithm where it has
    a logarithmic scale.  effect : its owner."""
    centre = p.default if p.neutral is None else p.neutral
    return _within_sds(effect, name, p.unit, centre, sd, p.log and centre > 0, p.bounds)


def state_of_charge(record: int, soc0: float, sd: float) -> FreeParameter:
    """Initial state of charge of a record, known to `sd`."""
    return _within_sds(STATE_OF_CHARGE, str(record), "1", soc0, sd, log=False)


def capacity_share(record: int, sd: float) -> FreeParameter:
    """Share of the file's capacity that the cell had in a record, its logarithm known to `sd`."""
    return _within_sds(CAPACITY_SHARE, str(record), "1", 1.0, sd, log=True)


def _within_sds(
    owner: str,
    name: str,
    unit: str,
    centre: float,
    sd: float,
    log: bool,
    bounds: tuple[float, float] = (-np.inf, np.inf),
) -> FreeParameter:
    """An own parameter from `FURTHEST_SDS` standard deviations below its centre to as many above, within its bounds."""
    reach = FURTHEST_SDS * sd
    low, high = (centre * np.exp(-reach), centre * np.exp(reach)) if log else (centre - reach, centre + reach)
    low, high = max(float(low), bounds[0]), min(float(high), bounds[1])
    return FreeParameter(owner, name, unit, low, high, log, centre=centre, sd=sd, own=True)


def values_of(
    free: Sequence[FreeParameter], x: Array, hypothesis: Sequence[str]
) -> dict[str, dict[str, float]]:
    """owner -> name -> value of the coordinates (n_free,) of a hypothesis."""
    return by_owner({one.key: one.value(float(v)) for one, v in zip(free, x, strict=True)}, hypothesis)


def by_owner(
    values: Mapping[tuple[str, str], float], hypothesis: Sequence[str]
) -> dict[str, dict[str, float]]:
    """owner -> name -> value, from values by (owner, name). An effect of the hypothesis without parameters has an empty
    entry, so that it still acts."""
    out: dict[str, dict[str, float]] = {}
    for (owner, name), value in values.items():
        out.setdefault(owner, {})[name] = value
    for effect in hypothesis:
        out.setdefault(effect, {})
    return out


def coordinates_of(free: Sequence[FreeParameter], known: Mapping[tuple[str, str], float]) -> Array:
    """(n_free,) coordinates of known values by (owner, name), zero for the others."""
    return np.array(
        [one.coordinate(known[one.key]) if one.key in known else 0.0 for one in free], dtype=float
    )


def starts(free: Sequence[FreeParameter]) -> list[Array]:
    """Coordinates to start the fit of an effect from: amplitudes a third of the way to their typical value; shapes at
    their typical value and at the quarters of their range."""
    bounds = np.array([one.bounds for one in free])
    shapes = np.array([not one.amplitude for one in free], dtype=bool)
    first = np.array([one.start for one in free], dtype=float)
    out = [first]
    for share in (0.25, 0.75) if shapes.any() else ():
        other = first.copy()
        other[shapes] = (bounds[:, 0] + share * (bounds[:, 1] - bounds[:, 0]))[shapes]
        out.append(other)
    return out


def shared_owner(effect: str) -> str:
    """Owner of those parameters of an effect that all records share, good ones included."""
    return effect + SHARED_SUFFIX


def acting_on(
    effects: Mapping[str, Effect], values: Mapping[str, Mapping[str, float]], good: bool
) -> dict[str, dict[str, float]]:
    """Id of an effect -> name -> value on one record. Where an effect has a value that all records share and one under
    test, their deviations from neutral add up (multiply for a logarithmic parameter), within its bounds.

    values : owner -> name -> value.  good : whether the record is known to be good, so that only shared values act.
    """
    out: dict[str, dict[str, float]] = {}
    for owner, given in values.items():
        name = owner.removesuffix(SHARED_SUFFIX)
        if owner in RECORD_OWNERS or (good and name == owner):
            continue
        acting = out.setdefault(name, {})
        for key, value in given.items():
            if key in acting:
                value = _added_deviations(effects[name].parameters[key], acting[key], value)
            acting[key] = value
    return out


def _added_deviations(p: Parameter, value: float, further: float) -> float:
    """The value whose deviation from neutral is the sum (product where logarithmic) of those of two values, in
    bounds."""
    centre = p.default if p.neutral is None else p.neutral
    both = value * further / centre if p.log and centre > 0 else value + further - centre
    return min(max(both, p.bounds[0]), p.bounds[1])
