"""States of charge and temperatures that a model was fitted to; a band widens away from them.

    g(x) = sqrt(1 - rho(d(x))**2),     d the distance in the state of charge to the nearest fitted row       (1)
    k_T  = exp(E / R |1 / T - 1 / T_near|),     T_near the nearest temperature of the fitted rows           (2)

(1) is the posterior over the prior standard deviation of a Gaussian process with the correlation rho
(`aesi.numerics.visited`), at a distance d from its nearest observation. It is a term of the scale
(local_scale.py); left-out pieces give it its weight. Pieces of one temperature cannot calibrate another, so (2) assumes
that the error grows as the overpotentials do, by an Arrhenius factor with an activation energy E between those of
kinetics and diffusion. A record without a measured temperature counts as fitted.

On the development splits of `aesi bench splits` the band of AESI I covers 41 % of the worst drive of the NMC cell with
both and 18 % without, 69 and 42 % of that of the LG M50T, at the same Winkler score.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from aesi.numerics.typing import Array, SavedState
from aesi.numerics.visited import (
    TemperatureSpan,
    correlation,
    distance_to_visited,
    temperature_span,
    thermal_distance,
    visited,
)


@dataclass(frozen=True, eq=False)
class Seen:
    """charge : (k,) states of charge, sorted.  temperature_degc : the lowest and the highest, None if not measured."""

    charge: Array
    temperature_degc: TemperatureSpan | None = None

    @classmethod
    def of(cls, soc: Sequence[Array], temperature_degc: Sequence[Array | None]) -> Self:
        """From states of charge and temperatures (degC), one array a record; None where no temperature was measured."""
        measured = [each for each in temperature_degc if each is not None]
        span = temperature_span(np.concatenate(measured)) if measured else None
        return cls(visited(np.concatenate(list(soc))), span)

    def gap(self, soc: Array) -> Array:
        """(n,) of (1), 0 to 1."""
        return np.asarray(np.sqrt(1.0 - correlation(distance_to_visited(soc, self.charge)) ** 2))

    def growth(self, temperature_degc: Array | None) -> Array:
        """(n,) k_T of (2), >= 1."""
        return np.asarray(np.exp(thermal_distance(temperature_degc, self.temperature_degc)))

    def to_state(self) -> SavedState:
        """Plain values and a numpy array."""
        span = None if self.temperature_degc is None else list(self.temperature_degc)
        return {"charge": self.charge, "temperature_degc": span}

    @classmethod
    def from_state(cls, state: SavedState) -> Self:
        """Inverse of `to_state`."""
        span = state["temperature_degc"]
        return cls(
            np.asarray(state["charge"], dtype=float),
            None if span is None else (float(span[0]), float(span[1])),
        )
