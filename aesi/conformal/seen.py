"""How a band widens away from the states of charge and temperatures that its model was fitted to.

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

import numpy as np

from aesi.numerics.typing import Array
from aesi.numerics.visited import Visited


def gap(seen: Visited, soc: Array) -> Array:
    """(n,) of (1), 0 to 1."""
    return np.asarray(np.sqrt(1.0 - seen.correlation(soc) ** 2))


def growth(seen: Visited, temperature_degc: Array | None) -> Array:
    """(n,) k_T of (2), >= 1."""
    return np.asarray(np.exp(seen.thermal_distance(temperature_degc)))
