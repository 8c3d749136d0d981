"""The two ensembles of the paper: bagging (AESI I) and stability selection (AESI II).

Fasel et al., Proc. R. Soc. A 478 (2022) 20210904, doi:10.1098/rspa.2021.0904; Meinshausen & Buhlmann,
J. R. Stat. Soc. B 72 (2010) 417, doi:10.1111/j.1467-9868.2010.00740.x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.numerics.typing import Array, IntArray
from aesi.sparse.stridge import STRidge


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Coefficients over the m terms that entered the regression.

    members : (M, m) the best resamples.  bagging : (m,) their mean.  inclusion : (m,) share of them that hold
    each term.  stability : (m,) the refit on all rows of the terms with inclusion above tau, else zero.
    low, high : (m,) 5th and 95th percentile over the members.
    """

    members: Array
    bagging: Array
    inclusion: Array
    stability: Array
    low: Array
    high: Array


def best_members(losses: Array, share: float) -> IntArray:
    """Numbers of the best models, at least one, fewer where fewer have a finite loss; best first."""
    order = np.argsort(losses, kind="stable")
    count = max(1, round(share * len(losses)))
    return order[: min(count, int(np.isfinite(losses).sum()))]


def combine(members: Array, full_factor: Array, tau: float, solver: STRidge) -> Ensemble:
    """Bagging and stability selection of the best members.

    full_factor : (any, m + 1) factor of the problem over all rows, see `STRidge.fit_factor`.
    """
    inclusion = (members != 0).mean(axis=0)
    stable = np.flatnonzero(inclusion > tau)
    stability = np.zeros(members.shape[1])
    if len(stable):
        stability[stable] = solver.fit_factor(full_factor[:, np.append(stable, members.shape[1])])
    low, high = np.percentile(members, [5.0, 95.0], axis=0)
    return Ensemble(members, members.mean(axis=0), inclusion, stability, low, high)
