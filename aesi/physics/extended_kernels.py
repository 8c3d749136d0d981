"""Compiled time stepping of the model with everything that effects may add to it.

Each electrode holds units: a particle of one size in one region. All units of an electrode see one potential Phi
between its collector and the electrolyte at the separator's edge:

    Phi = U(theta_u) + eta(y_u) + (L/sigma S + L/kappa E) y + chi ln(c_r / c_mean),   sum y + capacitive + plating = J

with y_u the current of unit u per cell area, positive for delithiation, J = I/A in the negative electrode and -I/A
in the positive. Within a step a unit carries its share of J, linear or held, plus a deviation that is constant over
the step and found from these equations at its end: deviations cannot ring, and lithium is kept to round-off.
"""

import math

import numpy as np
from numba import njit

from aesi.physics.kernels import (
    BEYOND_RANGE_V,
    CACHE_SLOTS,
    FASTMATH,
    NANOSECONDS,
    SMALLEST_OCCUPANCY,
    SMALLEST_SALT,
    lookup,
    mean_asinh,
    open_circuit,
    step_weights,
)

GAS_OVER_FARADAY = 8.31446261815324 / 96485.33212331001
GAS = 8.31446261815324
FARADAY = 96485.33212331001
SMALLEST_EXPONENT, LARGEST_EXPONENT = -60.0, 60.0
TEMPERATURE_STEP_K = 0.01
"""Rates of diffusion are renewed where the temperature has moved by this much (0.04 % of a rate at 30 kJ/mol)."""
NEWTON_STEPS = 60
NEWTON_TOLERANCE_V = 1e-11
SMALLEST_SLOPE = 1e-9


@njit(inline="always", fastmath=FASTMATH)
def bounded_exp(x):  # type: ignore[no-untyped-def]
    """exp with its argument kept from overflow."""
    return math.exp(min(max(x, SMALLEST_EXPONENT), LARGEST_EXPONENT))


@njit(cache=True, fastmath=FASTMATH)
def overpotential(y, exchange, occupancy, g1, g2, g3, log_salt, alpha, thermal):  # type: ignore[no-untyped-def]
    """Overpotential (V) of a current y and its slope, for j = j0 (exp(alpha f eta) - exp(-(1 - alpha) f eta)).

    exchange : at unit salt and occupancy.  g1..g3 : salt at Gauss points.  log_salt : its mean logarithm.
    """
    root = math.sqrt(occupancy)
    mid = 2.0 * exchange * root * math.exp(0.5 * log_salt)
    x = y / mid
    slope = 2.0 * thermal / (mid * math.sqrt(1.0 + x * x))
    if alpha == 0.5:
        s = abs(y) / (2.0 * exchange * root)
        return 2.0 * thermal * math.copysign(mean_asinh(s, g1, g2, g3), y), slope
    eta = thermal * math.copysign(math.log(abs(x) + math.sqrt(1.0 + x * x)), x) * 2.0
    if x != 0.0:  # the dominant branch, where the current is large
        eta *= 0.5 / (alpha if x > 0.0 else 1.0 - alpha) if abs(x) > 1.0 else 1.0
    half = 0.5 * mid
    for _ in range(30):
        forward = half * bounded_exp(alpha * eta / thermal)
        back = half * bounded_exp(-(1.0 - alpha) * eta / thermal)
        gradient = (alpha * forward + (1.0 - alpha) * back) / thermal
        change = (forward - back - y) / gradient
        change = min(max(change, -4.0 * thermal), 4.0 * thermal)
        eta -= change
        if abs(change) < 1e-13:
            break
    return eta, 1.0 / gradient


@njit(inline="always", fastmath=FASTMATH)
def end_weight(z):  # type: ignore[no-untyped-def]
    """Weight of the end of a step of z time constants, exact for a relaxing exponential: 1/2 at 0, 1 at infinity."""
    if z < 1e-3:
        return 0.5 + z / 12.0
    return 1.0 / (1.0 - math.exp(-min(z, LARGEST_EXPONENT))) - 1.0 / z


