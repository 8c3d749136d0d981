"""The uncertainty of a physics model's parameters after a fit, as a voltage at another row.

    s(x)**2 = j(x)' C j(x),     C = (1 + sum_k j_k j_k' dt / (T sigma**2))**-1                             (1)

j is the change of the model's voltage by one prior standard deviation of each parameter. C is the posterior covariance,
in these units, after the fitted rows k, whose errors of size sigma are independent over times T (Laplace
approximation). sigma is the error that the fit allowed for, since a model with larger errors learns less from the same
rows. s is large where a parameter matters that no fitted row determined: at a current, a state of charge or a depletion
that they did not reach. MacKay, Neural Computation 4 (1992) 448, doi:10.1162/neco.1992.4.3.448.

Bands take the shape of their width from (1) and its size from left-out pieces (local_scale.py), so that an error of s
does not bias the coverage. Rows of one temperature, and pieces of them, have no information on another temperature.
There the prior remains:

    q(x)**2 = sum_p (j_p(x) E_p |1 / T - 1 / T_near| / R)**2                                               (2)

with E_p the deviation of the activation energy of a rate or a film over that of its logarithm, and T_near the nearest
temperature of the fitted rows, at which it is known. Bands take its normal quantile as it is, beside the calibrated
width as an independent error, since pieces say nothing of its size: as one more parameter of (1), with the weight that
they give s, it makes the bands of AESI I on the LG HG2 at 0 degC (mixed1) 664 mV wide, where nine errors in ten are
below 60 mV.

On records that judge no split, by models of 25 degC without the LA92: the LG HG2 at 0 degC (mixed1, C/20) and 40 degC
(C/20), the Panasonic at 10 and 0 degC (HPPC) and -10 degC (cycle 1). With (2) the bands of AESI I cover 96, 76, 58, 74,
41 and 99 % at scores of 185, 349, 356, 122, 176 and 297 mV. With a width that grows by Arrhenius' law with 40 kJ/mol,
but for s, which does so by itself, it was 72, 70, 58, 75, 48 and 100 % at 157, 354, 356, 125, 180 and 427 mV; with
neither 63, 70, 58, 72, 30 and 98 % at 190, 354, 356, 127, 198 and 186 mV. At C/20, and in the rests of the HPPC, the
errors are those of charge and potentials, of which (2) knows nothing. The Panasonic's file was fitted at -10 degC, and
knows its energies better than (2). Without the films, by later files of the same cells, 91.2 instead of 94.5 % at 165
instead of 156 mV on the LG HG2's mixed1, 596 instead of 604 mV on the Panasonic's cycle 1, the others the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.numerics.typing import Array


def covariance_root(slopes_v: Sequence[Array], weight: float) -> Array:
    """(k, k) L with L L' = C of (1).  slopes_v : (n_i, k) V per prior standard deviation, along fitted rows.
    weight : dt / (T sigma**2), 1/V**2."""
    k = slopes_v[0].shape[1]
    information = np.eye(k) + weight * sum((each.T @ each for each in slopes_v), np.zeros((k, k)))
    return np.asarray(np.linalg.cholesky(np.linalg.inv(information)))


def spread(slopes_v: Array, root: Array) -> Array:
    """(n,) V, s of (1) along rows with slopes (n, k)."""
    return np.asarray(np.linalg.norm(slopes_v @ root, axis=1))


def thermal_spread(slopes_v: Array, energies_j_mol: Array, per_energy: Array | float) -> Array:
    """(n,) V, q of (2) along rows with slopes (n, k).  energies_j_mol : (k,) E.  per_energy : (n,) mol/J, the rest of
    (2), `Visited.per_energy`."""
    return np.asarray(per_energy * np.linalg.norm(slopes_v * energies_j_mol, axis=1))
