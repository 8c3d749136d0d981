"""Compiled steps of diffusion and heat for the extended path."""

import math

from numba import njit

from aesi.constants import GAS_CONSTANT_J_MOL_K
from aesi.physics.espm.kernels import FASTMATH, compiled, lookup, positive_salt, share_ahead, step_weights

EXACT_SHARE = 0.78
"""Share of the largest diffusivity in a particle that is stepped exactly: between `CORRECTED_MARGIN`, above which the
explicit rest is stable, and 1. Under pulses to 1.4C at 10 degC, the error of the files of an LG 18650HG2 and of a
Panasonic NCR18650PF against steps of 1/32 s is 0.08 and 0.11 mV RMS with it, 0.07 and 0.09 with 0.6, and 0.10 and 0.14
with 1. The diffusivity is adapted to the profile at every step: where it changed by jumps, the voltage did by up to 0.4
mV, and a fit stopped there."""
DIFFUSIONS = (0, 1, 4)
"""Indices of the activation energies of diffusion: negative electrode, positive electrode, electrolyte."""


@njit(inline="always", fastmath=FASTMATH)
def arrhenius(energy, temperature, reference):  # type: ignore[no-untyped-def]
    """Factor of a rate at `temperature` over that at `reference` (K)."""
    return math.exp(energy / GAS_CONSTANT_J_MOL_K * (1.0 / reference - 1.0 / temperature))


@njit(inline="always", fastmath=FASTMATH)
def renew_weights(dt, missing, particles, e_rates, slot, modes):  # type: ignore[no-untyped-def]
    """Compute the decay and input weights for a step of dt s in `slot`: for particles with an adapted diffusivity, and
    for all other modes if they are `missing` there."""
    for u in range(modes.near.shape[0]):
        side = particles.place[u, 0]
        followed = particles.strength[side] > 0.0
        if followed:
            modes.near[u] = EXACT_SHARE * modes.largest[u]
        if followed or missing:
            factor = modes.faster[side] * modes.near[u]
            for j in range(particles.rates.shape[1]):
                w0, w1, w2 = step_weights(particles.rates[u, j] * factor, dt)
                modes.w[slot, u, 0, j], modes.w[slot, u, 1, j], modes.w[slot, u, 2, j] = w0, w1, w2
    if missing:
        for j in range(e_rates.shape[0]):
            w0, w1, w2 = step_weights(e_rates[j] * modes.faster[2], dt)
            modes.w_e[slot, 0, j], modes.w_e[slot, 1, j], modes.w_e[slot, 2, j] = w0, w1, w2


@njit(inline="always", fastmath=FASTMATH)
def step_electrolyte(  # type: ignore[no-untyped-def]
    j0, j1, deviation, ahead, faster, electrolyte, w, dissolved
):
    """Step the modes q and the concentrations c at the nodes.

    j0, j1 : cell current density at both ends.  deviation : (2 regions,) each region's current minus its share.
    ahead : see `share_ahead`.  faster : factor of temperature on the explicit part.
    """
    rates, gains, to_nodes, project = electrolyte[:4]
    psi, top, c0, one_minus_t = electrolyte.psi, electrolyte.top, electrolyte.c0, electrolyte.supply
    q, c, rest, forcing, before = dissolved[:5]
    strength = electrolyte.strength * faster
    regions = deviation.shape[0] // 2
    forcing.fill(0.0)
    if strength > 0.0:
        for i in range(rest.shape[0]):
            rest[i] = lookup(psi, c[i] / top)
        for i in range(rest.shape[0]):
            for j in range(forcing.shape[0]):
                forcing[j] += project[i, j] * rest[i]
    for j in range(q.shape[0]):
        source = -strength * rates[j] * forcing[j]
        slope = -strength * rates[j] * ahead * (forcing[j] - before[j])
        for r in range(regions):
            source += one_minus_t * (
                gains[r, j] * (j0 / regions + deviation[r])
                + gains[regions + r, j] * (-j0 / regions + deviation[regions + r])
            )
            slope += one_minus_t * (gains[r, j] - gains[regions + r, j]) * (j1 - j0) / regions
        q[j] = w[0, j] * q[j] + (w[1, j] + w[2, j]) * source + w[2, j] * slope
        before[j] = forcing[j]
    for i in range(c.shape[0]):
        level = c0
        for j in range(q.shape[0]):
            level += to_nodes[i, j] * q[j]
        c[i] = level


