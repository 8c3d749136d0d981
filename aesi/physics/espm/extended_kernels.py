"""Compiled time stepping of the model with everything that effects may add to it.

Within a step a unit (see `electrode_kernels`) carries its share of the current, linear or held, plus a deviation that
is constant over the step and found from the electrode's equations at its end: deviations cannot ring, and lithium is
kept to round-off.
"""

import math

import numpy as np
from numba import njit

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K
from aesi.physics.espm.electrode_kernels import local_conductivity, region_drops, solve_electrode
from aesi.physics.espm.kernels import FASTMATH, NANOSECONDS, lookup, open_circuit
from aesi.physics.espm.layout import CACHE_SLOTS, Memory, SaltMemory
from aesi.physics.espm.transport_kernels import (
    DIFFUSIONS,
    TEMPERATURE_STEP_K,
    arrhenius,
    heated,
    mean_heat,
    observe_salt,
    renew_weights,
    step_electrolyte,
    step_particle,
)

GAS_OVER_FARADAY = GAS_CONSTANT_J_MOL_K / FARADAY_C_MOL


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def run_general(  # type: ignore[no-untyped-def]
    drive, theta0, particles, electrolyte, surfaces, cell, out
):
    """Step all samples; see `layout` for what the arguments hold.

    theta0 : (2,) stoichiometries at rest.
    out : (9, n) voltage, surface stoichiometries (n, p), c_e0, c_eL, mean stoichiometries (n, p), temperature,
    plated lithium (mol/m3 of the negative electrode, mean).  Returns (sample, what) of the first fault, see `kernels`.
    """
    time, current, temperature, given, backward, substep, most = drive
    units, rates, gains, lump, share, volume = particles[:6]
    ocp, entropic, plating_active = surfaces.ocp, surfaces.entropic, surfaces.plating[0] > 0.0
    energies, heat, area, separator, contact, film, reference_k = cell
    mean, kappa_table = electrolyte.mean, electrolyte.kappa
    c0, top = electrolyte.c0, electrolyte.top
    n_units, n_modes = rates.shape
    m_e, n_e = electrolyte.to_nodes.shape
    regions = surfaces.solid.shape[1]
    split = np.sum(units[:, 0] == 0)

    z, means = np.zeros((n_units, n_modes)), np.zeros(n_units)
    pred, theta = np.zeros(n_units), np.zeros(n_units)
    give, y = np.zeros(n_units), np.zeros(n_units)
    scratch = np.zeros(particles.at.shape[0]), np.zeros(n_modes + 1), np.zeros(n_modes + 1)
    c = np.full(m_e, c0)
    dissolved = SaltMemory(np.zeros(n_e), c, np.zeros(m_e), np.zeros(n_e), np.zeros(n_e))
    salt, log_salt, region_salt = (
        np.ones(electrolyte.gauss.shape[0]),
        np.zeros(2 * regions),
        np.ones(2 * regions),
    )
    kappa, ohm = np.ones(2 * regions + 1), np.zeros((regions, regions))  # the separator's stands last
    deviation, region_total = np.zeros(2 * regions), np.zeros(2 * regions)
    delta, dl_current = np.zeros(2 * regions), np.zeros(2 * regions)
    plated, plating_current = np.zeros(regions), np.zeros(regions)
    memory = Memory(
        y, theta, pred, give, ohm, salt, log_salt, region_salt, delta, dl_current, region_total,
        plated, plating_current, np.zeros((n_units + 8, n_units + 3)),
    )  # fmt: skip
    keys = np.full(CACHE_SLOTS, -1, dtype=np.int64)
    w = np.zeros((CACHE_SLOTS, n_units, 3, n_modes))
    w_e = np.zeros((CACHE_SLOTS, 3, n_e))
    for u in range(n_units):
        means[u] = theta0[units[u, 0]]
        y[u] = share[u] * current[0] / area * (1.0 if units[u, 0] == 0 else -1.0)
    t_k = temperature[0]
    t_weights, faster = -1.0, np.ones(3)
    watts, last_j = 0.0, current[0] / area
    last_step = 0.0
    fault_at, fault, driest = -1, 0, 1.0
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
                    renew_weights(dt, faster, units, rates, electrolyte.rates, w[slot], w_e[slot])
                ahead = dt / last_step if last_step > 0.0 else 0.0
                step_electrolyte(j0, j1, deviation, ahead, faster[2], electrolyte, w_e[slot], dissolved)
                last_step = dt
                for u in range(n_units):
                    side = units[u, 0]
                    nominal = share[u] if side == 0 else -share[u]
                    means[u], give[u] = step_particle(
                        u,
                        means[u],
                        z[u],
                        nominal * j0,
                        nominal * j1,
                        dt,
                        faster[side],
                        particles,
                        w[slot, u],
                        scratch,
                    )
            for u in range(n_units):
                pred[u] = means[u]
                for j in range(n_modes):
                    pred[u] += z[u, j]
            driest = observe_salt(c, c0, electrolyte.gauss, salt, log_salt, region_salt)
            start_k = t_k
            if given and k > 0:
                t_k = temperature[k - 1] + (temperature[k] - temperature[k - 1]) * end_share
            elif k > 0 and heat[0] > 0.0:
                t_k = heated(start_k, watts, dt, heat)
            rise = t_k - reference_k
            thermal = GAS_OVER_FARADAY * t_k
            chi = 2.0 * electrolyte.supply * thermal
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
                region_drops(surfaces.solid[side], surfaces.salt[side], kappa, side * regions, ohm)
                quicker = arrhenius(energies[2 + side], t_k, reference_k)
                phi = solve_electrode(
                    lo,
                    hi,
                    side,
                    total,
                    dt,
                    backward,
                    thermal,
                    rise,
                    chi,
                    quicker,
                    particles,
                    surfaces,
                    memory,
                )
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
            if plating_active:
                for r in range(regions):
                    plated[r] = max(plated[r] - surfaces.plating_to_c * plating_current[r] * dt, 0.0)
            voltage = phi_p - phi_n - j1 * separator / kappa[2 * regions]
            voltage -= i1 * (contact + film / arrhenius(energies[6], t_k, reference_k))
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
        if fault_at < 0 and not driest > 0.0:
            fault_at, fault = k, 3
    return fault_at, fault
