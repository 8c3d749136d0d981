"""Where rows lie in charge and temperature, thinned to what matters, and how far from there another place is."""

from __future__ import annotations

import numpy as np

from aesi.constants import GAS_CONSTANT_J_MOL_K, ZERO_CELSIUS_K
from aesi.numerics.typing import Array

RESOLUTION = 0.005
"""Of a state of charge: no model of an error tells places apart that are closer."""
LENGTH = 0.12
"""Share of the charge over which a cell model's error changes: that of the potentials in the effect ocp_shape. Over
the development splits of the NMC drive in `aesi bench splits` (16 candidates) a correction that fades so takes 65.4 %
off the declared model's squared error, 37.7 % at worst, with 0.06; 65.5 and 31.5 % with 0.12; 65.1 and 25.8 % with
0.16; 64.2 and 16.7 % with 0.24."""

ENERGY_J_MOL = 40e3
"""The mean of 53 and 44 (Ecker et al. 2015), 35 and 18 (Chen et al. 2020), 55 and 35 kJ/mol (About:Energy 2022)."""

TemperatureSpan = tuple[float, float]
"""Lowest and highest temperature, degC."""


def visited(places: Array) -> Array:
    """(k,) the places (n,), rounded to RESOLUTION, sorted, each once."""
    return np.asarray(RESOLUTION * np.unique(np.round(places / RESOLUTION)))


def distance_to_visited(places: Array, known: Array) -> Array:
    """(n,) from each place to the nearest of `known` (k,), sorted; 0 within the resolution, inf where none is known."""
    if not len(known):
        return np.full(len(places), np.inf)
    last = len(known) - 1
    place = np.clip(np.searchsorted(known, places), 1, max(last, 1))
    below, above = np.abs(places - known[place - 1]), np.abs(places - known[np.minimum(place, last)])
    return np.asarray(np.maximum(np.minimum(below, above) - RESOLUTION / 2, 0.0))


def correlation(distance: Array) -> Array:
    """(n,) exp(-(d / LENGTH)**2 / 2), of a model's errors at states of charge a distance apart."""
    return np.asarray(np.exp(-0.5 * (distance / LENGTH) ** 2))


def temperature_span(temperature_degc: Array) -> TemperatureSpan | None:
    """The lowest and the highest of (n,) degC, NaN where not measured; None where none was."""
    measured = temperature_degc[np.isfinite(temperature_degc)]
    return (float(measured.min()), float(measured.max())) if len(measured) else None


def thermal_distance(temperature_degc: Array | None, span: TemperatureSpan | None) -> Array | float:
    """(n,) E / R |1 / T - 1 / T_near|, >= 0: log of what overpotentials change by from the nearest temperature of
    the span, with an activation energy E between those of kinetics and diffusion. 0 where none was measured."""
    if span is None or temperature_degc is None:
        return 0.0
    near = np.clip(temperature_degc, *span) + ZERO_CELSIUS_K
    apart = np.abs(1.0 / (temperature_degc + ZERO_CELSIUS_K) - 1.0 / near)
    return np.asarray(np.nan_to_num(ENERGY_J_MOL / GAS_CONSTANT_J_MOL_K * apart))