@njit(inline="always", fastmath=FASTMATH)
def step_particle(  # type: ignore[no-untyped-def]
    u, mean, z, u0, u1, dt, faster, near, particles, w, scratch
):
    """Step particle u under a current from u0 to u1; returns its new mean, the decrease of its surface per unit of
    current, and the largest diffusivity of its profile over that of the rates.

    faster : factor of temperature on the explicit part, which is predicted, then corrected once: the diffusivity minus
    the exactly stepped one, `near` times that of the rates. The correction is stable up to twice that; where the
    prediction is beyond, as after a rest at a slow place of a steep diffusivity, it is damped by as much as is beyond.
    """
    side, rates, gains, lump = (
        particles.place[u, 0],
        particles.rates[u],
        particles.gains[u],
        particles.lump[u],
    )
    strength, psi = particles.strength[side] * faster, particles.psi[side]
    at, project = particles.at, particles.project
    nodes, force, force_end = scratch
    taken, largest, exact = lump * dt, near, faster * (near - 1.0)
    force.fill(0.0)
    if strength > 0.0:
        solid_forcing(mean, z, at, project, psi, nodes, force)
        for j in range(z.shape[0]):
            force[j + 1] = strength * force[j + 1] - exact * z[j]
    for j in range(z.shape[0]):
        a, b = w[1, j], w[2, j]
        source = -rates[j] * force[j + 1]
        z[j] = w[0, j] * z[j] - gains[j] * (a * u0 + b * u1) + (a + b) * source
        taken += gains[j] * (a + b)
    mean -= lump * 0.5 * (u0 + u1) * dt
    if strength > 0.0:
        largest = 1.0 + particles.strength[side] * solid_forcing(mean, z, at, project, psi, nodes, force_end)
        beyond = faster * max(largest - 2.0 * near, 0.0)
        for j in range(z.shape[0]):
            weight = w[2, j] * rates[j]
            off = strength * force_end[j + 1] - exact * z[j] - force[j + 1]
            z[j] -= weight * off / (1.0 + weight * beyond)
    return mean, taken, largest


@njit(inline="always", fastmath=FASTMATH)
def slope_at(psi, s):  # type: ignore[no-untyped-def]
    """Slope of psi at position s in its table, linear between the middles of its cells.

    It is continuous: by the slope of the cell alone the exactly stepped diffusivity jumps where a profile enters the
    next one.
    """
    last = psi.shape[0] - 1
    middle = min(max(s - 0.5, 0.0), last - 1.0)
    cell = min(int(middle), last - 2)
    before, after = psi[cell + 1] - psi[cell], psi[cell + 2] - psi[cell + 1]
    return last * (before + (middle - cell) * (after - before))


@compiled
def solid_forcing(mean, z, at, project, psi, nodes, force):  # type: ignore[no-untyped-def]
    """force[k] : mode k of the integral psi of the diffusivity's variable part, at the profile of (mean, z).

    Beyond [0, 1] the diffusivity is constant.  Returns the largest slope of psi on the profile.
    """
    for i in range(nodes.shape[0]):
        level = mean
        for j in range(z.shape[0]):
            level += at[i, j + 1] * z[j]
        nodes[i] = level
    force.fill(0.0)
    steepest, last = -math.inf, psi.shape[0] - 1
    for i in range(nodes.shape[0]):
        s = nodes[i] * last
        cell = int(min(max(s, 0.0), last - 1.0))
        value = psi[cell] + (s - cell) * (psi[cell + 1] - psi[cell])
        steepest = max(steepest, slope_at(psi, s))
        for j in range(force.shape[0]):
            force[j] += project[j, i] * value
    return steepest


@njit(inline="always", fastmath=FASTMATH)
def observe_salt(c, c0, gauss, salt, log_salt, region_salt):  # type: ignore[no-untyped-def]
    """Salt at the Gauss points over rest, its mean logarithm and mean (mol/m3) in each region."""
    for i in range(gauss.shape[0]):
        g = 0.0
        for j in range(c.shape[0]):
            g += gauss[i, j] * c[j]
        salt[i] = positive_salt(g / c0)
    regions = log_salt.shape[0] // 2
    for r in range(2 * regions):
        g1, g2, g3 = salt[3 * r], salt[3 * r + 1], salt[3 * r + 2]
        log_salt[r] = (5.0 * math.log(g1 * g3) + 8.0 * math.log(g2)) / 18.0
        region_salt[r] = c0 * (5.0 * (g1 + g3) + 8.0 * g2) / 18.0


