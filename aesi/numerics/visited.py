"""States of charge and temperatures of a set of rows, and the distance of other rows from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from aesi.constants import GAS_CONSTANT_J_MOL_K, ZERO_CELSIUS_K
from aesi.numerics.files.restored import saved_array
from aesi.numerics.typing import Array, BoolArray, SavedState

RESOLUTION = 0.005
"""Distance in the state of charge below which no model of an error distinguishes two places."""
LENGTH = 0.12
"""Distance in state of charge over which the error of a cell model changes: that of the potentials in the effect
ocp_shape. Over the development splits of the NMC drive in `aesi bench splits` (16 candidates), a correction that fades
over half of it reduces the declared model's squared error by 0.1 points less in the mean and 6.2 more at worst; over
0.16 by 0.4 and 5.7 less, over 0.24 by 1.3 and 14.8 less."""
ROUND_OFF_K = 1e-6
"""Tolerance for round-off: means of one temperature over different numbers of rows differ by some 1e-14 K."""

ENERGY_J_MOL = 40e3
"""Activation energy between those of kinetics and diffusion: the mean of 53 and 44 (Ecker et al. 2015), 35 and 18 (Chen
et al. 2020), 55 and 35 kJ/mol (About:Energy 2022)."""

TemperatureSpan = tuple[float, float]
"""Lowest and highest temperature, degC."""


@dataclass(frozen=True, eq=False)
class Visited:
    """The states of charge and temperatures of a set of rows.

    charge : (k,) states of charge, rounded to RESOLUTION, sorted and unique.  temperature_degc : the lowest and the
    highest, None where none was measured.
    """

    charge: Array
    temperature_degc: TemperatureSpan | None = None

    @classmethod
    def of(cls, soc: Array, temperature_degc: Array | None = None) -> Self:
        """From the states of charge (n,) and temperatures (n,) degC of rows, NaN where not measured."""
        charge = np.asarray(RESOLUTION * np.unique(np.round(soc / RESOLUTION)))
        if temperature_degc is None or not np.isfinite(temperature_degc).any():
            return cls(charge)
        return cls(charge, (float(np.nanmin(temperature_degc)), float(np.nanmax(temperature_degc))))

    def distance(self, soc: Array) -> Array:
        """(n,) distance of each state of charge beyond RESOLUTION / 2 to the nearest visited one; inf without any."""
        if not len(self.charge):
            return np.full(len(soc), np.inf)
        last = len(self.charge) - 1
        place = np.clip(np.searchsorted(self.charge, soc), 1, max(last, 1))
        below, above = (np.abs(soc - self.charge[i]) for i in (place - 1, np.minimum(place, last)))
        return np.asarray(np.maximum(np.minimum(below, above) - RESOLUTION / 2, 0.0))

    def correlation(self, soc: Array) -> Array:
        """(n,) correlation of a model's errors at each and at the nearest visited state of charge, d away:
        exp(-(d / LENGTH)**2 / 2)."""
        return np.asarray(np.exp(-0.5 * (self.distance(soc) / LENGTH) ** 2))

    def beyond_k(self, temperature_degc: Array) -> Array:
        """(n,) K, distance of each temperature above the span, negative below it; 0 within it, and where none was
        measured."""
        if self.temperature_degc is None:
            return np.zeros(len(temperature_degc))
        return np.asarray(np.nan_to_num(temperature_degc - np.clip(temperature_degc, *self.temperature_degc)))

    def knows(self, temperature_degc: Array) -> BoolArray:
        """(n,) True within the span of temperatures, up to round-off, and where none was measured (NaN)."""
        return np.asarray(np.abs(self.beyond_k(temperature_degc)) < ROUND_OFF_K)

    def per_energy(self, temperature_degc: Array | None) -> Array | float:
        """(n,) mol/J, |1 / T - 1 / T_near| / R, >= 0: derivative of the logarithm of a rate at T in its activation
        energy, for a rate that is known at the nearest temperature of the span. 0 where none was measured."""
        if self.temperature_degc is None or temperature_degc is None:
            return 0.0
        near = np.clip(temperature_degc, *self.temperature_degc) + ZERO_CELSIUS_K
        apart = np.abs(1.0 / (temperature_degc + ZERO_CELSIUS_K) - 1.0 / near)
        return np.asarray(np.nan_to_num(apart / GAS_CONSTANT_J_MOL_K))

    def thermal_distance(self, temperature_degc: Array | None) -> Array | float:
        """(n,) >= 0, logarithm of the factor on overpotentials from the nearest temperature of the span, with the
        activation energy ENERGY_J_MOL."""
        return ENERGY_J_MOL * self.per_energy(temperature_degc)

    def to_state(self) -> SavedState:
        """Plain values."""
        span = None if self.temperature_degc is None else list(self.temperature_degc)
        return {"charge": self.charge.tolist(), "temperature_degc": span}

    @classmethod
    def from_state(cls, state: SavedState) -> Self:
        """Inverse of `to_state`; other keys of the state are ignored.  Raises ValueError for anything else."""
        charge, span = saved_array(state["charge"], "charge", (None,)), state["temperature_degc"]
        if (np.diff(charge) <= 0.0).any():
            raise ValueError("charge does not increase")
        if span is None:
            return cls(charge)
        coldest, warmest = saved_array(span, "temperature_degc", (2,)).tolist()
        if coldest > warmest:
            raise ValueError(f"temperature_degc falls from {coldest:g} to {warmest:g}")
        return cls(charge, (coldest, warmest))
