"""Compiled solution of one electrode: the currents of its units at one potential.

Each electrode holds units: a particle of one size in one region. All units of an electrode see one potential Phi
between its collector and the electrolyte at the separator's edge:

    Phi = U(theta_u) + eta(y_u) + R(theta_u) y_u + (L/sigma S + L/kappa E) y + chi ln(c_r / c_mean)
    sum y + capacitive + plating = J

with y_u the current of unit u per cell area, positive for delithiation, R the film's resistance over the unit's
surface, J = I/A in the negative electrode and -I/A in the positive. Newton's method on all y and Phi, of one unit on
its y alone: without a double layer it is there at once.
"""

import math

import numpy as np
from numba import njit

from aesi.physics.espm.kernels import (
    BEYOND_RANGE_V,
    FASTMATH,
    SMALLEST_OCCUPANCY,
    lookup,
    mean_asinh,
    open_circuit,
)

SMALLEST_EXPONENT, LARGEST_EXPONENT = -60.0, 60.0
NEWTON_STEPS = 60
"""At most; a handful is usual."""
NEWTON_TOLERANCE_V = 1e-11
"""Of every potential: well within the 1e-9 V to which an effect vanishes at its neutral value."""
SMALLEST_SLOPE = 1e-9
"""Of a potential over its current: a flat one takes a finite step."""
SMALLEST_SHARE = 1e-12
"""Of a double layer's mean current over a step, at its end."""


@njit(inline="always", fastmath=FASTMATH)
def bounded_exp(x):  # type: ignore[no-untyped-def]
    """exp with its argument kept from overflow."""
    return math.exp(min(max(x, SMALLEST_EXPONENT), LARGEST_EXPONENT))


@njit(cache=True, nogil=True, fastmath=FASTMATH)
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


@njit(inline="always", fastmath=FASTMATH)
def relaxed(z):  # type: ignore[no-untyped-def]
    """Current at the end of a step of z time constants over its mean, of an exponential that a jump began."""
    return z / math.expm1(min(z, LARGEST_EXPONENT)) if z > 1e-6 else 1.0 - 0.5 * z


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def solve_electrode(  # type: ignore[no-untyped-def]
    lo,
    hi,
    side,
    total,
    dt,
    held,
    thermal,
    temperature_rise,
    chi,
    exchange_factor,
    film_factor,
    particles,
    surfaces,
    memory,
):
    """Currents y[lo:hi] of the units of one electrode; returns Phi.

    total : A/m2 of cell, positive for delithiation.  held : whether it jumped to this where the step began; a double
    layer's current is then no continuation of the last one, and would ring.  thermal : R T / F, V.
    chi : 2 (1 - t+) R T / F, V.  exchange_factor, film_factor : of temperature, on rates and films.
    particles, surfaces, memory : see `layout`; memory.delta and memory.layer are old in, new out.
    """
    region_of, share, exchange = particles.place[:, 1], particles.share, particles.exchange
    reactive, film = particles.reactive, surfaces.film[side]
    ocp, entropic, rate = surfaces.ocp[side], surfaces.entropic[side], surfaces.rate[side]
    alpha, capacity, plating = surfaces.alpha[side], surfaces.capacity[side], surfaces.plating
    y, theta, theta_pred, give, ohm, salt, log_salt, region_salt = memory[:8]
    delta, dl_current, region_total, plated, plating_current, work = memory[8:]
    regions = ohm.shape[0]
    n = hi - lo
    first = side * regions
    potential, slope = work[0], work[1]
    matrix = work[2 : 3 + n, : n + 2]
    new_delta, gain, fitted, new_current = work[3 + n], work[4 + n], work[5 + n], work[6 + n]
    new_current[:] = 0.0
    phi, least, most = 0.0, -math.inf, math.inf
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
                y[u], exchange[u] * exchange_factor * lookup(rate, t), occupancy,
                salt[k], salt[k + 1], salt[k + 2], log_salt[first + r] , alpha, thermal,
            )  # fmt: skip
            resistance = lookup(film, t) * film_factor / reactive[u]
            eta += resistance * y[u]
            d_eta += resistance
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
                        z = dt / (capacity * slope[i])
                        fitted[r] = 1.0 / max(relaxed(z), SMALLEST_SHARE) if held else end_weight(z)
                    charging = capacity * (potential[i] - delta[first + r]) / (dt * fitted[r])
                    if not held:
                        charging -= (1.0 - fitted[r]) / fitted[r] * dl_current[first + r]
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
        if n == 1:
            phi = potential[0] + ohm[0, 0] * total + chi * log_salt[first]
            off = region_total[first] - total
            region_total[first] = total
            if abs(off) * slope[0] < NEWTON_TOLERANCE_V * gain[0]:
                break
            # What is given grows with y, but as a logarithm far out, where Newton's step leaps to the other side.
            if off > 0.0:
                most = y[lo]
            else:
                least = y[lo]
            ahead = y[lo] - off / gain[0]
            bracketed = least < ahead < most or math.isinf(least) or math.isinf(most)
            y[lo] = ahead if bracketed else 0.5 * (least + most)
            continue
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


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def region_drops(solid, salt, kappa, first, ohm):  # type: ignore[no-untyped-def]
    """ohm[r, v] : drop of region r per current of region v."""
    regions = ohm.shape[0]
    for v in range(regions):
        for r in range(regions):
            ohm[r, v] = solid[r, v]
            for m in range(r, regions):
                ohm[r, v] += salt[r, m, v] / kappa[first + m]


@njit(cache=True, nogil=True, fastmath=FASTMATH)
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
