"""Compiled time stepping of the model where only the diffusion in the electrolyte is nonlinear.

Modes of solid diffusion are stepped exactly for a current that is constant or linear within a step. The
electrolyte is stepped exactly for a constant diffusivity d0; the rest, psi(c), is extrapolated over a step
from the last two (exponential Adams-Bashforth of order two).
"""

import math

from numba import njit

from aesi.physics.espm.kernels import (
    FASTMATH,
    compiled,
    kinetic_ratio,
    lookup,
    mean_asinh,
    open_circuit,
    out_of_range,
    parts_of,
    positive_salt,
    salt_at_separator,
    share_ahead,
    slot_of,
    step_weights,
)


@compiled
def step_plain_record(time, current, backward, theta0, solid, salt, cell, memory, out):  # type: ignore[no-untyped-def]
    """Step all samples; the rows of `out`, (7, n), are those of `plain.run_plain`.

    theta0 : (2,) stoichiometries at rest.  solid, salt, cell, memory : see `plain_layout`.
    Returns the first sample at which a surface (1 negative, 2 positive) or the electrolyte (3) left its range.
    """
    c = memory.c
    mean_n, mean_p = theta0[0], theta0[1]
    above_n, above_p, last_step = 0.0, 0.0, 0.0
    fault_at, fault = -1, 0
    c.fill(cell.c0)
    for k in range(time.shape[0]):
        i1 = current[k]
        if k > 0:
            dt = time[k] - time[k - 1]
            i0 = i1 if backward else current[k - 1]
            slot, missing = slot_of(dt, memory.keys)
            if missing:
                renew_plain_weights(dt, slot, solid, salt, memory)
            above_n = step_solid(memory.z_n, memory.w_n, slot, -i0, -i1)
            above_p = step_solid(memory.z_p, memory.w_p, slot, i0, i1)
            charge = 0.5 * (i0 + i1) * dt
            mean_n -= solid.lump[0] * charge
            mean_p += solid.lump[1] * charge
            last_step = step_salt(i0, i1, dt, last_step, slot, cell, salt, memory)
        theta_n, theta_p = mean_n + above_n, mean_p + above_p
        salt_at_gauss_points(c, cell.c0, salt.gauss, memory.g)
        out[0, k] = voltage(i1, theta_n, theta_p, cell, salt, c, memory.g)
        out[1, k], out[2, k] = theta_n, theta_p
        out[3, k], out[4, k] = c[0], c[c.shape[0] - 1]
        out[5, k], out[6, k] = mean_n, mean_p
        if fault_at < 0:
            fault = out_of_range(theta_n, theta_p, salt_at_separator(c, cell.c0))
            if fault > 0:
                fault_at = k
    return fault_at, fault


@compiled
def renew_plain_weights(dt, slot, solid, salt, memory):  # type: ignore[no-untyped-def]
    """Compute the weights of a step of `dt` s: for the particles' modes, and for the parts that the electrolyte takes
    it in."""
    rates, gains = solid.rates, solid.gains
    w_n, w_p, w_e = memory.w_n, memory.w_p, memory.w_e
    parts = parts_of(dt, salt.substep, salt.most, salt.finer) if salt.nonlinear else 1
    memory.parts[slot] = parts
    for j in range(rates.shape[1]):
        decay, start, end = step_weights(rates[0, j], dt)
        w_n[slot, 0, j], w_n[slot, 1, j], w_n[slot, 2, j] = decay, start * gains[0, j], end * gains[0, j]
        decay, start, end = step_weights(rates[1, j], dt)
        w_p[slot, 0, j], w_p[slot, 1, j], w_p[slot, 2, j] = decay, start * gains[1, j], end * gains[1, j]
    for j in range(salt.rates.shape[0]):
        rate = salt.rates[j]
        decay, start, end = step_weights(rate, dt / parts)
        w_e[slot, 0, j], w_e[slot, 3, j] = decay, (start + end) * rate * salt.strength
        w_e[slot, 1, j], w_e[slot, 2, j] = start * salt.gains[j], end * salt.gains[j]
        w_e[slot, 4, j] = end * rate * salt.strength


