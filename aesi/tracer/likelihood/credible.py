"""Credible intervals of parameters that have bounds.

A parameter inside its bounds has a normal density, to both sides. One that the data push onto a bound has, along the
distance d >= 0 from it, with the free parameters marginalised and the others held where they are,

    p(d) ~ exp(g d - a d^2 / 2)    g < 0 where the data push onto the bound, a > 0 their curvature    (1)

a normal density cut off at the bound; its interval is what lies nearest the bound.
Johnson, Kotz & Balakrishnan, Continuous Univariate Distributions 1 (1994), section 13.10.
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtri, ndtri_exp

from aesi.numerics.typing import Array, IntArray
from aesi.tracer.likelihood.gaussian import Posterior, held_at_bounds


def reaches(posterior: Posterior, bounds: Array, share: float) -> Array:
    """(m, 2) distances from each parameter to the ends, lower and upper, of the interval with `share` of its density.

    bounds : (m, 2) of the coordinates, in which the distances are, too.
    """
    to_bounds, held = held_at_bounds(posterior, bounds)
    free, place = np.flatnonzero(~held), posterior.x + to_bounds
    sums = posterior.sums.moved(to_bounds)
    a = sums.gram.sum(axis=0) + np.eye(len(place))
    b = sums.moment.sum(axis=0) - place
    out = np.zeros((len(place), 2))
    covariance = np.linalg.inv(a[np.ix_(free, free)])
    out[free] = float(ndtri(0.5 * (1.0 + share))) * np.sqrt(np.diagonal(covariance))[:, None]
    for j in np.flatnonzero(held):
        slope, curvature = _marginal(a, b, int(j), free)
        above = place[j] - bounds[j, 0] <= bounds[j, 1] - place[j]
        out[j, int(above)] = _distance(slope if above else -slope, curvature, share)
    return out


def _marginal(a: Array, b: Array, j: int, free: IntArray) -> tuple[float, float]:
    """Slope and curvature of (1) along one parameter, the free ones marginalised.  a : (m, m).  b : (m,)."""
    taken = np.linalg.solve(a[np.ix_(free, free)], a[free, j])
    return float(b[j] - taken @ b[free]), float(a[j, j] - taken @ a[free, j])


def _distance(slope: float, curvature: float, share: float) -> float:
    """The quantile of (1): this share of it lies nearer."""
    sd = curvature**-0.5
    beyond = -slope * sd  # from the middle of the uncut normal to the bound, in its standard deviations
    quantile = -ndtri_exp(log_ndtr(-beyond) + np.log1p(-share))
    return max(0.0, sd * float(quantile - beyond))
