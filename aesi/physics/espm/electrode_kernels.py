"""Compiled solution of one electrode: the currents of its units at one potential.

Each electrode holds units: a particle of one size in one region. All units of an electrode see one potential Phi
between its collector and the electrolyte at the separator's edge:

    Phi = U(theta_u) + eta(y_u) + R(theta_u) y_u + (L/sigma S + L/kappa E) y + chi ln(c_r / c_mean)
    sum y + capacitive + plating = J

with y_u the current of unit u per cell area, positive for delithiation, R the film's resistance over the unit's
surface, J = I/A in the negative electrode and -I/A in the positive. Newton's method solves for all y and Phi; for a
single unit only for its y, which without a double layer is known at once.
"""

import math

import numpy as np
from numba import njit

from aesi.physics.espm.interface_kernels import end_weight, overpotential, relaxed, stripped
from aesi.physics.espm.kernels import (
    BEYOND_RANGE_V,
    FASTMATH,
    SMALLEST_OCCUPANCY,
    compiled,
    lookup,
    open_circuit,
)

NEWTON_STEPS = 60
"""Largest number of Newton's steps; a handful is usual."""
NEWTON_TOLERANCE_V = 1e-11
"""Tolerance of every potential: well below the 1e-9 V to which an effect vanishes at its neutral value."""
UNSOLVED_V = 1e-6
"""Residual of a potential, V, beyond which the result of Newton's method is no solution: well below any noise."""
FARTHEST_V = 20.0
"""Potentials of an electrode against the electrolyte lie within this, V, also far beyond the ends of a cell."""
BISECTIONS = 60
"""Halvings of an interval, which leave it at the last digit of a float."""
SMALLEST_STEP = 1.0 / 256.0
"""Smallest share of a Newton step; it is taken even if it does not reduce the residual."""
SMALLEST_SLOPE = 1e-9
"""Lower limit of the slope of a potential in its current, so that the step at a flat one is finite."""
SMALLEST_SHARE = 1e-12
"""Lower limit of a double layer's current at the end of a step, as a share of its mean over the step."""


@compiled
def solve_electrode(lo, hi, side, total, at, particles, surfaces, memory):  # type: ignore[no-untyped-def]
    """Currents y[lo:hi] of the units of one electrode; returns Phi.

    total : A/m2 of cell, positive for delithiation.  at : a `StepEnd`.  particles, surfaces, memory : see `layout`;
    memory.delta, memory.layer and memory.plated are old in, new out.
    """
    memory.new_layer.fill(0.0)
    if hi - lo == 1:
        phi = solve_unit(lo, side, total, at, particles, surfaces, memory)
    else:
        phi = solve_units(lo, hi, side, total, at, particles, surfaces, memory)
    regions = memory.ohm.shape[0]
    for r in range(regions):
        region = side * regions + r
        if at.dt > 0.0:
            stored = surfaces.capacity[side] * (memory.new_delta[r] - memory.delta[region]) / at.dt
            memory.ahead[region] = memory.new_layer[r] - stored
        memory.delta[region] = memory.new_delta[r]
        memory.layer[region] = memory.new_layer[r]
        if side == 0 and surfaces.plating[0] > 0.0:
            memory.plated[r] = memory.new_plated[r]
    return phi


@compiled
def solve_unit(lo, side, total, at, particles, surfaces, memory):  # type: ignore[no-untyped-def]
    """Newton's method on the current of an electrode's only unit, between bounds; returns Phi.

    The total current grows with the unit's, but as a logarithm at large currents, where Newton's step overshoots: of a
    double layer in short steps it may jump to and fro for ever, just inside the bounds. Where a step is not half of
    the one before, the interval between the bounds is halved.
    """
    y, slope, gain = memory.y, memory.slope, memory.gain
    first = side * memory.ohm.shape[0]
    phi, least, most, moved = 0.0, -math.inf, math.inf, math.inf
    for step in range(NEWTON_STEPS):
        evaluate_electrode(lo, lo + 1, side, total, step == 0, at, particles, surfaces, memory)
        phi = memory.potential[0] + memory.ohm[0, 0] * total + at.chi * memory.log_salt[first]
        off = memory.total[first] - total
        memory.total[first] = total
        if abs(off) * slope[0] < NEWTON_TOLERANCE_V * gain[0]:
            break
        if off > 0.0:
            most = y[lo]
        else:
            least = y[lo]
        ahead = y[lo] - off / gain[0]
        nears = least < ahead < most and abs(off) < 0.5 * moved * gain[0]
        if not (nears or math.isinf(least) or math.isinf(most)):
            ahead = 0.5 * (least + most)
        moved = abs(ahead - y[lo])
        y[lo] = ahead
    return phi


