"""What the fitted rows leave open of a physics model's parameters, as a voltage at another row.

    s(x)**2 = j(x)' C j(x),     C = (1 + sum_k j_k j_k' dt / (T sigma**2))**-1                             (1)

j is by how much one prior deviation of each parameter moves the model's voltage, C the covariance, in such deviations,
that is left after the fitted rows k, whose errors of size sigma are independent over times T: the Laplace approximation
of the posterior. It grows where a parameter matters that no fitted row told of: at a current, a state of charge or a
depletion that they did not reach. MacKay, Neural Computation 4 (1992) 448, doi:10.1162/neco.1992.4.3.448.

Bands take (1) for the shape of their width and left-out pieces for its size (local_scale.py), so an error of s is no
error of coverage.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.numerics.typing import Array


def covariance_root(slopes_v: Sequence[Array], weight: float) -> Array:
    """(k, k) L with L L' = C of (1).  slopes_v : (n_i, k) V a deviation along fitted rows.  weight : dt / (T sigma**2),
    1/V**2."""
    k = slopes_v[0].shape[1]
    information = np.eye(k) + weight * sum((each.T @ each for each in slopes_v), np.zeros((k, k)))
    return np.asarray(np.linalg.cholesky(np.linalg.inv(information)))


def spread(slopes_v: Array, root: Array) -> Array:
    """(n,) V, s of (1) along rows with slopes (n, k)."""
    return np.asarray(np.linalg.norm(slopes_v @ root, axis=1))
