"""Compiled time stepping of the model where nothing but the electrolyte's diffusivity is nonlinear.

Modes of solid diffusion are stepped exactly for a current that is constant or linear within a step. The
electrolyte is stepped exactly for a constant diffusivity d0; the rest, psi(c), is extrapolated over a step
from the last two (exponential Adams-Bashforth of order two).
"""

import math

import numpy as np
from numba import njit

FASTMATH = {"reassoc", "contract", "arcp", "nsz"}
CACHE_SLOTS = 64
NANOSECONDS = 1e9
BEYOND_RANGE_V = 10.0
"""Slope (V per unit of stoichiometry) at which open-circuit potentials go on outside [0, 1]."""
SMALLEST_OCCUPANCY = 1e-9
NEARLY_DRY = 0.1
"""Of the salt at rest: below this the reaction withdraws to where there is salt, which one particle an electrode does
not see. A porous electrode's salt tends to nought where that of a uniform reaction passes it (an LG 18650HG2 under US06
at 10 degC: 56 mol/m3 against -104 at the wall)."""
SMALLEST_EXPONENT = -10.0
"""Of the salt that is left: products of its powers stay above what a number can hold."""
LARGEST_RATIO = 1e12
"""Above it the product of ten factors would leave the range of a number."""


@njit(inline="always", fastmath=FASTMATH)
def lookup(table, position):  # type: ignore[no-untyped-def]
    """Linear interpolation on a uniform grid over [0, 1]; constant beyond."""
    last = table.shape[0] - 1
    s = min(max(position, 0.0), 1.0) * last
    i = min(int(s), last - 1)
    return table[i] + (s - i) * (table[i + 1] - table[i])


@njit(inline="always", fastmath=FASTMATH)
def open_circuit(table, theta):  # type: ignore[no-untyped-def]
    """Potential at `theta`, falling on at a fixed slope outside [0, 1]."""
    inside = min(max(theta, 0.0), 1.0)
    return lookup(table, inside) - BEYOND_RANGE_V * (theta - inside)


@njit(inline="always", fastmath=FASTMATH)
def wet(salt):  # type: ignore[no-untyped-def]
    """Salt over rest, kept positive: itself down to `NEARLY_DRY`, then falling to nought with the slope it had."""
    return (
        salt if salt >= NEARLY_DRY else NEARLY_DRY * math.exp(max(salt / NEARLY_DRY, SMALLEST_EXPONENT) - 1.0)
    )


@njit(inline="always", fastmath=FASTMATH)
def step_weights(rate, dt):  # type: ignore[no-untyped-def]
    """exp(-rate dt), and the integrals over the step that weigh the input at its start and at its end."""
    z = rate * dt
    if z < 1e-4:
        decay = 1.0 - z * (1.0 - 0.5 * z)
        whole = dt * (1.0 - 0.5 * z)
        end = dt * (0.5 - z / 6.0)
    else:
        decay = math.exp(-z)
        whole = -math.expm1(-z) / rate
        end = (1.0 - whole / dt) / rate
    return decay, whole - end, end


@njit(inline="always", fastmath=FASTMATH)
def mean_asinh(s, c1, c2, c3):  # type: ignore[no-untyped-def]
    """Average over an electrode of asinh(s / sqrt(c)) from three Gauss points, c relative to rest, s >= 0."""
    y1, y2, y3 = s / math.sqrt(c1), s / math.sqrt(c2), s / math.sqrt(c3)
    t1 = y1 + math.sqrt(y1 * y1 + 1.0)
    t2 = y2 + math.sqrt(y2 * y2 + 1.0)
    t3 = y3 + math.sqrt(y3 * y3 + 1.0)
    if s > LARGEST_RATIO:
        return (5.0 * (math.log(t1) + math.log(t3)) + 8.0 * math.log(t2)) / 18.0
    outer, inner = t1 * t3, t2 * t2  # weights 5/18, 8/18, 5/18, and one logarithm for all three
    return math.log(outer * outer * outer * outer * outer * inner * inner * inner * inner) / 18.0