@compiled
def solve_units(lo, hi, side, total, at, particles, surfaces, memory):  # type: ignore[no-untyped-def]
    """Newton's method on the currents of several units and on Phi, which is returned.

    Where a unit fills, its kinetic drop is a logarithm of the remaining room, and a full step passes the end of it:
    steps are halved until they reduce the residual. Where that leads nowhere, as beyond the ends of a cell, the units
    of a single region are solved by `solve_between`; several regions keep what the last step left.
    """
    matrix, move, n, phi = memory.matrix, memory.move, hi - lo, 0.0
    share, nearest, ohm, away = 1.0, math.inf, 0.0, math.inf
    for step in range(NEWTON_STEPS):
        evaluate_electrode(lo, hi, side, total, step == 0, at, particles, surfaces, memory)
        if step == 0:
            phi, ohm = memory.potential[0], memory.slope[0]
        worst, off = linearise(lo, hi, side, total, phi, at.chi, particles, memory)
        if worst < NEWTON_TOLERANCE_V and abs(off) * memory.slope[0] < NEWTON_TOLERANCE_V:
            return phi
        away = max(worst, abs(off) * ohm)
        if away < nearest or share < SMALLEST_STEP:
            eliminate(matrix, n + 1)
            for i in range(n + 1):
                move[i] = matrix[i, n + 1]
            nearest, share, ahead = away, 1.0, 1.0
        else:
            share *= 0.5
            ahead = -share
        for i in range(n):
            memory.y[lo + i] += ahead * move[i]
        phi += ahead * move[n]
    if away > UNSOLVED_V and memory.ohm.shape[0] == 1:
        return solve_between(lo, hi, side, total, at, particles, surfaces, memory)
    return phi


@compiled
def solve_between(lo, hi, side, total, at, particles, surfaces, memory):  # type: ignore[no-untyped-def]
    """The currents of the units of one region and Phi, which is returned, by bisection: of the potential that all units
    have against the electrolyte beside them, and within it of the current of each. Both rise with each other.

    NaN where the electrode does not move lithium over the step, so that no current is bounded.
    """
    first = side * memory.ohm.shape[0]
    lowest, highest = -FARTHEST_V, FARTHEST_V
    # A potential within the bounds has its stoichiometry within 1 +/- beyond.
    beyond = 1.0 + FARTHEST_V / BEYOND_RANGE_V
    for _ in range(BISECTIONS):
        potential = 0.5 * (lowest + highest)
        for u in range(lo, hi):
            if not memory.theta_per_y[u] > 0.0:
                return math.nan
            even = particles.share[u] * total
            least = even + (memory.pred[u] - 1.0 - beyond) / memory.theta_per_y[u]
            most = even + (memory.pred[u] + beyond) / memory.theta_per_y[u]
            for _ in range(BISECTIONS):
                memory.y[u] = 0.5 * (least + most)
                here, _ = surface_potential(u, side, total, at, particles, surfaces, memory)
                if here > potential:
                    most = memory.y[u]
                else:
                    least = memory.y[u]
        evaluate_electrode(lo, hi, side, total, False, at, particles, surfaces, memory)
        if memory.total[first] > total:
            highest = potential
        else:
            lowest = potential
    memory.total[first] = total
    return potential + memory.ohm[0, 0] * total + at.chi * memory.log_salt[first]


@compiled
def linearise(lo, hi, side, total, phi, chi, particles, memory):  # type: ignore[no-untyped-def]
    """memory.matrix : the equations of `solve_units` about its currents and `phi`, their right-hand side last.

    Returns the largest residual of a potential (V), and the sum of the currents minus `total`.
    """
    matrix, slope, gain, ohm = memory.matrix, memory.slope, memory.gain, memory.ohm
    regions, n = ohm.shape[0], hi - lo
    first = side * regions
    worst, off = 0.0, -total
    for r in range(regions):
        off += memory.total[first + r]
    for i in range(n):
        r = particles.place[lo + i, 1]
        residual = memory.potential[i] + chi * memory.log_salt[first + r] - phi
        for v in range(regions):
            residual += ohm[r, v] * memory.total[first + v]
        matrix[i, n + 1] = -residual
        worst = max(worst, abs(residual))
        for j in range(n):
            matrix[i, j] = ohm[r, particles.place[lo + j, 1]] * gain[j]
        matrix[i, i] += slope[i]
        matrix[i, n] = -1.0
    for j in range(n):
        matrix[n, j] = gain[j]
    matrix[n, n] = 0.0
    matrix[n, n + 1] = -off
    return worst, off


@njit(inline="always", fastmath=FASTMATH)
def evaluate_electrode(lo, hi, side, total, begins, at, particles, surfaces, memory):  # type: ignore[no-untyped-def]
    """Potential, slope and gain of each unit at its current, and the current of each region with its side currents.

    gain : derivative of the region's current in the unit's; that of the region's first unit includes double layer and
    plating.  begins : True at the first Newton step.
    """
    regions = memory.ohm.shape[0]
    first = side * regions
    for r in range(regions):
        memory.total[first + r] = 0.0
        memory.conductance[r] = 0.0
        memory.new_delta[r] = np.nan
    for i in range(hi - lo):
        u = lo + i
        r = particles.place[u, 1]
        memory.potential[i], memory.slope[i] = surface_potential(
            u, side, total, at, particles, surfaces, memory
        )
        memory.gain[i] = 1.0
        memory.total[first + r] += memory.y[u]
        memory.conductance[r] += 1.0 / memory.slope[i]
    for i in range(hi - lo):
        r = particles.place[lo + i, 1]
        if math.isnan(memory.new_delta[r]):
            memory.new_delta[r] = memory.potential[i]
            extra, d_extra = layer_current(r, side, memory.potential[i], begins, at, surfaces, memory)
            if side == 0 and surfaces.plating[0] > 0.0:
                metal, d_metal = metal_current(r, memory.potential[i], at, surfaces, memory)
                extra += metal
                d_extra += d_metal
            memory.total[first + r] += extra
            memory.gain[i] += d_extra * memory.slope[i]


