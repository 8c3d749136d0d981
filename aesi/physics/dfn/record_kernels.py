"""Compiled run of the porous electrode over a record: steps between samples, temperature, voltage, outputs."""

import math

from numba import njit

from aesi.physics.dfn.diffusion_kernels import renew_particles, renew_salt, salt_forcing
from aesi.physics.dfn.local_kernels import equilibrium, row_lookup
from aesi.physics.dfn.output_kernels import left_range, mean_surfaces, record, record_profile
from aesi.physics.dfn.stepping_kernels import (
    advance,
    instant_reaction,
    restore_start,
    start_layers,
    start_metal,
)
from aesi.physics.espm.kernels import FASTMATH, ROUND_OFF, compiled, lookup, parts_of, slot_of
from aesi.physics.espm.transport_kernels import (
    arrhenius,
    heated,
    mean_heat,
    renew_factors,
    solid_forcing,
    stepped_temperature,
    with_unresolved,
)

SHORTER, SHORTEST = 0.25, 0.25**6
"""Factor on a step for whose end no reaction was found, and the smallest share of a step. At the edges of potentials,
and where a potential rises with lithium, the end of a long step has several solutions or none in reach."""
FIRST_LENGTH = 0.25
"""Share of a step that is taken first where there are double layers and the current changes, or did in the row before.
Under pulses to 3C, the error of whole steps of 1 s between edges of 0.1 s is 0.52 mV RMS; with a quarter step first,
0.05. It is also taken within a linear change: its end could only be told by slopes, which rows between others round."""
FIRST_OF_LONGEST = 0.125
"""The same share of the longest step: in rows of 10 s at 0 degC the file of an LG 18650HG2 with a steep diffusivity is
0.68 mV off steps of 1/16 s with it, and 1.09 with a quarter of its steps of 2 s."""
TEMPERATURE_STEP_K = 0.01
"""Change of temperature after which the rates of diffusion are computed again (0.04 % of a rate at 30 kJ/mol)."""


