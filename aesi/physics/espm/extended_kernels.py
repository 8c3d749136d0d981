"""Compiled time stepping of the model with all that effects may add to it.

Within a step a unit (see `electrode_kernels`) carries its share of the current, linear or held, plus a deviation that
is constant over the step and found from the electrode's equations at its end: deviations cannot oscillate. The current
of a double layer differs between the mean of a step and its end; its particles get the difference at the beginning of
the step, so that lithium is conserved to round-off.
"""

import numpy as np
from numba import njit

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K
from aesi.physics.espm.electrode_kernels import local_conductivity, region_drops, solve_electrode
from aesi.physics.espm.kernels import (
    FASTMATH,
    compiled,
    lookup,
    open_circuit,
    out_of_range,
    parts_of,
    salt_at_separator,
    slot_of,
)
from aesi.physics.espm.layout import StepEnd
from aesi.physics.espm.transport_kernels import (
    arrhenius,
    diffuse,
    heated,
    mean_heat,
    observe_salt,
    predict_surfaces,
    renew_factors,
    renew_weights,
    solid_forcing,
    stepped_temperature,
    with_unresolved,
)

GAS_OVER_FARADAY = GAS_CONSTANT_J_MOL_K / FARADAY_C_MOL


@compiled
def step_extended_record(  # type: ignore[no-untyped-def]
    drive, theta0, particles, electrolyte, surfaces, cell, memory, modes, dissolved, out
):
    """Step all samples; see `layout` for what the arguments hold.

    theta0 : (2,) stoichiometries at rest.
    out : (9, n) voltage, surface stoichiometries (n, p), c_e0, c_eL, mean stoichiometries (n, p), temperature,
    plated lithium (mol/m3 of the negative electrode, mean).
    Returns (sample, what) of the first fault, see `plain_kernels`.
    """
    time, current, area, heat = drive.time, drive.current, cell.area, cell.heat
    rest_particles(theta0, current[0] / area, particles, electrolyte, memory, modes, dissolved)
    t_k, t_weights = drive.temperature[0], -1.0
    watts, last_j, last_step = 0.0, current[0] / area, 0.0
    fault_at, fault, voltage = -1, 0, 0.0
    for k in range(time.shape[0]):
        whole = time[k] - time[k - 1] if k > 0 else 0.0
        parts = parts_of(whole, drive.substep, drive.most, drive.finer) if k > 0 else 1
        dt, slot = whole / parts, 0
        for part in range(parts):
            i0, i1 = ends_of_part(current, k, part, parts, drive.backward)
            j1 = i1 / area
            if k > 0:
                t_weights = renew_factors(
                    t_k, t_weights, 0.0, cell.energies, cell.reference_k, modes.faster, modes.keys
                )
                slot, missing = slot_of(dt, modes.keys)
                renew_weights(dt, missing, particles, electrolyte.rates, slot, modes)
                diffuse(i0 / area, j1, dt, last_step, slot, particles, electrolyte, memory, modes, dissolved)
                last_step = dt
            predict_surfaces(memory, modes)
            observe_salt(
                dissolved.c,
                electrolyte.c0,
                electrolyte.gauss,
                memory.salt,
                memory.log_salt,
                memory.region_salt,
            )
            start_k, around_k = t_k, heat[2]
            if k > 0:
                t_k, around_k = stepped_temperature(drive, k, (part + 1.0) / parts, start_k, watts, dt, heat)
            set_conductivities(
                arrhenius(cell.energies[5], t_k, cell.reference_k), electrolyte, memory, dissolved.c
            )
            at = end_of_step(0, dt, drive.backward, t_k, electrolyte.supply, cell)
            phi_n = react(0, j1, last_j, at, particles, surfaces, memory)
            at = end_of_step(1, dt, drive.backward, t_k, electrolyte.supply, cell)
            phi_p = react(1, -j1, -last_j, at, particles, surfaces, memory)
            if k > 0:
                add_deviations(j1, dt, slot, particles, memory, modes)
            last_j = j1
            voltage = phi_p - phi_n - j1 * cell.separator / memory.kappa[memory.kappa.shape[0] - 1]
            voltage -= i1 * cell.contact
            if heat[0] > 0.0:
                power = 0.0
                theta_n, theta_p = electrode_surfaces(particles, memory.theta)
                if fault_at < 0 and 0.0 <= theta_n <= 1.0 and 0.0 <= theta_p <= 1.0:
                    power = reaction_heat(t_k, cell, particles, surfaces, memory, modes.means) - i1 * voltage
                if k > 0:
                    mean = with_unresolved(mean_heat(watts, power, i0, i1), drive, k)
                    t_k = heated(start_k, mean, dt, heat, around_k)
                watts = power
        out[0, k], out[7, k] = voltage, t_k
        what = record_sample(k, particles, memory, modes, dissolved.c, electrolyte.c0, out)
        if fault_at < 0 and what > 0:
            fault_at, fault = k, what
    return fault_at, fault