@njit(inline="always", fastmath=FASTMATH)
def step_solid(z, w, slot, u0, u1):  # type: ignore[no-untyped-def]
    """Step the modes z of a particle under a charging current from u0 to u1; returns its surface above its mean."""
    above = 0.0
    for j in range(z.shape[0]):
        z[j] = w[slot, 0, j] * z[j] + w[slot, 1, j] * u0 + w[slot, 2, j] * u1
        above += z[j]
    return above


@njit(inline="always", fastmath=FASTMATH)
def step_salt(i0, i1, dt, last_step, slot, cell, salt, memory):  # type: ignore[no-untyped-def]
    """Step the electrolyte's modes q and the concentrations c at its nodes; returns the length of one part.

    last_step : length of the previous part, s, 0 for the first.
    """
    q, c, forcing, before, w = memory.q, memory.c, memory.forcing, memory.before, memory.w_e
    parts = memory.parts[slot]
    length = dt / parts
    for part in range(parts):
        u0 = i0 + (i1 - i0) * part / parts
        u1 = i0 + (i1 - i0) * (part + 1) / parts
        if salt.nonlinear:
            for j in range(c.shape[0]):
                memory.rest[j] = lookup(salt.psi, c[j] / cell.top)
            forcing.fill(0.0)
            for i in range(c.shape[0]):
                for j in range(q.shape[0]):
                    forcing[j] += salt.project[i, j] * memory.rest[i]
        ahead = share_ahead(length, last_step)
        for j in range(q.shape[0]):
            q[j] = (
                w[slot, 0, j] * q[j]
                + w[slot, 1, j] * u0
                + w[slot, 2, j] * u1
                - w[slot, 3, j] * forcing[j]
                - w[slot, 4, j] * ahead * (forcing[j] - before[j])
            )
            before[j] = forcing[j]
        last_step = length
        for i in range(c.shape[0]):
            level = cell.c0
            for j in range(q.shape[0]):
                level += salt.to_nodes[i, j] * q[j]
            c[i] = level
    return last_step


@njit(inline="always", fastmath=FASTMATH)
def salt_at_gauss_points(c, c0, gauss, g):  # type: ignore[no-untyped-def]
    """Set g (6,): salt over rest at the Gauss points of both electrodes, kept positive."""
    nodes = c.shape[0]
    width = (nodes - 1) // 3 + 1
    for i in range(6):
        first = 0 if i < 3 else nodes - width
        value = 0.0
        for j in range(width):
            value += gauss[i, first + j] * c[first + j]
        g[i] = positive_salt(value / c0)


@njit(inline="always", fastmath=FASTMATH)
def voltage(current, theta_n, theta_p, cell, salt, c, g):  # type: ignore[no-untyped-def]
    """Terminal voltage from the surfaces and the salt.  g : see `salt_at_gauss_points`."""
    density = current / cell.area
    s_n = kinetic_ratio(density / cell.reactive_n, cell.exchange_n, theta_n)
    s_p = kinetic_ratio(density / cell.reactive_p, cell.exchange_p, theta_p)
    eta = mean_asinh(s_n, g[0], g[1], g[2]) + mean_asinh(s_p, g[3], g[4], g[5])
    eta = 2.0 * cell.thermal_v * math.copysign(eta, current)
    outer, inner = (g[3] * g[5]) / (g[0] * g[2]), g[4] / g[1]
    inner = inner * inner
    outer = outer * outer * outer * outer * outer * inner * inner * inner * inner
    concentration_v = cell.salt_v * math.log(outer) / 18.0
    c_mean = 0.0
    for j in range(c.shape[0]):
        c_mean += salt.mean[j] * c[j]
    ohmic = (
        density * (cell.path / lookup(cell.kappa, c_mean / cell.top) + cell.solid) + current * cell.contact
    )
    return (
        open_circuit(cell.ocp_p, theta_p) - open_circuit(cell.ocp_n, theta_n) - eta + concentration_v - ohmic
    )