@njit(inline="always", fastmath=FASTMATH)
def surface_potential(u, side, total, at, particles, surfaces, memory):  # type: ignore[no-untyped-def]
    """Potential (V) of unit u against the electrolyte beside it, at its current, and the slope in the current."""
    ocp, y, theta_per_y = surfaces.ocp[side], memory.y, memory.theta_per_y
    t = memory.pred[u] - theta_per_y[u] * (y[u] - particles.share[u] * total)
    memory.theta[u] = t
    region = side * memory.ohm.shape[0] + particles.place[u, 1]
    k, salt = 3 * region, memory.salt
    occupancy = max(t * (1.0 - t), SMALLEST_OCCUPANCY)
    eta, d_eta = overpotential(
        y[u], particles.exchange[u] * at.quicker * lookup(surfaces.rate[side], t), occupancy,
        salt[k], salt[k + 1], salt[k + 2], memory.log_salt[region], surfaces.alpha[side], at.thermal,
    )  # fmt: skip
    resistance = lookup(surfaces.film[side], t) * at.film / particles.reactive[u]
    inside = min(max(t, 0.0), 1.0)
    last = ocp.shape[0] - 1
    cell = min(int(inside * last), last - 1)
    falls = (ocp[cell + 1] - ocp[cell]) * last if t == inside else -BEYOND_RANGE_V
    u_eq = open_circuit(ocp, t) + at.rise * lookup(surfaces.entropic[side], inside)
    # The room that the reaction has changes with the current, too.
    if occupancy > SMALLEST_OCCUPANCY:
        d_eta *= 1.0 + theta_per_y[u] * y[u] * (0.5 - t) / occupancy
    return u_eq + eta + resistance * y[u], max(d_eta + resistance - theta_per_y[u] * falls, SMALLEST_SLOPE)


@njit(inline="always", fastmath=FASTMATH)
def layer_current(r, side, potential, begins, at, surfaces, memory):  # type: ignore[no-untyped-def]
    """Current (A/m2) into the double layer of region r at the end of the step, and its slope in the potential.

    All units of the region charge it together: its time constant follows from their conductances in parallel.
    """
    capacity = surfaces.capacity[side]
    if not (capacity > 0.0 and at.dt > 0.0):
        return 0.0, 0.0
    region = side * memory.ohm.shape[0] + r
    if begins:
        z = at.dt * memory.conductance[r] / capacity
        memory.fitted[r] = 1.0 / max(relaxed(z), SMALLEST_SHARE) if at.held else end_weight(z)
    weight = memory.fitted[r]
    charging = capacity * (potential - memory.delta[region]) / (at.dt * weight)
    if not at.held:
        charging -= (1.0 - weight) / weight * memory.layer[region]
    memory.new_layer[r] = charging
    return charging, capacity / (at.dt * weight)


@njit(inline="always", fastmath=FASTMATH)
def metal_current(r, potential, at, surfaces, memory):  # type: ignore[no-untyped-def]
    """Current (A/m2) of stripping lithium metal in region r over the step, and its slope in the potential."""
    filled = surfaces.plating_to_c * at.dt
    metal, slope, memory.new_plated[r] = stripped(
        surfaces.plating[0],
        surfaces.plating[1],
        memory.plated[r],
        filled,
        memory.region_salt[r],
        potential,
        at.thermal,
    )
    return metal, slope


@njit(inline="always", fastmath=FASTMATH)
def local_conductivity(table, salt, first, unit):  # type: ignore[no-untyped-def]
    """Harmonic mean of the conductivity over three Gauss points."""
    k1, k2 = lookup(table, salt[first] * unit), lookup(table, salt[first + 1] * unit)
    k3 = lookup(table, salt[first + 2] * unit)
    return 18.0 / (5.0 / k1 + 8.0 / k2 + 5.0 / k3)


@compiled
def region_drops(solid, salt, kappa, first, ohm):  # type: ignore[no-untyped-def]
    """Set ohm[r, v], ohm m2: drop of region r per current of region v."""
    regions = ohm.shape[0]
    for v in range(regions):
        for r in range(regions):
            ohm[r, v] = solid[r, v]
            for m in range(r, regions):
                ohm[r, v] += salt[r, m, v] / kappa[first + m]


@compiled
def eliminate(matrix, n):  # type: ignore[no-untyped-def]
    """Solve in place: the right-hand side in column n is replaced by the solution."""
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
