"""How a band widens away from the temperatures that its model was fitted to.

    k_T  = exp(E / R |1 / T - 1 / T_near|),     T_near the nearest temperature of the fitted rows           (1)

Pieces of one temperature cannot calibrate another, so the error is taken to grow as the overpotentials do, by an
Arrhenius factor with an activation energy E between those of kinetics and diffusion (`aesi.numerics.visited`). A record
without a measured temperature counts as fitted.
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.typing import Array
from aesi.numerics.visited import Visited


def growth(seen: Visited, temperature_degc: Array | None) -> Array:
    """(n,) k_T of (1), >= 1."""
    return np.asarray(np.exp(seen.thermal_distance(temperature_degc)))
