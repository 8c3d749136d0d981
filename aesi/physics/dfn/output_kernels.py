"""Compiled outputs of the porous electrode at a sample, and the state that left its range there."""

from numba import njit

from aesi.physics.espm.kernels import FASTMATH, compiled

UNDERSHOOT = 0.02
"""Largest undershoot of the salt below zero, as a share of its rest concentration. The reaction stops at a place where
the salt is used up, and the salt stays at zero there. Its polynomial undershoots by 0.8 % at worst before the cut-off
(LG HG2 at -2 degC and 3.2C, 0.2 % with 20 points)."""


@njit(inline="always", fastmath=FASTMATH)
def smallest(values):  # type: ignore[no-untyped-def]
    """The smallest of (n,) values; NaN where one of them is."""
    low = values[0]
    for value in values:
        if not value >= low:
            low = value
    return low


@njit(inline="always", fastmath=FASTMATH)
def mean_surfaces(p, theta, half):  # type: ignore[no-untyped-def]
    """Mean surface stoichiometry of each electrode, negative and positive."""
    theta_n, theta_p = 0.0, 0.0
    for u in range(p.place.shape[0]):
        if p.place[u] < half:
            theta_n += p.share[u] * theta[u]
        else:
            theta_p += p.share[u] * theta[u]
    return theta_n, theta_p


@compiled
def record(p, e, state, half, out, k):  # type: ignore[no-untyped-def]
    """Write sample k of `out`: averages of the electrodes, salt at the collectors, plated lithium."""
    out[1, k], out[2, k] = mean_surfaces(p, state.theta, half)
    out[5, k], out[6, k] = 0.0, 0.0
    for u in range(p.place.shape[0]):
        side = 0 if p.place[u] < half else 1
        out[5 + side, k] += p.volume[u] * state.mean[u]
    out[3, k], out[4, k] = state.c[0], state.c[state.c.shape[0] - 1]
    out[8, k] = 0.0
    for r in range(half):
        out[8, k] += state.plated[r] * e.node_share[r]


@compiled
def record_profile(k, p, e, state, profile, salt_profile):  # type: ignore[no-untyped-def]
    """Write sample k of the profiles: the quantities of each place, and the salt at each node."""
    for r in range(state.reaction.shape[0]):
        profile[k, 1, r] = state.reaction[r] / e.node_share[r]
        profile[k, 2, r] = state.salt[r]
        profile[k, 3, r] = state.psi[r]
    for u in range(p.place.shape[0]):
        profile[k, 0, p.place[u]] += state.theta[u] * p.share[u] / e.node_share[p.place[u]]
    for i in range(state.c.shape[0]):
        salt_profile[k, i] = state.c[i]


@njit(inline="always", fastmath=FASTMATH)
def left_range(theta_n, theta_p, c, c0):  # type: ignore[no-untyped-def]
    """The state that left its range: 1 negative surfaces, 2 positive surfaces, 3 salt, 0 none."""
    if not 0.0 <= theta_n <= 1.0:
        return 1
    if not 0.0 <= theta_p <= 1.0:
        return 2
    return 0 if smallest(c) >= -UNDERSHOOT * c0 else 3