@njit(inline="always", fastmath=FASTMATH)
def kinetic_ratio(density, exchange, theta):  # type: ignore[no-untyped-def]
    """|j| / (2 F K sqrt(x (1 - x))), with the occupancy kept off zero."""
    occupancy = max(theta * (1.0 - theta), SMALLEST_OCCUPANCY)
    return abs(density) / (2.0 * exchange * math.sqrt(occupancy))


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def run_linear(  # type: ignore[no-untyped-def]
    time, current, backward, theta0, solid, salt, cell, out
):
    """Step all samples; the rows of `out`, (7, n), are those of `plain.run_plain`.

    theta0 : (2,) stoichiometries at rest.  solid, salt, cell : see `PlainSolid`, `PlainSalt`, `PlainCell`.
    Returns the first sample at which a surface (1 negative, 2 positive) or the electrolyte (3) left its range.
    """
    rates, gains, lump = solid
    e_rates, e_gains, to_nodes, project, gauss, mean, psi, psi_scale, nonlinear, substep, most = salt
    ocp_n, ocp_p, kappa, area, c0, top, a_l_n, a_l_p, exchange_n, exchange_p, thermal_v, salt_v = cell[:12]
    path, solid_r, contact = cell[12:]
    n_samples, n_modes = time.shape[0], rates.shape[1]
    m_e, n_e = to_nodes.shape

    z_n, z_p = np.zeros(n_modes), np.zeros(n_modes)
    q, c, forcing, rest = np.zeros(n_e), np.full(m_e, c0), np.zeros(n_e), np.zeros(m_e)
    keys = np.full(CACHE_SLOTS, -1, dtype=np.int64)
    w_n, w_p = np.zeros((CACHE_SLOTS, 3, n_modes)), np.zeros((CACHE_SLOTS, 3, n_modes))
    w_e, parts = np.zeros((CACHE_SLOTS, 5, n_e)), np.ones(CACHE_SLOTS, dtype=np.int64)
    mean_n, mean_p = theta0[0], theta0[1]
    before, last_step = np.zeros(n_e), 0.0
    fault_at, fault = -1, 0
    last, width, g = m_e - 1, (m_e - 1) // 3 + 1, np.zeros(6)
    for k in range(n_samples):
        i1 = current[k]
        if k > 0:
            dt = time[k] - time[k - 1]
            i0 = i1 if backward else current[k - 1]
            key = np.int64(dt * NANOSECONDS + 0.5)
            slot = key % CACHE_SLOTS
            if keys[slot] != key:
                keys[slot] = key
                parts[slot] = min(max(1, math.ceil(dt / substep)), most) if nonlinear else 1
                for j in range(n_modes):
                    decay, start, end = step_weights(rates[0, j], dt)
                    w_n[slot, 0, j], w_n[slot, 1, j], w_n[slot, 2, j] = (
                        decay,
                        start * gains[0, j],
                        end * gains[0, j],
                    )
                    decay, start, end = step_weights(rates[1, j], dt)
                    w_p[slot, 0, j], w_p[slot, 1, j], w_p[slot, 2, j] = (
                        decay,
                        start * gains[1, j],
                        end * gains[1, j],
                    )
                for j in range(n_e):
                    decay, start, end = step_weights(e_rates[j], dt / parts[slot])
                    w_e[slot, 0, j], w_e[slot, 3, j] = decay, (start + end) * e_rates[j] * psi_scale
                    w_e[slot, 1, j], w_e[slot, 2, j] = start * e_gains[j], end * e_gains[j]
                    w_e[slot, 4, j] = end * e_rates[j] * psi_scale
            for j in range(n_modes):
                z_n[j] = w_n[slot, 0, j] * z_n[j] - w_n[slot, 1, j] * i0 - w_n[slot, 2, j] * i1
            for j in range(n_modes):
                z_p[j] = w_p[slot, 0, j] * z_p[j] + w_p[slot, 1, j] * i0 + w_p[slot, 2, j] * i1
            charge = 0.5 * (i0 + i1) * dt
            mean_n -= lump[0] * charge
            mean_p += lump[1] * charge
            for part in range(parts[slot]):
                u0 = i0 + (i1 - i0) * part / parts[slot]
                u1 = i0 + (i1 - i0) * (part + 1) / parts[slot]
                if nonlinear:
                    for j in range(m_e):
                        rest[j] = lookup(psi, c[j] / top)
                    forcing[:] = 0.0
                    for i in range(m_e):
                        for j in range(n_e):
                            forcing[j] += project[i, j] * rest[i]
                ahead = dt / parts[slot] / last_step if last_step > 0.0 else 0.0
                for j in range(n_e):
                    q[j] = (
                        w_e[slot, 0, j] * q[j]
                        + w_e[slot, 1, j] * u0
                        + w_e[slot, 2, j] * u1
                        - w_e[slot, 3, j] * forcing[j]
                        - w_e[slot, 4, j] * ahead * (forcing[j] - before[j])
                    )
                before[:] = forcing
                last_step = dt / parts[slot]
                c[:] = c0
                for j in range(n_e):
                    for i in range(m_e):
                        c[i] += to_nodes[i, j] * q[j]
        theta_n, theta_p = mean_n, mean_p
        for j in range(n_modes):
            theta_n += z_n[j]
            theta_p += z_p[j]
        c_mean = 0.0
        for j in range(m_e):
            c_mean += mean[j] * c[j]
        for i in range(6):
            first = 0 if i < 3 else m_e - width
            value = 0.0
            for j in range(width):
                value += gauss[i, first + j] * c[first + j]
            g[i] = value / c0
        driest = min(5.0 * (g[0] + g[2]) + 8.0 * g[1], 5.0 * (g[3] + g[5]) + 8.0 * g[4])
        for i in range(6):
            g[i] = wet(g[i])

        density = i1 / area
        s_n = kinetic_ratio(density / a_l_n, exchange_n, theta_n)
        s_p = kinetic_ratio(density / a_l_p, exchange_p, theta_p)
        eta = mean_asinh(s_n, g[0], g[1], g[2]) + mean_asinh(s_p, g[3], g[4], g[5])
        eta = 2.0 * thermal_v * math.copysign(eta, i1)
        outer, inner = (g[3] * g[5]) / (g[0] * g[2]), g[4] / g[1]
        inner = inner * inner
        outer = outer * outer * outer * outer * outer * inner * inner * inner * inner
        concentration_v = salt_v * math.log(outer) / 18.0
        ohmic = density * (path / lookup(kappa, c_mean / top) + solid_r) + i1 * contact
        out[0, k] = (
            open_circuit(ocp_p, theta_p) - open_circuit(ocp_n, theta_n) - eta + concentration_v - ohmic
        )
        out[1, k], out[2, k] = theta_n, theta_p
        out[3, k], out[4, k] = c[0], c[last]
        out[5, k], out[6, k] = mean_n, mean_p
        if fault_at < 0:
            if not 0.0 <= theta_n <= 1.0:
                fault_at, fault = k, 1
            elif not 0.0 <= theta_p <= 1.0:
                fault_at, fault = k, 2
            elif not driest > 0.0:
                fault_at, fault = k, 3
    return fault_at, fault
