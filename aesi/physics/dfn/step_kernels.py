"""Compiled step of the porous electrode, and its state at an instant at which the current jumps."""

from numba import njit

from aesi.physics.dfn.newton_kernels import solve_reaction
from aesi.physics.dfn.transport_kernels import (
    calm_particles,
    calm_salt,
    drops,
    end_particle,
    end_salt,
    salt_at_places,
    salt_forcing,
)
from aesi.physics.espm.electrode_kernels import end_weight
from aesi.physics.espm.kernels import FASTMATH, lookup
from aesi.physics.espm.transport_kernels import GAS, arrhenius, solid_forcing

GAS_OVER_FARADAY = GAS / 96485.33212331001
SALT_TOLERANCE = 1e-4
"""Of the rest concentration: how far from its prediction the salt may end before a step is repeated."""
SURFACE_TOLERANCE = 1e-6
"""Of stoichiometry: the same of a surface whose diffusivity varies."""
PASSES = 6


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def find_reaction(p, s, e, state, t, give, spread, total, t_k):  # type: ignore[no-untyped-def]
    """Solve for the reaction; returns the collectors' potentials and the iterations, see `solve_reaction`."""
    half = s.at.shape[0] // 2
    thermal = GAS_OVER_FARADAY * t_k
    for side in range(2):
        low, high = side * half, (side + 1) * half
        drops(t.kappa[low:high], s.path[side], e.before, e.after, e.solid[side], t.ohm[low:high])
    faster_n = arrhenius(e.energies[2], t_k, e.reference_k)
    faster_p = arrhenius(e.energies[3], t_k, e.reference_k)
    for u in range(p.place.shape[0]):
        t.exchange[u] = p.exchange[u] * (faster_n if p.place[u] < half else faster_p)
    return solve_reaction(
        p.place, t.exchange, t.reach, give, e.ocp, e.entropic, t_k - e.reference_k, thermal, e.alpha,
        2.0 * (1.0 - e.transference) * thermal, total, t.calm_salt, spread, t.ohm, t.layer_c, t.layer_old,
        e.plating, state.plated, e.node_share,
        state.y, state.theta, state.psi, state.given, state.salt, state.plating, t.work, t.rhs,
    )  # fmt: skip