@njit(cache=True, fastmath=FASTMATH)
def solve_electrode(  # type: ignore[no-untyped-def]
    lo, hi, regions, side, total, dt, thermal, temperature_rise, chi,
    region_of, share, exchange, exchange_factor, alpha, capacity, plating, plated,
    theta_pred, give, ocp, entropic, ohm, salt, log_salt, region_salt,
    y, theta, delta, dl_current, region_total, plating_current, work,
):  # fmt: skip
    """Currents y[lo:hi] of the units of one electrode; returns Phi.

    theta_pred : surface stoichiometry at the end of the step if each unit carried its share.  give : what one unit
    of deviating current takes from it.  delta : (2 regions,) potentials of the double layers, old in, new out.
    """
    n = hi - lo
    first = side * regions
    potential, slope = work[0], work[1]
    matrix = work[2 : 3 + n, : n + 2]
    new_delta, gain, fitted, new_current = work[3 + n], work[4 + n], work[5 + n], work[6 + n]
    new_current[:] = 0.0
    phi = 0.0
    for step in range(NEWTON_STEPS):
        for r in range(regions):
            region_total[first + r] = 0.0
            new_delta[r] = np.nan
        for i in range(n):
            u = lo + i
            t = theta_pred[u] - give[u] * (y[u] - share[u] * total)
            theta[u] = t
            r = region_of[u]
            k = 3 * (first + r)
            occupancy = max(t * (1.0 - t), SMALLEST_OCCUPANCY)
            eta, d_eta = overpotential(
                y[u], exchange[u] * exchange_factor, occupancy,
                salt[k], salt[k + 1], salt[k + 2], log_salt[first + r] , alpha, thermal,
            )  # fmt: skip
            inside = min(max(t, 0.0), 1.0)
            last = ocp.shape[0] - 1
            cell = min(int(inside * last), last - 1)
            falls = (ocp[cell + 1] - ocp[cell]) * last if t == inside else -BEYOND_RANGE_V
            u_eq = open_circuit(ocp, t) + temperature_rise * lookup(entropic, inside)
            potential[i] = u_eq + eta
            slope[i] = max(d_eta - give[u] * falls, SMALLEST_SLOPE)
            gain[i] = 1.0
            region_total[first + r] += y[u]
            if math.isnan(new_delta[r]):
                new_delta[r] = potential[i]
                extra, d_extra = 0.0, 0.0
                if capacity > 0.0 and dt > 0.0:
                    if step == 0:
                        fitted[r] = end_weight(dt / (capacity * slope[i]))
                    charging = capacity * (potential[i] - delta[first + r]) / dt
                    charging = (charging - (1.0 - fitted[r]) * dl_current[first + r]) / fitted[r]
                    new_current[r] = charging
                    extra += charging
                    d_extra += capacity / (dt * fitted[r])
                if plating[0] > 0.0 and side == 0:
                    up = plating[0] * plated[r] * bounded_exp((1.0 - plating[1]) * potential[i] / thermal)
                    down = (
                        plating[0]
                        * region_salt[first + r]
                        * bounded_exp(-plating[1] * potential[i] / thermal)
                    )
                    plating_current[r] = up - down
                    extra += up - down
                    d_extra += ((1.0 - plating[1]) * up + plating[1] * down) / thermal
                region_total[first + r] += extra
                gain[i] += d_extra * slope[i]
        if n == 1 and capacity == 0.0 and plating[0] == 0.0:
            delta[first] = potential[0]
            return potential[0] + ohm[0, 0] * total + chi * log_salt[first]
        if step == 0:
            phi = potential[0]
        worst = 0.0
        off = -total
        for r in range(regions):
            off += region_total[first + r]
        for i in range(n):
            r = region_of[lo + i]
            residual = potential[i] + chi * log_salt[first + r] - phi
            for v in range(regions):
                residual += ohm[r, v] * region_total[first + v]
            matrix[i, n + 1] = -residual
            worst = max(worst, abs(residual))
            for j in range(n):
                q = region_of[lo + j]
                matrix[i, j] = ohm[r, q] * gain[j]
            matrix[i, i] += slope[i]
            matrix[i, n] = -1.0
        for j in range(n):
            matrix[n, j] = gain[j]
        matrix[n, n] = 0.0
        matrix[n, n + 1] = -off
        if worst < NEWTON_TOLERANCE_V and abs(off) * slope[0] < NEWTON_TOLERANCE_V:
            break
        eliminate(matrix, n + 1)
        for i in range(n):
            y[lo + i] += matrix[i, n + 1]
        phi += matrix[n, n + 1]
    for r in range(regions):
        delta[first + r] = new_delta[r]
        dl_current[first + r] = new_current[r]
    return phi