@compiled
def step_porous_record(  # type: ignore[no-untyped-def]
    drive, theta0, p, s, e, state, t, newton, weights, out, profile, salt_profile
):
    """Step all samples; `layout` describes the named tuples.

    drive : see `aesi.physics.espm.layout.Drive`.  theta0 : (2,) at rest.  out : (9, n) voltage, mean surface
    stoichiometries (n, p), c_e0, c_eL, mean stoichiometries (n, p), temperature, plated lithium (mol/m3 of the negative
    electrode).  profile : (n or 0, 4, places) surfaces, reaction A/m2 per share, salt over rest, phi_s - phi_e.
    salt_profile : (n or 0, nodes) mol/m3, from one collector to the other.
    Returns (sample, what) of the first fault: 1, 2 a surface, 3 the salt, 4 no solution.
    """
    time, current = drive.time, drive.current
    half = s.at.shape[0] // 2
    t_k, t_weights, t_rates = drive.temperature[0], -1.0, drive.temperature[0]
    start_at_rest(p, s, e, state, t, half, theta0, t_k)
    set_rates(e, t, t_k)
    watts, last_dt = 0.0, 0.0
    moves, fault_at, fault = False, -1, 0
    set_currents(t, current[0], e.area)
    phi_n, phi_p, steps = instant_reaction(p, s, e, state, t, newton, t.total, t.total, t_k)
    for k in range(time.shape[0]):
        whole = time[k] - time[k - 1] if k > 0 else 0.0
        jumped = k > 0 and drive.backward and current[k] != current[k - 1]
        if jumped:
            jump_current(current[k - 1], current[k], p, s, e, state, t, newton, half, t_k)
            last_dt = 0.0
        parts = parts_of(whole, drive.substep, drive.most, drive.finer) if k > 0 else 0
        restless = False
        if e.has_layers and k > 0:
            moved_before, moves = moves, not drive.backward and current[k] != current[k - 1]
            restless = moves or moved_before or jumped
        # In parts: of the way between the samples, and of the next step.
        reached, length = 0.0, 1.0
        if restless:
            length = min(FIRST_LENGTH, FIRST_OF_LONGEST * drive.substep / drive.finer * parts / whole)
        while reached < parts - ROUND_OFF:
            length = min(length, math.floor(reached + ROUND_OFF) + 1.0 - reached)
            dt = whole / parts * length
            share = (reached + length) / parts
            i1 = current[k] if drive.backward else current[k - 1] + (current[k] - current[k - 1]) * share
            set_currents(t, i1, e.area)
            start_k = t_k
            t_k, around_k = stepped_temperature(drive, k, share, start_k, watts, dt, e.heat)
            if t_k != t_rates:
                t_rates = t_k
                set_rates(e, t, t_k)
            slot, t_weights = renew_diffusion(p, s, e, state, t, weights, dt, t_k, t_weights)
            if e.has_layers:
                start_layers(e, state, t, newton, dt)
            if e.plating[0] > 0.0:
                start_metal(e, state, t, dt, start_k)
            last_try = length <= SHORTEST or fault_at >= 0
            phi_n, phi_p, steps = advance(
                p, s, e, state, t, newton, weights, slot, dt, last_dt, t_k, last_try
            )
            if steps < 0 and not last_try:
                restore_start(state, t)
                t_k, last_dt = start_k, 0.0
                length *= SHORTER
                continue
            last_dt = dt
            reached += length
            length = min(2.0 * length, 1.0)
            if steps < 0 and fault_at < 0:
                fault_at, fault = k, 4
            if e.heat[0] > 0.0:
                power = 0.0
                if steps > 0 and fault_at < 0:
                    power = power_in_range(p, s, e, state, t, half, i1, phi_n, phi_p, t_k)
                mean = with_unresolved(mean_heat(watts, power, t.before[0], t.total[0]), drive, k)
                t_k = heated(start_k, mean, dt, e.heat, around_k)
                watts = power
        voltage = voltage_of(s, e, state, t, phi_n, phi_p, t.total[0])
        if k == 0 and e.heat[0] > 0.0:
            watts = heat_power(p, e, state, half, current[0], voltage, t_k)
        out[0, k], out[7, k] = voltage, t_k
        record(p, e, state, half, out, k)
        if profile.shape[0] > 0:
            record_profile(k, p, e, state, profile, salt_profile)
        if fault_at < 0 or (fault_at == k and fault == 4):
            what = left_range(out[1, k], out[2, k], state.c, s.c0)
            if what > 0:
                fault_at, fault = k, what
    return fault_at, fault


@njit(inline="always", fastmath=FASTMATH)
def set_currents(t, current, area):  # type: ignore[no-untyped-def]
    """Set both electrodes' currents at the end and at the start of a step, and their difference."""
    t.before[0], t.before[1] = t.total[0], t.total[1]
    t.total[0], t.total[1] = current / area, -current / area
    t.change[0], t.change[1] = t.total[0] - t.before[0], t.total[1] - t.before[1]


@njit(inline="always", fastmath=FASTMATH)
def renew_diffusion(p, s, e, state, t, weights, dt, t_k, t_weights):  # type: ignore[no-untyped-def]
    """Compute the weights of particles and salt for a step of dt s at t_k where they are not kept; returns their slot
    and the temperature (K) for which the factors on diffusion now hold.
    """
    t_weights = renew_factors(
        t_k, t_weights, TEMPERATURE_STEP_K, e.energies, e.reference_k, t.faster, weights.keys
    )
    slot, missing = slot_of(dt, weights.keys)
    renew_particles(
        p, state.largest, t.near, t.faster, dt, missing, weights.particle[slot], weights.taken[slot]
    )
    if missing:
        renew_salt(s, t.faster, dt, weights.salt[slot], weights.spread[slot])
    return slot, t_weights


