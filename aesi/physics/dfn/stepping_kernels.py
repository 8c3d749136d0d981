"""Compiled step of the porous electrode, and its state at an instant at which the current jumps."""

import math

from numba import njit

from aesi.physics.dfn.diffusion_kernels import (
    end_mean,
    end_mode,
    end_salt,
    place_drops,
    renew_kind,
    salt_at_places,
    salt_forcing,
    set_particle_bases,
    set_salt_base,
)
from aesi.physics.dfn.reaction_kernels import GAS_OVER_FARADAY, solve_reaction
from aesi.physics.espm.interface_kernels import bounded_exp, end_weight, stripped
from aesi.physics.espm.kernels import FASTMATH, compiled, lookup
from aesi.physics.espm.tables import CORRECTED_MARGIN
from aesi.physics.espm.transport_kernels import solid_forcing

SALT_TOLERANCE = 1e-3
"""Largest error of the predicted salt, as a share of its rest concentration, before a step is repeated. Conductivity
and the variable part of diffusion, which use the prediction, are then accurate to 0.1 %."""
SURFACE_TOLERANCE = 1e-6
"""The same for the surface stoichiometry of a particle with a variable diffusivity."""
PASSES = 6
LARGEST_GROWTH = 4.0
"""Largest ratio of a step to the previous one with which start values are extrapolated."""


@compiled
def restore_start(state, t):  # type: ignore[no-untyped-def]
    """Restore the start of a step whose end was not found; only `commit` changes the rest of the state."""
    t.total[0], t.total[1] = t.before[0], t.before[1]
    for u in range(state.y.shape[0]):
        state.y[u] = t.y_back[u]
    for r in range(state.reaction.shape[0]):
        state.reaction[r] = t.reaction_start[r]
        state.psi[r] = t.psi_start[r]
        state.salt[r] = t.salt_before[r]


@compiled
def find_reaction(p, s, e, state, t, newton, spread, total, t_k):  # type: ignore[no-untyped-def]
    """Solve for the reaction, with the conductivity for the salt `t.salt`; returns as `solve_reaction`."""
    half = s.at.shape[0] // 2
    for r in range(2 * half):
        t.kappa[r] = t.rates[5] * lookup(s.kappa, t.salt[r] * s.c0 / s.top)
    place_drops(t.kappa, s.path, e.before, e.after, e.solid, t.ohm)
    return solve_reaction(
        p, e, t, newton, spread, total, t_k,
        state.y, state.theta, state.psi, state.reaction, state.salt,
    )  # fmt: skip


@compiled
def instant_reaction(p, s, e, state, t, newton, change, total, t_k):  # type: ignore[no-untyped-def]
    """The reaction at an instant: particles and salt stay as they are, the currents have jumped by `change` (2,), A/m2.
    Returns as `solve_reaction`."""
    half = s.at.shape[0] // 2
    for u in range(p.place.shape[0]):
        state.y[u] += p.share[u] * change[0 if p.place[u] < half else 1]
        state.trend[u] = 0.0
        t.theta_per_y[u] = 0.0
        t.theta_base[u] = state.mean[u]
        for j in range(p.gains.shape[0]):
            t.theta_base[u] += state.z[u, j]
    salt_at_places(s, state.q, t.base_salt)
    for r in range(2 * half):
        t.salt[r] = t.base_salt[r]
        t.layer_c[r], t.layer_old[r] = 0.0, 0.0
        t.metal_before[r], t.metal_filled[r] = state.plated[r], 0.0
    return find_reaction(p, s, e, state, t, newton, t.no_spread, total, t_k)


@compiled
def start_layers(e, state, t, newton, dt):  # type: ignore[no-untyped-def]
    """Double layers over a step, each as a conductance `t.layer_c` and a current `t.layer_old`.

    That is exact for a layer that relaxes by its kinetics at the start of the step: the conductance of the last
    solution at each place. The current of a layer decays faster than linearly, and the particles carry the rest.
    `t.lag` is their current beyond a linear one, as a current at the start of the step.
    """
    for r in range(e.capacity.shape[0]):
        kinetic = newton.conductance[r] - t.layer_c[r]
        t.layer_c[r], t.layer_old[r] = 0.0, 0.0
        if e.capacity[r] > 0.0:
            constants = dt * kinetic / e.capacity[r]
            weight = end_weight(constants)
            t.skew[r] = 2.0 * weight - 1.0
            t.lag[r] = t.skew[r] * state.layer[r] * (1.0 - math.exp(-constants))
            t.layer_c[r] = e.capacity[r] / (dt * weight)
            t.layer_old[r] = t.layer_c[r] * state.psi[r] + (1.0 - weight) / weight * state.layer[r]


