"""Compiled run of the porous electrode over a record: steps between samples, temperature, voltage, outputs."""

import math

import numpy as np
from numba import njit

from aesi.physics.dfn.diffusion_kernels import renew, salt_forcing
from aesi.physics.dfn.local_kernels import equilibrium, row_lookup
from aesi.physics.dfn.stepping_kernels import advance, hold_layers, settle, take_back
from aesi.physics.espm.kernels import FASTMATH, NANOSECONDS, compiled, lookup
from aesi.physics.espm.layout import CACHE_SLOTS
from aesi.physics.espm.transport_kernels import (
    DIFFUSIONS,
    TEMPERATURE_STEP_K,
    arrhenius,
    heated,
    mean_heat,
    solid_forcing,
)

SHORTER, SHORTEST = 0.25, 0.25**6
"""Where no reaction is found at the end of a step, a quarter of it is tried, down to the shortest: at the edges of
potentials, and where one rises with lithium, the end of a long step has several solutions or none in reach."""
UNDERSHOOT = 0.02
"""Of the rest concentration. The reaction leaves a place that runs dry, and the salt there stays at nought; its
polynomial passes below by 0.8 % at worst before the cut-off (LG HG2 at -2 degC and 3.2C, 0.2 % with 20 points)."""
FIRST_LENGTH = 0.25
"""Of a step, where double layers meet a current that has turned: whole steps of 1 s between edges of 0.1 s were 0.52 mV
RMS off under pulses to 3C, a quarter of one first leaves 0.05."""
ROUND_OFF = 1e-9
"""Of a step: less than this before the sample is no step any more."""


@compiled
def run_porous(  # type: ignore[no-untyped-def]
    time,
    current,
    temperature,
    given,
    backward,
    substep,
    most,
    theta0,
    p,
    s,
    e,
    state,
    t,
    newton,
    weights,
    out,
    profile,
    salt_profile,
):
    """Step all samples; `layout` says what the named tuples hold.

    given : the temperature is an input.  theta0 : (2,) at rest.  out : (9, n) voltage, mean surface stoichiometries
    (n, p), c_e0, c_eL, mean stoichiometries (n, p), temperature, plated lithium (mol/m3 of the negative electrode).
    profile : (n or 0, 4, places) surfaces, reaction A/m2 per share, salt over rest, phi_s - phi_e.
    salt_profile : (n or 0, nodes) mol/m3, from one collector to the other.
    Returns (sample, what) of the first fault: 1, 2 a surface, 3 the salt, 4 no solution.
    """
    half = s.at.shape[0] // 2
    total, before, change, faster = t.total, t.before, t.change, t.faster
    start_at_rest(p, s, e, state, t, half, theta0, temperature[0])
    t_k, t_weights, t_rates = temperature[0], -1.0, temperature[0]
    set_rates(e, t, t_k)
    watts, last_dt = 0.0, 0.0
    slope, fault_at, fault = 0.0, -1, 0
    total[0] = current[0] / e.area
    total[1] = -total[0]
    phi_n, phi_p, steps = settle(p, s, e, state, t, newton, total, total, t_k)
    for k in range(time.shape[0]):
        whole = time[k] - time[k - 1] if k > 0 else 0.0
        if k > 0 and backward and current[k] != current[k - 1]:
            change[0] = (current[k] - current[k - 1]) / e.area
            change[1] = -change[0]
            total[0], total[1] = current[k] / e.area, -current[k] / e.area
            last_dt = 0.0
            if e.has_layers:
                for r in range(2 * half):
                    state.given[r] += e.node_share[r] * change[0 if r < half else 1]
                    state.layer[r] += e.node_share[r] * change[0 if r < half else 1]
            else:
                settle(p, s, e, state, t, newton, change, total, t_k)
        parts = min(max(1, math.ceil(whole / substep - 1e-9)), most) if k > 0 else 0
        turned = False
        if e.has_layers and k > 0:
            slope_before, slope = slope, 0.0 if backward else (current[k] - current[k - 1]) / whole
            turned = slope != slope_before or (backward and current[k] != current[k - 1])
        reached, length = (
            0.0,
            FIRST_LENGTH if turned else 1.0,
        )  # in parts: of the way between the samples, and of the next step
        while reached < parts - ROUND_OFF:
            length = min(length, math.floor(reached + ROUND_OFF) + 1.0 - reached)
            dt = whole / parts * length
            share = (reached + length) / parts
            before[0], before[1] = total[0], total[1]
            i1 = current[k] if backward else current[k - 1] + (current[k] - current[k - 1]) * share
            i0 = before[0] * e.area
            total[0], total[1] = i1 / e.area, -i1 / e.area
            change[0], change[1] = total[0] - before[0], total[1] - before[1]
            start_k = t_k
            if given:
                t_k = temperature[k - 1] + (temperature[k] - temperature[k - 1]) * share
            elif e.heat[0] > 0.0:
                t_k = heated(start_k, watts, dt, e.heat)
            if abs(t_k - t_weights) > TEMPERATURE_STEP_K:
                t_weights = t_k
                weights.keys.fill(-1)
                for i in range(3):
                    faster[i] = arrhenius(e.energies[DIFFUSIONS[i]], t_k, e.reference_k)
            if t_k != t_rates:
                t_rates = t_k
                set_rates(e, t, t_k)
            key = np.int64(dt * NANOSECONDS + 0.5)
            slot = key % CACHE_SLOTS
            w, taken, w_salt, spread = (
                weights.particle[slot],
                weights.taken[slot],
                weights.salt[slot],
                weights.spread[slot],
            )
            if weights.keys[slot] != key:
                weights.keys[slot] = key
                renew(p, s, faster, dt, w, taken, w_salt, spread)
            if e.has_layers:
                hold_layers(e, state, t, newton, dt)
            last_try = length <= SHORTEST or fault_at >= 0
            phi_n, phi_p, steps = advance(
                p, s, e, state, t, newton, faster, dt, last_dt, w, taken, w_salt, spread, total, change, t_k,
                last_try,
            )  # fmt: skip
            if steps < 0 and not last_try:
                take_back(state, t)
                total[0], total[1] = before[0], before[1]
                t_k, last_dt = start_k, 0.0
                length *= SHORTER
                continue
            last_dt = dt
            reached += length
            length = min(2.0 * length, 1.0)
            if steps < 0 and fault_at < 0:
                fault_at, fault = k, 4
            if e.plating[0] > 0.0:
                for r in range(half):
                    gone = e.plating_to_c * state.plating[r] * dt / e.node_share[r]
                    state.plated[r] = max(state.plated[r] - gone, 0.0)
            if e.heat[0] > 0.0:
                power = heat_power(
                    p, e, state, half, i1, voltage_of(s, e, state, t, phi_n, phi_p, total[0]), t_k
                )
                if not given:
                    t_k = heated(start_k, mean_heat(watts, power, i0, i1), dt, e.heat)
                watts = power
        voltage = voltage_of(s, e, state, t, phi_n, phi_p, total[0])
        if k == 0 and e.heat[0] > 0.0:
            watts = heat_power(p, e, state, half, current[0], voltage, t_k)
        out[0, k] = voltage
        record(p, e, state, half, out, k)
        out[7, k] = t_k
        if profile.shape[0] > 0:
            for r in range(2 * half):
                profile[k, 1, r] = state.given[r] / e.node_share[r]
                profile[k, 2, r] = state.salt[r]
                profile[k, 3, r] = state.psi[r]
            for u in range(p.place.shape[0]):
                profile[k, 0, p.place[u]] += state.theta[u] * p.share[u] / e.node_share[p.place[u]]
            for i in range(state.c.shape[0]):
                salt_profile[k, i] = state.c[i]
        if fault_at < 0 or (fault_at == k and fault == 4):
            if not 0.0 <= out[1, k] <= 1.0:
                fault_at, fault = k, 1
            elif not 0.0 <= out[2, k] <= 1.0:
                fault_at, fault = k, 2
            elif not smallest(state.c) >= -UNDERSHOOT * s.c0:
                fault_at, fault = k, 3
    return fault_at, fault


