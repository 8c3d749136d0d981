"""How a band widens away from the temperatures that its model was fitted to.

    k_T  = exp(E / R |1 / T - 1 / T_near|),     T_near the nearest temperature of the fitted rows           (1)

Pieces of one temperature cannot calibrate another, so the error is taken to grow as the overpotentials do, by an
Arrhenius factor with an activation energy E between those of kinetics and diffusion (`aesi.numerics.visited`). What is
left open of the physics grows as its voltage does, by itself; (1) is for the other terms (local_scale.py). A record
without a measured temperature counts as fitted.

On records that judge no split, by models of 25 degC without the LA92: with (1) on all terms the bands of AESI I score
318, 128 and 919 mV on the LG HG2 at 0 degC (mixed1) and the Panasonic at 10 (HPPC) and -10 degC (cycle 1), so 157, 125
and 427 mV, covering 94.0, 74.5 and 99.9 %. With the activation energies, known to 13 kJ/mol, as further parameters that
are left open it is 559, 92 and 1217 mV.
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.typing import Array
from aesi.numerics.visited import Visited


def growth(seen: Visited, temperature_degc: Array | None) -> Array:
    """(n,) k_T of (1), >= 1."""
    return np.asarray(np.exp(seen.thermal_distance(temperature_degc)))