@njit(inline="always", fastmath=FASTMATH)
def mean_heat(start, end, i0, i1):  # type: ignore[no-untyped-def]
    """Mean heat over a step of linear current: quadratic in the current, with the resistance at the larger end."""
    if i0 == i1:
        return end
    resistance = start / (i0 * i0) if abs(i0) > abs(i1) else end / (i1 * i1)
    return 0.5 * (start + end) - resistance * (i1 - i0) ** 2 / 6.0


@njit(inline="always", fastmath=FASTMATH)
def with_unresolved(watts, drive, k):  # type: ignore[no-untyped-def]
    """Heat, W, with the part that the rows do not resolve in the step to sample k."""
    if drive.unresolved_heat.shape[0] > 0:
        watts += drive.unresolved_heat[k]
    return watts


@njit(inline="always", fastmath=FASTMATH)
def heated(t_k, watts, dt, heat, around_k):  # type: ignore[no-untyped-def]
    """Temperature after a step of constant heating; heat : capacity J/K, conductance W/K.  around_k : surroundings."""
    if heat[1] * dt < 1e-9 * heat[0]:
        return t_k + watts * dt / heat[0]
    settled = around_k + watts / heat[1]
    return settled + (t_k - settled) * math.exp(-heat[1] * dt / heat[0])


@njit(inline="always", fastmath=FASTMATH)
def stepped_temperature(drive, k, share, start_k, watts, dt, heat):  # type: ignore[no-untyped-def]
    """(temperature at the end of a step of constant heating, or as measured; that of the surroundings), K.

    share : of the way from sample k - 1 to k at the end of the step.  watts : released at its start.
    """
    measured, around_k = drive.temperature, heat[2]
    if drive.has_temperature:
        around_k = measured[k - 1] + (measured[k] - measured[k - 1]) * share
    if heat[0] > 0.0:
        t_k = heated(start_k, with_unresolved(watts, drive, k), dt, heat, around_k)
    elif drive.has_temperature:
        t_k = around_k
    else:
        t_k = start_k
    return t_k, around_k


@njit(inline="always", fastmath=FASTMATH)
def renew_factors(t_k, t_weights, within_k, energies, reference_k, faster, keys):  # type: ignore[no-untyped-def]
    """Compute the factors of temperature on diffusion where the temperature has changed by more than `within_k` since
    `t_weights`; returns the temperature (K) for which they now hold.

    energies : (8,) J/mol.  faster : (3,) is set.  keys : (slots,) of the kept weights, which then become invalid.
    """
    if abs(t_k - t_weights) <= within_k:
        return t_weights
    keys.fill(-1)
    for i in range(3):
        faster[i] = arrhenius(energies[DIFFUSIONS[i]], t_k, reference_k)
    return t_k


@compiled
def diffuse(  # type: ignore[no-untyped-def]
    j0, j1, dt, last_step, slot, particles, electrolyte, memory, modes, dissolved
):
    """Step salt and particles under the cell's current density from j0 to j1, with the last deviations.

    last_step : length of the previous step, s, 0 for the first.
    """
    ahead = share_ahead(dt, last_step)
    step_electrolyte(
        j0, j1, memory.deviation, ahead, modes.faster[2], electrolyte, modes.w_e[slot], dissolved
    )
    scratch = modes.nodes, modes.force, modes.force_end
    for u in range(modes.means.shape[0]):
        side = particles.place[u, 0]
        nominal = particles.share[u] if side == 0 else -particles.share[u]
        modes.means[u], memory.theta_per_y[u], modes.largest[u] = step_particle(
            u, modes.means[u], modes.z[u], nominal * j0, nominal * j1, dt, modes.faster[side], modes.near[u],
            particles, modes.w[slot, u], scratch,
        )  # fmt: skip


@njit(inline="always", fastmath=FASTMATH)
def predict_surfaces(memory, modes):  # type: ignore[no-untyped-def]
    """Surface stoichiometries if each unit carries its share."""
    for u in range(modes.means.shape[0]):
        surface = modes.means[u]
        for j in range(modes.z.shape[1]):
            surface += modes.z[u, j]
        memory.pred[u] = surface
