"""Compiled transport: states of particles and salt at the end of a step, as linear functions of the reaction there.

For a reaction that is linear in time from y0 at the start of a step to y1 at its end, each mode is exact:

    z1 = E z0 - gain (a y0 + b y1) - rate (a f0 + b f1)

with E, a, b of `kernels.step_weights` and f the diffusion beyond that of the constant diffusivity. `base_...` is z1
with y1 = 0. In a particle the constant diffusivity is adapted to the profile at every step, as in the single particle
(`transport_kernels.EXACT_SHARE`): f is the mode of the flux of all diffusion less `near` times z.
"""

from numba import njit

from aesi.physics.espm.kernels import FASTMATH, compiled, lookup, step_weights
from aesi.physics.espm.transport_kernels import EXACT_SHARE


@compiled
def renew_particles(p, largest, near, faster, dt, missing, w, taken):  # type: ignore[no-untyped-def]
    """Compute the weights for one step length and factors `faster` (3,) of diffusion, see `renew_salt`: for particles
    with an adapted diffusivity, and for all others if they are `missing`.

    largest, near : (kinds,) of the profile, over that of the rates: in, and what is stepped exactly, out.
    Out: w (kinds, 3, modes).  taken (kinds,) s, what a unit of y1 takes off a surface, over `scale`.
    """
    for k in range(p.rates.shape[0]):
        followed = p.strength[p.side[k]] > 0.0
        if followed:
            near[k] = EXACT_SHARE * largest[k]
        if followed or missing:
            renew_kind(p, k, near[k] * faster[p.side[k]], dt, w, taken)


@njit(inline="always", fastmath=FASTMATH)
def renew_kind(p, k, factor, dt, w, taken):  # type: ignore[no-untyped-def]
    """As `renew_particles`, for one kind of particle, at `factor` times its rates."""
    taken[k] = 1.5 * dt  # part of the mean: three times half a step
    for j in range(p.rates.shape[1]):
        w[k, 0, j], w[k, 1, j], w[k, 2, j] = step_weights(p.rates[k, j] * factor, dt)
        taken[k] += p.gains[j] * w[k, 2, j]


@compiled
def renew_salt(s, faster, dt, w_salt, spread):  # type: ignore[no-untyped-def]
    """Compute the weights for one step length and factors `faster` (3,) of diffusion (negative, positive, salt).

    Out: w_salt (3, modes).  spread (places, places) m2/A, change of the salt over rest at r per reaction at v.
    """
    for j in range(s.rates.shape[0]):
        w_salt[0, j], w_salt[1, j], w_salt[2, j] = step_weights(s.rates[j] * faster[2], dt)
    for r in range(s.at.shape[0]):
        for v in range(r + 1):
            total = 0.0
            for j in range(s.at.shape[1]):
                total += s.at[r, j] * w_salt[2, j] * s.at[v, j]
            spread[r, v] = spread[v, r] = s.supply * total / s.c0


@compiled
def set_particle_bases(p, state, t, faster, dt, w):  # type: ignore[no-untyped-def]
    """Set t.base_z, t.base_mean and t.theta_base: modes, means and surfaces of all particles at the end of the step,
    for zero reaction there."""
    for u in range(p.place.shape[0]):
        k = p.kind[u]
        side = p.side[k]
        varies = p.strength[side] > 0.0
        t.base_mean[u] = state.mean[u] - 1.5 * p.scale[u] * dt * t.y_start[u]
        surface = t.base_mean[u]
        for j in range(p.gains.shape[0]):
            value = w[k, 0, j] * state.z[u, j] - p.scale[u] * p.gains[j] * w[k, 1, j] * t.y_start[u]
            if varies:
                value -= faster[side] * p.rates[k, j] * (
                    w[k, 1, j] * (state.flow[u, j] - t.near[k] * state.z[u, j]) + w[k, 2, j] * t.rest[u, j]
                )  # fmt: skip
            t.base_z[u, j] = value
            surface += value
        t.theta_base[u] = surface


@njit(inline="always", fastmath=FASTMATH)
def end_mode(p, t, u, j, y, w):  # type: ignore[no-untyped-def]
    """Mode j of particle u with a reaction y at the end of the step."""
    return t.base_z[u, j] - p.scale[u] * p.gains[j] * w[p.kind[u], 2, j] * y


@njit(inline="always", fastmath=FASTMATH)
def end_mean(p, t, u, y, dt):  # type: ignore[no-untyped-def]
    """Mean of particle u with a reaction y at the end of the step."""
    return t.base_mean[u] - 1.5 * p.scale[u] * dt * y


@compiled
def set_salt_base(s, state, t, faster, w):  # type: ignore[no-untyped-def]
    """Set t.base_q and t.base_salt: modes of the salt, and salt over rest at the places, at the end of the step, for
    zero reaction there."""
    strength = s.strength * faster
    for j in range(s.rates.shape[0]):
        source = 0.0
        for v in range(s.at.shape[0]):
            source += s.at[v, j] * t.reaction_start[v]
        value = w[0, j] * state.q[j] + w[1, j] * s.supply * source
        if strength > 0.0:
            value -= strength * s.rates[j] * (w[1, j] * state.forcing[j] + w[2, j] * t.forcing[j])
        t.base_q[j] = value
    salt_at_places(s, t.base_q, t.base_salt)


@njit(inline="always", fastmath=FASTMATH)
def end_salt(s, t, reaction, w):  # type: ignore[no-untyped-def]
    """Set modes t.q and concentrations t.c (mol/m3, at the nodes) at the end of the step, for `reaction` (places,) A/m2
    there."""
    for i in range(t.c.shape[0]):
        t.c[i] = s.c0
    for j in range(t.q.shape[0]):
        source = 0.0
        for v in range(s.at.shape[0]):
            source += s.at[v, j] * reaction[v]
        t.q[j] = t.base_q[j] + w[2, j] * s.supply * source
    for i in range(t.c.shape[0]):
        for j in range(t.q.shape[0]):
            t.c[i] += s.to_nodes[i, j] * t.q[j]


@compiled
def salt_at_places(s, q, salt):  # type: ignore[no-untyped-def]
    """Set salt (places,), the concentration over rest, from the modes q."""
    for r in range(s.at.shape[0]):
        value = 0.0
        for j in range(q.shape[0]):
            value += s.at[r, j] * q[j]
        salt[r] = 1.0 + value / s.c0


@compiled
def salt_forcing(s, c, forcing):  # type: ignore[no-untyped-def]
    """forcing[j] : mode j of the integral psi of the diffusivity's variable part, at concentrations c of the nodes."""
    forcing[:] = 0.0
    for i in range(c.shape[0]):
        value = lookup(s.psi, c[i] / s.top)
        for j in range(forcing.shape[0]):
            forcing[j] += s.project[i, j] * value


@compiled
def place_drops(kappa, path, before, after, solid, ohm):  # type: ignore[no-untyped-def]
    """ohm[r, v] (ohm m2): drop from the collector to place r and on to the separator, per current at point v.

    kappa : (places,) S/m.  path : (2,) thickness over transport efficiency, m.  solid : (2, points, points) ohm m2.
    """
    n = before.shape[0]
    for r in range(2 * n):
        side, i = r // n, r % n
        for v in range(n):
            ohm[r, v] = solid[side, i, v]
        for m in range(n):
            part = path[side] * after[i, m] / kappa[side * n + m]
            for v in range(n):
                ohm[r, v] += part * before[m, v]