@compiled
def start_metal(e, state, t, dt, t_k):  # type: ignore[no-untyped-def]
    """Plated lithium over a step, exact for metal that strips at the rate at the start of the step, t_k (K)."""
    thermal, alpha = GAS_OVER_FARADAY * t_k, e.plating[1]
    for r in range(state.plated.shape[0] // 2):
        strength, filled = e.plating[0] * e.node_share[r], e.plating_to_c * dt / e.node_share[r]
        salt = e.plating[2] * max(state.salt[r], 0.0)
        current = stripped(strength, alpha, state.plated[r], 0.0, salt, state.psi[r], thermal)[0]
        weight = end_weight(filled * strength * bounded_exp((1.0 - alpha) * state.psi[r] / thermal))
        t.metal_before[r] = state.plated[r] - (1.0 - weight) * filled * current
        t.metal_filled[r] = weight * filled


@compiled
def advance(  # type: ignore[no-untyped-def]
    p, s, e, state, t, newton, weights, slot, dt, last_dt, t_k, last_try
):
    """One step to the currents t.total, which changed by t.change; temperature t_k (K) at its end.

    weights, slot : those of the step's length.  last_dt : length of the previous step, s, 0 after a jump.
    last_try : take the step even without a solution.  Returns as `solve_reaction`.
    """
    faster, w, taken = t.faster, weights.particle[slot], weights.taken[slot]
    w_salt, spread = weights.salt[slot], weights.spread[slot]
    extrapolate(p, s, e, state, t, dt, last_dt, taken, t.change)
    varies = p.strength[0] > 0.0 or p.strength[1] > 0.0
    if varies:
        start_flows(p, state, t)
        set_particle_bases(p, state, t, faster, dt, w)
        end_flows(p, state, t, faster, dt, w, taken, True)
    phi_n, phi_p, steps = 0.0, 0.0, 0
    for passed in range(PASSES):
        set_salt_base(s, state, t, faster[2], w_salt)
        set_particle_bases(p, state, t, faster, dt, w)
        phi_n, phi_p, steps = find_reaction(p, s, e, state, t, newton, spread, t.total, t_k)
        end_salt(s, t, state.reaction, w_salt)
        if s.strength > 0.0:
            salt_forcing(s, t.c, t.forcing)
        off = 0.0
        for r in range(t.salt.shape[0]):
            off = max(off, abs(state.salt[r] - t.salt[r]))
            t.salt[r] = state.salt[r]
        settled = off < SALT_TOLERANCE
        if varies:
            more = passed + 1 < PASSES
            settled = end_flows(p, state, t, faster, dt, w, taken, more) < SURFACE_TOLERANCE and settled
        if settled:
            break
    if steps > 0 or last_try:
        commit(p, s, state, t, dt, w, t.change, varies)
        if e.plating[0] > 0.0:
            commit_metal(p, e, state, t, dt, t_k)
        if e.has_layers:
            commit_layers(p, e, state, t, dt, w)
    return phi_n, phi_p, steps


@njit(inline="always", fastmath=FASTMATH)
def extrapolate(p, s, e, state, t, dt, last_dt, taken, change):  # type: ignore[no-untyped-def]
    """Start values for the end of the step: shares of the current extrapolated by their trend, salt and forcing by
    their last change."""
    half = s.at.shape[0] // 2
    ahead = dt / last_dt if dt < LARGEST_GROWTH * last_dt else 0.0
    for r in range(2 * half):
        t.reaction_start[r] = state.reaction[r]
        t.psi_start[r] = state.psi[r]
        t.salt[r] = state.salt[r] + ahead * (state.salt[r] - t.salt_before[r])
        t.salt_before[r] = state.salt[r]
    for j in range(state.forcing.shape[0]):
        t.forcing[j] = state.forcing[j] + ahead * (state.forcing[j] - t.forcing_before[j])
        t.forcing_before[j] = state.forcing[j]
    for u in range(p.place.shape[0]):
        t.y_back[u] = state.y[u]
        t.y_start[u] = state.y[u]
        if e.has_layers:
            r = p.place[u]
            t.y_start[u] += p.share[u] / e.node_share[r] * t.lag[r]
        trend = state.trend[u] * dt if ahead > 0.0 else 0.0
        state.y[u] += p.share[u] * change[0 if p.place[u] < half else 1] + trend
        t.theta_per_y[u] = p.scale[u] * taken[p.kind[u]]


@njit(inline="always", fastmath=FASTMATH)
def start_flows(p, state, t):  # type: ignore[no-untyped-def]
    """Set t.rest, the diffusion beyond the exactly stepped part, at the start of the step."""
    for u in range(p.place.shape[0]):
        for j in range(p.gains.shape[0]):
            t.rest[u, j] = state.flow[u, j] - t.near[p.kind[u]] * state.z[u, j]


@njit(inline="always", fastmath=FASTMATH)
def end_flows(p, state, t, faster, dt, w, taken, more):  # type: ignore[no-untyped-def]
    """Set the diffusion at the end of the step, t.flow and t.rest; returns the largest change of a surface by it.

    more : True if another pass follows. Where the diffusivity has risen so far that passes would diverge, more of it is
    stepped exactly from then on.
    """
    worst = 0.0
    for u in range(p.place.shape[0]):
        k = p.kind[u]
        side = p.side[k]
        if p.strength[side] > 0.0:
            for j in range(p.gains.shape[0]):
                t.z_end[j] = end_mode(p, t, u, j, state.y[u], w)
            mean = end_mean(p, t, u, state.y[u], dt)
            steepest = solid_forcing(mean, t.z_end, p.at, p.project, p.psi[side], t.nodes, t.force)
            t.largest[k] = 1.0 + p.strength[side] * steepest
            last, moved = t.near[k], 0.0
            if more:
                t.near[k] = max(last, CORRECTED_MARGIN * t.largest[k])
            for j in range(p.gains.shape[0]):
                t.flow[u, j] = t.z_end[j] + p.strength[side] * t.force[j + 1]
                before = t.rest[u, j]
                t.rest[u, j] = t.flow[u, j] - t.near[k] * t.z_end[j]
                moved += faster[side] * p.rates[k, j] * w[k, 2, j] * (t.rest[u, j] - before)
            worst = max(worst, abs(moved))
            if t.near[k] > last:
                renew_kind(p, k, t.near[k] * faster[side], dt, w, taken)
                t.theta_per_y[u] = p.scale[u] * taken[k]
                worst = math.inf
    return worst


@njit(inline="always", fastmath=FASTMATH)
def commit(p, s, state, t, dt, w, change, varies):  # type: ignore[no-untyped-def]
    """Set the state to the end of the step."""
    half = s.at.shape[0] // 2
    for u in range(p.place.shape[0]):
        state.mean[u] = end_mean(p, t, u, state.y[u], dt)
        for j in range(p.gains.shape[0]):
            state.z[u, j] = end_mode(p, t, u, j, state.y[u], w)
        moved = p.share[u] * change[0 if p.place[u] < half else 1]
        state.trend[u] = (state.y[u] - t.y_back[u] - moved) / dt
        if varies:
            state.largest[p.kind[u]] = t.largest[p.kind[u]]
            for j in range(p.gains.shape[0]):
                state.flow[u, j] = t.flow[u, j]
    for j in range(state.q.shape[0]):
        state.q[j] = t.q[j]
        state.forcing[j] = t.forcing[j]
    for i in range(state.c.shape[0]):
        state.c[i] = t.c[i]


@compiled
def commit_metal(p, e, state, t, dt, t_k):  # type: ignore[no-untyped-def]
    """Set the plated lithium at the end of the step, before `commit_layers`; particles get the exact remainder."""
    for r in range(state.plated.shape[0] // 2):
        metal = stripped(
            e.plating[0] * e.node_share[r], e.plating[1], t.metal_before[r], t.metal_filled[r],
            e.plating[2] * max(state.salt[r], 0.0), state.psi[r], GAS_OVER_FARADAY * t_k,
        )[2]  # fmt: skip
        layers = state.layer[r] + t.layer_c[r] * state.psi[r] - t.layer_old[r]
        gave = (state.plated[r] - metal) * e.node_share[r] / (e.plating_to_c * dt)
        rest = t.reaction_start[r] + state.reaction[r] - layers - 2.0 * gave
        for u in range(p.place.shape[0]):
            if p.place[u] == r:
                rest -= t.y_back[u] + state.y[u]
        for u in range(p.place.shape[0]):
            if p.place[u] == r:
                state.mean[u] -= 1.5 * p.scale[u] * dt * p.share[u] / e.node_share[r] * rest
        state.plated[r] = metal


@compiled
def commit_layers(p, e, state, t, dt, w):  # type: ignore[no-untyped-def]
    """Set the currents into double layers at the end of the step; particles get the exact remainder at its start.

    It is in their modes, too: there an error of the prediction that recurs at every step would stay."""
    for r in range(e.capacity.shape[0]):
        begun = state.layer[r]
        state.layer[r] = t.layer_c[r] * state.psi[r] - t.layer_old[r]
        t.lag[r] -= t.skew[r] * (begun - state.layer[r])
    for u in range(p.place.shape[0]):
        r = p.place[u]
        given = p.scale[u] * p.share[u] / e.node_share[r] * t.lag[r]
        state.mean[u] += 1.5 * dt * given
        for j in range(p.gains.shape[0]):
            more = p.gains[j] * w[p.kind[u], 1, j] * given
            state.z[u, j] += more
            state.flow[u, j] += t.near[p.kind[u]] * more
