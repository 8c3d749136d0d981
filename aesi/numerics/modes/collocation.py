"""Gauss points across a layer, and what integrals over it become for values given there.

Position runs from 0 at the current collector to 1 at the separator. Whatever is known at the n points stands for the
polynomial of degree n - 1 through them, so integrals are exact for it and converge exponentially for smooth profiles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from aesi.numerics.modes.galerkin import gauss_lobatto
from aesi.numerics.typing import Array


@dataclass(frozen=True, eq=False)
class GaussLayer:
    """Points and integrals of one layer of thickness one.

    x, weight : (n,) points and quadrature weights.  A quantity Y_v is what the source density gives over the layer at
    point v: Y_v = weight_v density_v, so that the total is the plain sum.
    before : (n, n) before @ Y is what was given between 0 and each point.
    after : (n, n) after @ f is the integral of f from each point to 1.
    solid : (n, n) solid @ Y is the integral from 0 to each point of what is given beyond, sum Y - before.
    """

    x: Array
    weight: Array
    before: Array
    after: Array
    solid: Array


@lru_cache(maxsize=16)
def gauss_layer(points: int) -> GaussLayer:
    """The layer with that many Gauss points."""
    s, w = legendre.leggauss(points)
    x, weight = 0.5 * (s + 1.0), 0.5 * w
    to_coefficients = np.linalg.inv(legendre.legvander(s, points - 1))
    # 0.5 (P_{k+1} - P_{k-1}) / (2 k + 1) + 0.5 [k = 0] is the integral of P_k from 0 to x
    integrals = 0.5 * np.array([legendre.legval(s, legendre.legint(c, lbnd=-1)) for c in np.eye(points)]).T
    first = integrals @ to_coefficients
    twice = 0.25 * np.array([legendre.legval(s, legendre.legint(c, m=2, lbnd=-1)) for c in np.eye(points)]).T
    before = first / weight
    solid = x[:, None] - (twice @ to_coefficients) / weight
    arrays = [np.ascontiguousarray(a) for a in (x, weight, before, weight - first, solid)]
    for array in arrays:
        array.flags.writeable = False
    return GaussLayer(*arrays)


def lobatto_to(points: Array, order: int) -> Array:
    """(n, order + 1) values at points in [0, 1] from values at the Gauss-Lobatto points of a layer."""
    to_coefficients = np.linalg.inv(legendre.legvander(gauss_lobatto(order + 1)[0], order))
    return np.asarray(legendre.legvander(2.0 * points - 1.0, order) @ to_coefficients)