@njit(inline="always", fastmath=FASTMATH)
def local_conductivity(table, salt, first, unit):  # type: ignore[no-untyped-def]
    """Harmonic mean of the conductivity over three Gauss points."""
    k1, k2 = lookup(table, salt[first] * unit), lookup(table, salt[first + 1] * unit)
    k3 = lookup(table, salt[first + 2] * unit)
    return 18.0 / (5.0 / k1 + 8.0 / k2 + 5.0 / k3)


@njit(cache=True, fastmath=FASTMATH)
def drops(solid, salt, kappa, first, contrast, ohm):  # type: ignore[no-untyped-def]
    """ohm[r, v] : drop of region r per current of region v, differences between regions times `contrast`."""
    regions = ohm.shape[0]
    for v in range(regions):
        mean = 0.0
        for r in range(regions):
            ohm[r, v] = solid[r, v]
            for m in range(r, regions):
                ohm[r, v] += salt[r, m, v] / kappa[first + m]
            mean += ohm[r, v] / regions
        for r in range(regions):
            ohm[r, v] = mean + contrast * (ohm[r, v] - mean)


@njit(cache=True, fastmath=FASTMATH)
def eliminate(matrix, n):  # type: ignore[no-untyped-def]
    """Solve in place: the right-hand side stands in column n and is replaced by the solution."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if best != k:
            for j in range(k, n + 1):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        pivot = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * pivot
            if factor != 0.0:
                for j in range(k + 1, n + 1):
                    matrix[i, j] -= factor * matrix[k, j]
    for k in range(n - 1, -1, -1):
        value = matrix[k, n]
        for j in range(k + 1, n):
            value -= matrix[k, j] * matrix[j, n]
        matrix[k, n] = value / matrix[k, k]


@njit(cache=True, fastmath=FASTMATH)
def run_general(  # type: ignore[no-untyped-def]
    time, current, temperature, given, backward, substep, theta0,
    units, rates, gains, lump, share, volume, exchange,
    solid_psi, solid_scale, at, project_s,
    interface, ohm_solid, ohm_salt,
    e_rates, e_gains, to_nodes, project, gauss, mean, psi, psi_scale,
    ocp, entropic, kappa_table, energies, heat, scalars,
    out,
):  # fmt: skip
    """Step all samples; arguments as `extended.general_arguments` makes them.

    out : (9, n) voltage, surface stoichiometries (n, p), c_e0, c_eL, mean stoichiometries (n, p), temperature,
    plated lithium (mol/m3 of the negative electrode, mean).  Returns (sample, what) of the first fault, see `kernels`.
    """
    n_units, n_modes = rates.shape
    m_e, n_e = to_nodes.shape
    regions = ohm_solid.shape[1]
    n_nodes = at.shape[0]
    area, c0, top, separator, contact = scalars[0], scalars[1], scalars[2], scalars[3], scalars[4]
    one_minus_t, reference_k, plating_to_c, contrast = scalars[5], scalars[6], scalars[7], scalars[8]
    split = np.sum(units[:, 0] == 0)
    alpha, capacity, plating = interface[0], interface[1], interface[2]

    z, means = np.zeros((n_units, n_modes)), np.zeros(n_units)
    pred, theta = np.zeros(n_units), np.zeros(n_units)
    give, y = np.zeros(n_units), np.zeros(n_units)
    nodes, force, force_end = np.zeros(n_nodes), np.zeros(n_modes + 1), np.zeros(n_modes + 1)
    q, c, forcing, rest = np.zeros(n_e), np.full(m_e, c0), np.zeros(n_e), np.zeros(m_e)
    salt, log_salt, region_salt = np.ones(gauss.shape[0]), np.zeros(2 * regions), np.ones(2 * regions)
    kappa, ohm = np.ones(2 * regions), np.zeros((regions, regions))
    deviation, region_total = np.zeros(2 * regions), np.zeros(2 * regions)
    delta, dl_current = np.zeros(2 * regions), np.zeros(2 * regions)
    plated, plating_current = np.zeros(regions), np.zeros(regions)
    work = np.zeros((n_units + 8, n_units + 3))
    keys = np.full(CACHE_SLOTS, -1, dtype=np.int64)
    w = np.zeros((CACHE_SLOTS, n_units, 3, n_modes))
    w_e = np.zeros((CACHE_SLOTS, 3, n_e))
    for u in range(n_units):
        means[u] = theta0[units[u, 0]]
        y[u] = share[u] * current[0] / area * (1.0 if units[u, 0] == 0 else -1.0)
    t_k = temperature[0]
    t_weights = -1.0
    watts = 0.0
    before, last_step = np.zeros(n_e), 0.0
    fault_at, fault = -1, 0
    for k in range(time.shape[0]):
        whole = time[k] - time[k - 1] if k > 0 else 0.0
        parts = max(1, math.ceil(whole / substep)) if k > 0 else 1
        dt = whole / parts
        for part in range(parts):
            end_share = (part + 1.0) / parts
            i1 = current[k]
            i0 = i1
            if k > 0 and not backward:
                step_current = current[k] - current[k - 1]
                i0 = current[k - 1] + step_current * part / parts
                i1 = current[k - 1] + step_current * end_share
            j0, j1 = i0 / area, i1 / area
            if k > 0:
                if abs(t_k - t_weights) > TEMPERATURE_STEP_K:
                    t_weights = t_k
                    keys[:] = -1
                key = np.int64(dt * NANOSECONDS + 0.5)
                slot = key % CACHE_SLOTS
                if keys[slot] != key:
                    keys[slot] = key
                    inverse = 1.0 / (GAS * reference_k) - 1.0 / (GAS * t_weights)
                    for u in range(n_units):
                        faster = math.exp(energies[units[u, 0]] * inverse)
                        for j in range(n_modes):
                            w[slot, u, 0, j], w[slot, u, 1, j], w[slot, u, 2, j] = step_weights(
                                rates[u, j] * faster, dt
                            )
                    faster = math.exp(energies[4] * inverse)
                    for j in range(n_e):
                        w_e[slot, 0, j], w_e[slot, 1, j], w_e[slot, 2, j] = step_weights(
                            e_rates[j] * faster, dt
                        )
                inverse = 1.0 / (GAS * reference_k) - 1.0 / (GAS * t_weights)
                faster = math.exp(energies[4] * inverse)
                forcing[:] = 0.0
                if psi_scale > 0.0:
                    for j in range(m_e):
                        rest[j] = lookup(psi, c[j] / top)
                    for i in range(m_e):
                        for j in range(n_e):
                            forcing[j] += project[i, j] * rest[i]
                ahead = dt / last_step if last_step > 0.0 else 0.0
                for j in range(n_e):
                    source = -psi_scale * e_rates[j] * faster * forcing[j]
                    slope = 0.0
                    for r in range(regions):
                        source += one_minus_t * (
                            e_gains[r, j] * (j0 / regions + deviation[r])
                            + e_gains[regions + r, j] * (-j0 / regions + deviation[regions + r])
                        )
                        slope += one_minus_t * (e_gains[r, j] - e_gains[regions + r, j]) * (j1 - j0) / regions
                    q[j] = (
                        w_e[slot, 0, j] * q[j]
                        + (w_e[slot, 1, j] + w_e[slot, 2, j]) * source
                        + w_e[slot, 2, j]
                        * (slope - psi_scale * e_rates[j] * faster * ahead * (forcing[j] - before[j]))
                    )
                before[:] = forcing
                last_step = dt
                c[:] = c0
                for j in range(n_e):
                    for i in range(m_e):
                        c[i] += to_nodes[i, j] * q[j]
                for u in range(n_units):
                    side = units[u, 0]
                    sign = 1.0 if side == 0 else -1.0
                    u0, u1 = sign * share[u] * j0, sign * share[u] * j1
                    nonlinear = solid_scale[side] > 0.0
                    force[:] = 0.0
                    faster = math.exp(energies[side] * inverse) * solid_scale[side]
                    if nonlinear:
                        solid_forcing(means[u], z[u], at, project_s, solid_psi[side], nodes, force)
                    total = 0.0
                    for j in range(n_modes):
                        source = -faster * rates[u, j] * force[j + 1]
                        a, b = w[slot, u, 1, j], w[slot, u, 2, j]
                        z[u, j] = (
                            w[slot, u, 0, j] * z[u, j] - gains[u, j] * (a * u0 + b * u1) + (a + b) * source
                        )
                        total += gains[u, j] * (a + b)
                    means[u] -= lump[u] * 0.5 * (u0 + u1) * dt
                    if nonlinear:
                        solid_forcing(means[u], z[u], at, project_s, solid_psi[side], nodes, force_end)
                        for j in range(n_modes):
                            z[u, j] -= (
                                w[slot, u, 2, j] * faster * rates[u, j] * (force_end[j + 1] - force[j + 1])
                            )
                    give[u] = total + lump[u] * dt
            for u in range(n_units):
                pred[u] = means[u]
                for j in range(n_modes):
                    pred[u] += z[u, j]
            c_mean, c_low = 0.0, c[0]
            for j in range(m_e):
                c_mean += mean[j] * c[j]
                c_low = min(c_low, c[j])
            for i in range(gauss.shape[0]):
                g = 0.0
                for j in range(m_e):
                    g += gauss[i, j] * c[j]
                salt[i] = max(g / c0, SMALLEST_SALT)
            for r in range(2 * regions):
                g1, g2, g3 = salt[3 * r], salt[3 * r + 1], salt[3 * r + 2]
                log_salt[r] = (5.0 * math.log(g1 * g3) + 8.0 * math.log(g2)) / 18.0
                region_salt[r] = c0 * (5.0 * (g1 + g3) + 8.0 * g2) / 18.0

            if regions > 1 and contrast != 1.0:
                for side in range(2):
                    middle = np.mean(log_salt[side * regions : (side + 1) * regions])
                    for r in range(side * regions, (side + 1) * regions):
                        log_salt[r] = middle + contrast * (log_salt[r] - middle)

            start_k = t_k
            if given and k > 0:
                t_k = temperature[k - 1] + (temperature[k] - temperature[k - 1]) * end_share
            elif k > 0 and heat[0] > 0.0:
                t_k = heated(start_k, watts, dt, heat)
            rise = t_k - reference_k
            inverse = 1.0 / (GAS * reference_k) - 1.0 / (GAS * t_k)
            thermal = GAS_OVER_FARADAY * t_k
            chi = 2.0 * one_minus_t * thermal
            faster = math.exp(energies[5] * inverse)
            kappa_separator = lookup(kappa_table, c_mean / top) * faster
            if regions == 1:
                kappa[:] = kappa_separator
            else:
                kappa_separator = local_conductivity(kappa_table, salt, 6 * regions, c0 / top) * faster
                for r in range(2 * regions):
                    kappa[r] = local_conductivity(kappa_table, salt, 3 * r, c0 / top) * faster
            phi_n, phi_p = 0.0, 0.0
            for side in range(2):
                lo, hi = (0, split) if side == 0 else (split, n_units)
                total = j1 if side == 0 else -j1
                for u in range(lo, hi):  # start from the last deviations
                    held = y[u] - share[u] * (j0 if side == 0 else -j0) if k > 0 else 0.0
                    y[u] = share[u] * total + held
                drops(ohm_solid[side], ohm_salt[side], kappa, side * regions, contrast, ohm)
                phi = solve_electrode(
                    lo, hi, regions, side, total, dt, thermal, rise, chi,
                    units[:, 1], share, exchange, math.exp(energies[2 + side] * inverse),
                    alpha[side], capacity[side], plating, plated,
                    pred, give, ocp[side], entropic[side], ohm,
                    salt, log_salt, region_salt, y, theta, delta, dl_current, region_total, plating_current, work,
                )  # fmt: skip
                if side == 0:
                    phi_n = phi
                else:
                    phi_p = phi
                for r in range(regions):
                    deviation[side * regions + r] = region_total[side * regions + r] - total / regions
                if k > 0:
                    for u in range(lo, hi):
                        extra = y[u] - share[u] * total
                        if extra != 0.0:
                            for j in range(n_modes):
                                z[u, j] -= gains[u, j] * (w[slot, u, 1, j] + w[slot, u, 2, j]) * extra
                            means[u] -= lump[u] * dt * extra
            if plating[0] > 0.0:
                for r in range(regions):
                    plated[r] = max(plated[r] - plating_to_c * plating_current[r] * dt, 0.0)
            voltage = phi_p - phi_n - j1 * separator / kappa_separator - i1 * contact
            if heat[0] > 0.0:
                power = -i1 * voltage
                for u in range(n_units):
                    side = units[u, 0]
                    slope = lookup(entropic[side], theta[u])
                    u_eq = open_circuit(ocp[side], theta[u]) + rise * slope
                    power += area * y[u] * (t_k * slope - u_eq)
                if k > 0 and not given:
                    t_k = heated(start_k, mean_heat(watts, power, i0, i1), dt, heat)
                watts = power
        out[0, k] = voltage
        for row in range(1, 7):
            out[row, k] = 0.0
        for u in range(n_units):
            side = units[u, 0]
            out[1 + side, k] += share[u] * theta[u]
            out[5 + side, k] += volume[u] * means[u]
            if fault_at < 0 and not 0.0 <= theta[u] <= 1.0:
                fault_at, fault = k, 1 + side
        out[3, k], out[4, k] = c[0], c[m_e - 1]
        out[7, k] = t_k
        out[8, k] = np.mean(plated)
        if fault_at < 0 and not c_low >= 0.0:
            fault_at, fault = k, 3
    return fault_at, fault


@njit(inline="always", fastmath=FASTMATH)
def mean_heat(start, end, i0, i1):  # type: ignore[no-untyped-def]
    """Mean heat over a step whose current is a straight line: quadratic in it, by the larger end's resistance."""
    if i0 == i1:
        return end
    resistance = start / (i0 * i0) if abs(i0) > abs(i1) else end / (i1 * i1)
    return 0.5 * (start + end) - resistance * (i1 - i0) ** 2 / 6.0


@njit(inline="always", fastmath=FASTMATH)
def heated(t_k, watts, dt, heat):  # type: ignore[no-untyped-def]
    """Temperature after a step of constant heating; heat : capacity J/K, conductance W/K, surroundings K."""
    if heat[1] * dt < 1e-9 * heat[0]:
        return t_k + watts * dt / heat[0]
    settled = heat[2] + watts / heat[1]
    return settled + (t_k - settled) * math.exp(-heat[1] * dt / heat[0])


@njit(cache=True, fastmath=FASTMATH)
def solid_forcing(mean, z, at, project, psi, nodes, force):  # type: ignore[no-untyped-def]
    """force[k] : mode k of the integral psi of the diffusivity's variable part, at the profile of (mean, z)."""
    nodes[:] = mean
    for i in range(nodes.shape[0]):
        for j in range(z.shape[0]):
            nodes[i] += at[i, j + 1] * z[j]
    force[:] = 0.0
    for i in range(nodes.shape[0]):
        value = lookup(psi, nodes[i])
        for j in range(force.shape[0]):
            force[j] += project[j, i] * value