@compiled
def rest_particles(theta0, density, particles, electrolyte, memory, modes, dissolved):  # type: ignore[no-untyped-def]
    """Set the state to uniform particles and salt; each unit carries its share of the cell's current density."""
    dissolved.c.fill(electrolyte.c0)
    for u in range(memory.y.shape[0]):
        side = particles.place[u, 0]
        modes.means[u] = theta0[side]
        memory.y[u] = particles.share[u] * density * (1.0 if side == 0 else -1.0)
        if particles.strength[side] > 0.0:
            steepest = solid_forcing(
                modes.means[u], modes.z[u], particles.at, particles.project, particles.psi[side], modes.nodes,
                modes.force,
            )  # fmt: skip
            modes.largest[u] = 1.0 + particles.strength[side] * steepest


@njit(inline="always", fastmath=FASTMATH)
def ends_of_part(current, k, part, parts, backward):  # type: ignore[no-untyped-def]
    """Current at both ends of one part of the step to sample k."""
    if k == 0 or backward:
        return current[k], current[k]
    step = current[k] - current[k - 1]
    return current[k - 1] + step * part / parts, current[k - 1] + step * ((part + 1.0) / parts)


@njit(inline="always", fastmath=FASTMATH)
def set_conductivities(warmer, electrolyte, memory, c):  # type: ignore[no-untyped-def]
    """Set the conductivity of each region and, last, of the separator; in an undivided electrode, at the mean salt of
    the cell.  warmer : factor of temperature.
    """
    kappa, table, regions = memory.kappa, electrolyte.kappa, memory.ohm.shape[0]
    if regions == 1:
        c_mean = 0.0
        for j in range(c.shape[0]):
            c_mean += electrolyte.mean[j] * c[j]
        kappa.fill(lookup(table, c_mean / electrolyte.top) * warmer)
    else:
        for r in range(2 * regions + 1):
            unit = electrolyte.c0 / electrolyte.top
            kappa[r] = local_conductivity(table, memory.salt, 3 * r, unit) * warmer


@njit(inline="always", fastmath=FASTMATH)
def end_of_step(side, dt, held, t_k, supply, cell):  # type: ignore[no-untyped-def]
    """The `StepEnd` of an electrode at temperature t_k.  supply : 1 - t+."""
    thermal = GAS_OVER_FARADAY * t_k
    quicker = arrhenius(cell.energies[2 + side], t_k, cell.reference_k)
    film = 1.0 / arrhenius(cell.energies[6 + side], t_k, cell.reference_k)
    return StepEnd(dt, held, thermal, t_k - cell.reference_k, 2.0 * supply * thermal, quicker, film)