@compiled
def start_at_rest(p, s, e, state, t, half, theta0, t_k):  # type: ignore[no-untyped-def]
    """Rest: uniform particles, uniform salt, no reaction."""
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
            solid_forcing(state.mean[u], state.z[u], p.at, p.project, p.psi[side], t.nodes, state.force[u])


@njit(inline="always", fastmath=FASTMATH)
def smallest(values):  # type: ignore[no-untyped-def]
    """The smallest of (n,) values; not a number where one is not."""
    low = values[0]
    for value in values:
        if not value >= low:
            low = value
    return low


@njit(inline="always", fastmath=FASTMATH)
def set_rates(e, t, t_k):  # type: ignore[no-untyped-def]
    """Arrhenius factors of everything that has an activation energy."""
    for i in range(7):
        t.rates[i] = arrhenius(e.energies[i], t_k, e.reference_k)


@compiled
def voltage_of(s, e, state, t, phi_n, phi_p, density):  # type: ignore[no-untyped-def]
    """Terminal voltage: both collectors, less the drop in the separator and the contacts."""
    gap = 0.0
    for i in range(s.gap_path.shape[0]):
        if s.gap_path[i] > 0.0:
            gap += s.gap_path[i] / lookup(s.kappa, state.c[i] / s.top)
    return phi_p - phi_n - density * (gap / t.rates[5] + (e.contact + e.film / t.rates[6]) * e.area)


@compiled
def heat_power(p, e, state, half, current, voltage, t_k):  # type: ignore[no-untyped-def]
    """Heat released (W): what the reaction gives, with its entropy, less what leaves as electric power."""
    power = -current * voltage
    for u in range(p.place.shape[0]):
        side = 0 if p.place[u] < half else 1
        slope = row_lookup(e.entropic, side, state.theta[u])
        level = equilibrium(e.ocp, e.entropic, side, t_k - e.reference_k, state.theta[u])[0]
        power += e.area * state.y[u] * (t_k * slope - level)
    return power


@compiled
def record(p, e, state, half, out, k):  # type: ignore[no-untyped-def]
    """Averages of the electrodes, salt at the collectors, plated lithium."""
    for row in range(1, 7):
        out[row, k] = 0.0
    for u in range(p.place.shape[0]):
        side = 0 if p.place[u] < half else 1
        out[1 + side, k] += p.share[u] * state.theta[u]
        out[5 + side, k] += p.volume[u] * state.mean[u]
    out[3, k], out[4, k] = state.c[0], state.c[state.c.shape[0] - 1]
    out[8, k] = 0.0
    for r in range(half):
        out[8, k] += state.plated[r] * e.node_share[r]
