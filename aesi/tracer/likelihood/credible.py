"""Credible intervals of parameters that have bounds.

A parameter inside its bounds has a normal density and a symmetric interval. One that the data push onto a bound has a
normal density truncated there, (3) of `gaussian.py`, and an interval that begins at the bound.
Johnson, Kotz & Balakrishnan, Continuous Univariate Distributions 1 (1994), section 13.10.
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtri, ndtri_exp

from aesi.numerics.typing import Array
from aesi.tracer.likelihood.gaussian import Posterior, densities_at_bounds, held_at_bounds, on_lower_bound


def interval_distances(posterior: Posterior, bounds: Array, share: float) -> Array:
    """(m, 2) distances, at least 0, from each parameter to the lower and the upper end of its credible interval, in
    prior standard deviations.

    bounds : (m, 2) of the coordinates.  share : posterior probability of the interval.
    """
    to_bounds, held = held_at_bounds(posterior, bounds)
    free, x = np.flatnonzero(~held), posterior.x + to_bounds
    sums = posterior.sums.moved(to_bounds)
    a = sums.gram.sum(axis=0) + np.eye(len(x))
    out = np.zeros((len(x), 2))
    covariance = np.linalg.inv(a[np.ix_(free, free)])
    out[free] = float(ndtri(0.5 * (1.0 + share))) * np.sqrt(np.diagonal(covariance))[:, None]
    for j, density in densities_at_bounds(sums, x, bounds, held).items():
        upper_end = on_lower_bound(x[j], bounds[j])  # the interval begins at the bound
        out[j, int(upper_end)] = _distance(density.slope, density.curvature, share)
    return out


def _distance(slope: float, curvature: float, share: float) -> float:
    """Distance from the bound within which `share` of the density (3) of `gaussian.py` lies."""
    sd = curvature**-0.5
    beyond = -slope * sd  # from the middle of the uncut normal to the bound, in its standard deviations
    quantile = -ndtri_exp(log_ndtr(-beyond) + np.log1p(-share))
    return max(0.0, sd * float(quantile - beyond))