@compiled
def react(side, total, last_total, at, particles, surfaces, memory):  # type: ignore[no-untyped-def]
    """Currents of the units of one electrode at the end of a step, started from the last deviations; returns Phi, V.

    total, last_total : A/m2 of cell, positive for delithiation, now and at the end of the step before.
    """
    lo, hi = units_of(side, particles)
    regions = memory.ohm.shape[0]
    first = side * regions
    for u in range(lo, hi):
        memory.y[u] += particles.share[u] * (total - last_total)
    region_drops(surfaces.solid[side], surfaces.salt[side], memory.kappa, first, memory.ohm)
    phi = solve_electrode(lo, hi, side, total, at, particles, surfaces, memory)
    for r in range(first, first + regions):
        memory.deviation[r] = memory.total[r] - total / regions
    return phi


@njit(inline="always", fastmath=FASTMATH)
def units_of(side, particles):  # type: ignore[no-untyped-def]
    """First unit of an electrode, and the one after its last."""
    n_units, split = particles.place.shape[0], 0
    while split < n_units and particles.place[split, 0] == 0:
        split += 1
    return (0, split) if side == 0 else (split, n_units)


@njit(inline="always", fastmath=FASTMATH)
def add_deviations(density, dt, slot, particles, memory, modes):  # type: ignore[no-untyped-def]
    """Add to the particles the currents of their units beyond their shares, over the whole step, and the double layers'
    current at the end of the step minus its mean, at the beginning of the step."""
    regions = memory.ohm.shape[0]
    for u in range(modes.means.shape[0]):
        side = particles.place[u, 0]
        share = particles.share[u] if side == 0 else -particles.share[u]
        extra = memory.y[u] - share * density
        # The mean side current was smaller than at the end; units share the difference as they do their region.
        early = memory.ahead[side * regions + particles.place[u, 1]] * particles.share[u] * regions
        if extra != 0.0 or early != 0.0:
            for j in range(modes.z.shape[1]):
                weight = modes.w[slot, u, 1, j] + modes.w[slot, u, 2, j]
                kept = modes.w[slot, u, 0, j] * dt
                modes.z[u, j] -= particles.gains[u, j] * (weight * extra + kept * early)
            modes.means[u] -= particles.lump[u] * dt * (extra + early)


@njit(inline="always", fastmath=FASTMATH)
def reaction_heat(t_k, cell, particles, surfaces, memory, means):  # type: ignore[no-untyped-def]
    """Power, W, of the lithium from the mean stoichiometry of its particle, with its entropy, minus the power stored in
    double layers."""
    power = 0.0
    for r in range(memory.layer.shape[0]):
        power -= cell.area * memory.layer[r] * memory.delta[r]
    for u in range(memory.y.shape[0]):
        side = particles.place[u, 0]
        slope = lookup(surfaces.entropic[side], means[u])
        u_eq = open_circuit(surfaces.ocp[side], means[u]) + (t_k - cell.reference_k) * slope
        power += cell.area * memory.y[u] * (t_k * slope - u_eq)
    return power


@njit(inline="always", fastmath=FASTMATH)
def electrode_surfaces(particles, theta):  # type: ignore[no-untyped-def]
    """Mean surface stoichiometry of each electrode (negative, positive). A full particle may lie slightly outside
    [0, 1]."""
    mean_n, mean_p = 0.0, 0.0
    for u in range(theta.shape[0]):
        if particles.place[u, 0] == 0:
            mean_n += particles.share[u] * theta[u]
        else:
            mean_p += particles.share[u] * theta[u]
    return mean_n, mean_p


@njit(inline="always", fastmath=FASTMATH)
def record_sample(k, particles, memory, modes, c, c0, out):  # type: ignore[no-untyped-def]
    """Write the means of the electrodes, salt at the collectors and plated lithium; returns the state that left its
    range, 0 for none."""
    theta_n, theta_p = electrode_surfaces(particles, memory.theta)
    out[1, k], out[2, k] = theta_n, theta_p
    out[5, k], out[6, k] = 0.0, 0.0
    for u in range(memory.y.shape[0]):
        out[5 + particles.place[u, 0], k] += particles.volume[u] * modes.means[u]
    out[3, k], out[4, k] = c[0], c[c.shape[0] - 1]
    out[8, k] = np.mean(memory.plated)
    return out_of_range(theta_n, theta_p, salt_at_separator(c, c0))