@compiled
def jump_current(last, current, p, s, e, state, t, newton, half, t_k):  # type: ignore[no-untyped-def]
    """The reaction at the instant at which the current jumps; a double layer takes all of the jump."""
    t.change[0] = (current - last) / e.area
    t.change[1] = -t.change[0]
    t.total[0], t.total[1] = current / e.area, -current / e.area
    if e.has_layers:
        for r in range(2 * half):
            taken = e.node_share[r] * t.change[0 if r < half else 1]
            state.reaction[r] += taken
            state.layer[r] += taken
    else:
        instant_reaction(p, s, e, state, t, newton, t.change, t.total, t_k)


@compiled
def start_at_rest(p, s, e, state, t, half, theta0, t_k):  # type: ignore[no-untyped-def]
    """Set the state to rest: uniform particles, uniform salt, no reaction."""
    state.c.fill(s.c0)
    for r in range(2 * half):
        side = 0 if r < half else 1
        state.psi[r] = equilibrium(e.ocp, e.entropic, side, t_k - e.reference_k, theta0[side])[0]
    if s.strength > 0.0:
        salt_forcing(s, state.c, state.forcing)
    for u in range(p.place.shape[0]):
        side = 0 if p.place[u] < half else 1
        state.mean[u] = theta0[side]
        if p.strength[side] > 0.0:
            steepest = solid_forcing(
                state.mean[u], state.z[u], p.at, p.project, p.psi[side], t.nodes, t.force
            )
            state.largest[p.kind[u]] = 1.0 + p.strength[side] * steepest


@njit(inline="always", fastmath=FASTMATH)
def set_rates(e, t, t_k):  # type: ignore[no-untyped-def]
    """Set the Arrhenius factors of all quantities with an activation energy."""
    for i in range(8):
        t.rates[i] = arrhenius(e.energies[i], t_k, e.reference_k)


@compiled
def voltage_of(s, e, state, t, phi_n, phi_p, density):  # type: ignore[no-untyped-def]
    """Terminal voltage, V: difference of the collectors' potentials minus the drops in separator and contacts."""
    gap = 0.0
    for i in range(s.gap_path.shape[0]):
        if s.gap_path[i] > 0.0:
            gap += s.gap_path[i] / lookup(s.kappa, state.c[i] / s.top)
    return phi_p - phi_n - density * (gap / t.rates[5] + e.contact * e.area)


@compiled
def heat_power(p, e, state, half, current, voltage, t_k):  # type: ignore[no-untyped-def]
    """Heat released, W: power of the lithium from the mean stoichiometry of its particle, with its entropy, minus the
    power stored in double layers and the electric power delivered."""
    power = -current * voltage
    for r in range(state.layer.shape[0]):
        power -= e.area * state.layer[r] * state.psi[r]
    for u in range(p.place.shape[0]):
        side = 0 if p.place[u] < half else 1
        slope = row_lookup(e.entropic, side, state.mean[u])
        level = equilibrium(e.ocp, e.entropic, side, t_k - e.reference_k, state.mean[u])[0]
        power += e.area * state.y[u] * (t_k * slope - level)
    return power


@njit(inline="always", fastmath=FASTMATH)
def power_in_range(p, s, e, state, t, half, current, phi_n, phi_p, t_k):  # type: ignore[no-untyped-def]
    """`heat_power` at the end of a step, 0 where an electrode or the salt has left its range. Single full or empty
    units are no fault: their potentials continue beyond [0, 1].
    """
    theta_n, theta_p = mean_surfaces(p, state.theta, half)
    power = 0.0
    if left_range(theta_n, theta_p, state.c, s.c0) == 0:
        voltage = voltage_of(s, e, state, t, phi_n, phi_p, t.total[0])
        power = heat_power(p, e, state, half, current, voltage, t_k)
    return power