@njit(inline="always", fastmath=FASTMATH)
def conductivity_at(s, e, salt, t_k, kappa):  # type: ignore[no-untyped-def]
    """kappa (places,) S/m at the salt (over rest) of the places."""
    warmer = arrhenius(e.energies[5], t_k, e.reference_k)
    for r in range(salt.shape[0]):
        kappa[r] = warmer * lookup(s.kappa, salt[r] * s.c0 / s.top)


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def settle(p, s, e, state, t, change, total, t_k):  # type: ignore[no-untyped-def]
    """The reaction at an instant: particles and salt stay as they are, the current has jumped by `change` (2,)."""
    half = s.at.shape[0] // 2
    for u in range(p.place.shape[0]):
        state.y[u] += p.share[u] * change[0 if p.place[u] < half else 1]
        state.trend[u] = 0.0
        t.reach[u] = state.mean[u] + state.z[u].sum()
    salt_at_places(s, state.q, t.calm_salt)
    conductivity_at(s, e, t.calm_salt, t_k, t.kappa)
    t.layer_c[:] = 0.0
    t.layer_old[:] = 0.0
    return find_reaction(p, s, e, state, t, t.no_give, t.no_spread, total, t_k)


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def hold_layers(e, state, t, dt, thermal):  # type: ignore[no-untyped-def]
    """Double layers over a step as a conductance and a current; exact for one that relaxes by its own kinetics."""
    for r in range(e.capacity.shape[0]):
        t.layer_c[r], t.layer_old[r] = 0.0, 0.0
        if e.capacity[r] > 0.0:
            resistance = thermal / e.exchange[r]
            weight = end_weight(dt / (e.capacity[r] * resistance))
            t.layer_c[r] = e.capacity[r] / (dt * weight)
            t.layer_old[r] = t.layer_c[r] * state.psi[r] + (1.0 - weight) / weight * state.layer[r]


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def advance(p, s, e, state, t, faster, dt, last_dt, w, taken, w_salt, spread, total, change, t_k):  # type: ignore[no-untyped-def]
    """One step to the currents `total` (2,), which changed by `change` (2,); temperature t_k at its end.

    last_dt : of the step before, 0 after a jump.  Returns as `solve_reaction`.
    """
    half, units, places = s.at.shape[0] // 2, p.place.shape[0], s.at.shape[0]
    t.y_start[:] = state.y
    t.given_start[:] = state.given
    for r in range(places):
        state.given[r] = t.given_start[r] + e.node_share[r] * change[0 if r < half else 1]
    for u in range(units):
        moved = p.share[u] * change[0 if p.place[u] < half else 1]
        state.y[u] += moved + state.trend[u] * dt
        state.given[p.place[u]] += state.trend[u] * dt
        t.give[u] = p.scale[u] * taken[p.kind[u]]
    t.force[:] = state.force
    t.forcing[:] = state.forcing
    calm_salt(s, state, t, faster[2], w_salt)
    end_salt(s, t, state.given, w_salt, t.q, t.c_predicted)
    phi_n, phi_p, steps, off = 0.0, 0.0, 0, 0.0
    varies = p.strength[0] > 0.0 or p.strength[1] > 0.0
    if varies:
        calm_particles(p, state, t, faster, dt, w)
        end_forces(p, state, t, dt, w)
    for _ in range(PASSES):
        if s.strength > 0.0:
            salt_forcing(s, t.c_predicted, t.forcing)
            calm_salt(s, state, t, faster[2], w_salt)
        calm_particles(p, state, t, faster, dt, w)
        salt_at_places(s, t.q, t.salt)
        conductivity_at(s, e, t.salt, t_k, t.kappa)
        phi_n, phi_p, steps = find_reaction(p, s, e, state, t, t.give, spread, total, t_k)
        end_salt(s, t, state.given, w_salt, t.q, t.c)
        off = 0.0
        for i in range(t.c.shape[0]):
            off = max(off, abs(t.c[i] - t.c_predicted[i]))
            t.c_predicted[i] = t.c[i]
        settled = off < SALT_TOLERANCE * s.c0
        if varies:
            settled = end_forces(p, state, t, dt, w) < SURFACE_TOLERANCE and settled
        if settled:
            break
    commit(p, s, state, t, dt, last_dt, w, change, half, varies)
    return phi_n, phi_p, steps


@njit(inline="always", fastmath=FASTMATH)
def end_forces(p, state, t, dt, w):  # type: ignore[no-untyped-def]
    """Variable part of diffusion at the end of the step, t.force; returns by how much it moves a surface."""
    worst = 0.0
    for u in range(p.place.shape[0]):
        k = p.kind[u]
        side = p.side[k]
        if p.strength[side] > 0.0:
            mean = end_particle(p, t, u, state.y[u], dt, w, t.z_end)
            t.force_end[:] = t.force[u]
            solid_forcing(mean, t.z_end, p.at, p.project, p.psi[side], t.nodes, t.force[u])
            moved = 0.0
            for j in range(p.gains.shape[0]):
                moved += (
                    p.strength[side] * p.rates[k, j] * w[k, 2, j] * (t.force[u, j + 1] - t.force_end[j + 1])
                )
            worst = max(worst, abs(moved))
    return worst


@njit(inline="always", fastmath=FASTMATH)
def commit(p, s, state, t, dt, last_dt, w, change, half, varies):  # type: ignore[no-untyped-def]
    """Take the end of the step as the state."""
    for u in range(p.place.shape[0]):
        state.mean[u] = end_particle(p, t, u, state.y[u], dt, w, state.z[u])
        moved = p.share[u] * change[0 if p.place[u] < half else 1]
        state.trend[u] = (state.y[u] - t.y_start[u] - moved) / dt
    state.q[:] = t.q
    state.c[:] = t.c
    if s.strength > 0.0:
        salt_forcing(s, state.c, state.forcing)
    if varies:
        state.force[:] = t.force
    for r in range(state.layer.shape[0]):
        state.layer[r] = t.layer_c[r] * state.psi[r] - t.layer_old[r]
