"""Compiled time stepping of the model with everything that effects may add to it.

Within a step a unit (see `electrode_kernels`) carries its share of the current, linear or held, plus a deviation that
is constant over the step and found from the electrode's equations at its end: deviations cannot ring, and lithium is
kept to round-off.
"""

import math

import numpy as np
from numba import njit

from aesi.physics.espm.electrode_kernels import drops, local_conductivity, solve_electrode
from aesi.physics.espm.kernels import CACHE_SLOTS, FASTMATH, NANOSECONDS, lookup, open_circuit
from aesi.physics.espm.transport_kernels import (
    GAS,
    arrhenius,
    heated,
    mean_heat,
    observe_salt,
    renew_weights,
    step_electrolyte,
    step_particle,
)

GAS_OVER_FARADAY = GAS / 96485.33212331001
TEMPERATURE_STEP_K = 0.01
"""Rates of diffusion are renewed where the temperature has moved by this much (0.04 % of a rate at 30 kJ/mol)."""
DIFFUSIONS = (0, 1, 4)
"""Where the activation energies of diffusion stand: negative, positive electrode, electrolyte."""


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def run_general(  # type: ignore[no-untyped-def]
    time, current, temperature, given, backward, substep, most, theta0,
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
    kappa, ohm = np.ones(2 * regions + 1), np.zeros((regions, regions))  # the separator's stands last
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
    t_weights, faster = -1.0, np.ones(3)
    watts, last_j = 0.0, current[0] / area
    before, last_step = np.zeros(n_e), 0.0
    fault_at, fault = -1, 0
    for k in range(time.shape[0]):
        whole = time[k] - time[k - 1] if k > 0 else 0.0
        parts = min(max(1, math.ceil(whole / substep)), most) if k > 0 else 1
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
                    for i in range(3):
                        faster[i] = arrhenius(energies[DIFFUSIONS[i]], t_k, reference_k)
                key = np.int64(dt * NANOSECONDS + 0.5)
                slot = key % CACHE_SLOTS
                if keys[slot] != key:
                    keys[slot] = key
                    renew_weights(dt, faster, units, rates, e_rates, w[slot], w_e[slot])
                step_electrolyte(
                    j0, j1, deviation, dt / last_step if last_step > 0.0 else 0.0, psi_scale * faster[2],
                    one_minus_t, e_rates, e_gains, w_e[slot], project, psi, top, to_nodes, c0,
                    q, c, rest, forcing, before,
                )  # fmt: skip
                last_step = dt
                for u in range(n_units):
                    side = units[u, 0]
                    nominal = share[u] if side == 0 else -share[u]
                    means[u], give[u] = step_particle(
                        means[u], z[u], nominal * j0, nominal * j1, dt, rates[u], gains[u], lump[u], w[slot, u],
                        solid_scale[side] * faster[side], at, project_s, solid_psi[side], nodes, force, force_end,
                    )  # fmt: skip
            for u in range(n_units):
                pred[u] = means[u]
                for j in range(n_modes):
                    pred[u] += z[u, j]
            observe_salt(c, c0, gauss, contrast, salt, log_salt, region_salt)
            start_k = t_k
            if given and k > 0:
                t_k = temperature[k - 1] + (temperature[k] - temperature[k - 1]) * end_share
            elif k > 0 and heat[0] > 0.0:
                t_k = heated(start_k, watts, dt, heat)
            rise = t_k - reference_k
            thermal = GAS_OVER_FARADAY * t_k
            chi = 2.0 * one_minus_t * thermal
            warmer = arrhenius(energies[5], t_k, reference_k)
            if regions == 1:
                c_mean = 0.0
                for j in range(m_e):
                    c_mean += mean[j] * c[j]
                kappa[:] = lookup(kappa_table, c_mean / top) * warmer
            else:
                for r in range(2 * regions + 1):
                    kappa[r] = local_conductivity(kappa_table, salt, 3 * r, c0 / top) * warmer
            phi_n, phi_p = 0.0, 0.0
            for side in range(2):
                lo, hi = (0, split) if side == 0 else (split, n_units)
                total = j1 if side == 0 else -j1
                for u in range(lo, hi):  # start from the last deviations
                    held = y[u] - share[u] * (last_j if side == 0 else -last_j)
                    y[u] = share[u] * total + held
                drops(ohm_solid[side], ohm_salt[side], kappa, side * regions, contrast, ohm)
                phi = solve_electrode(
                    lo, hi, regions, side, total, dt, thermal, rise, chi,
                    units[:, 1], share, exchange, arrhenius(energies[2 + side], t_k, reference_k),
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
            last_j = j1
            if plating[0] > 0.0:
                for r in range(regions):
                    plated[r] = max(plated[r] - plating_to_c * plating_current[r] * dt, 0.0)
            voltage = phi_p - phi_n - j1 * separator / kappa[2 * regions] - i1 * contact
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
        if fault_at < 0 and not np.min(c) >= 0.0:
            fault_at, fault = k, 3
    return fault_at, fault
