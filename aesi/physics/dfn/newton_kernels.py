"""Compiled solution of one step: the reaction at every place of both electrodes, coupled by the salt.

Places are the Gauss points, those of the negative electrode first, each counted from its collector. At place r

    psi_r = U(theta_u) + eta(y_u, theta_u, s_r)           for each unit u there (a particle of one size),
    psi_r + chi ln s_r + sum_v ohm[r, v] Y_v = Phi        with the collector's potential Phi of its electrode,
    Y_r = sum_u y_u + double layer + plating,             sum over an electrode Y_v = its current,

with theta_u = reach_u - give_u y_u and s_r = calm_r + sum_v spread[r, v] Y_v: what particles and salt do within a
step is linear in the reaction at its end. Newton's method on Y and Phi; units and psi are eliminated place by place.
"""

import math

import numpy as np
from numba import njit

from aesi.physics.dfn.local_kernels import SMALLEST_SALT, equilibrium, kinetic_drop, occupancy, salt_logarithm
from aesi.physics.espm.electrode_kernels import bounded_exp
from aesi.physics.espm.kernels import FASTMATH

NEWTON_STEPS = 60
UPDATE_TOLERANCE_V = 1e-6
"""Newton's method squares what is left: after an update below this the error is below 1e-10 V."""
SMALLEST_CONDUCTANCE_SHARE = 1e-9
EASY_STEPS = 8
"""Updates are halved after so many, where a potential's steps would make them go to and fro."""


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def solve_reaction(  # type: ignore[no-untyped-def]
    place, exchange, reach, give, ocp, entropic, rise, thermal, alpha, chi, total,
    calm, spread, ohm, layer_c, layer_old, plating, plated, unit_salt,
    y, theta, psi, given, salt, plating_current, work, rhs,
):  # fmt: skip
    """Currents y of all units (A per m2 of cell); returns the collectors' potentials and the iterations, -1 if none
    held.

    total : (2,) current of each electrode, delithiation positive.  layer_c : (places,) capacity over the step,
    A/(V m2), layer_old : what it gives back.  y, psi : start values in, solution out.  theta, given (Y), salt
    (over rest), plating_current : out.  work, rhs : (places, places), (places, 3).
    """
    places, units = psi.shape[0], place.shape[0]
    half = places // 2
    phi_n, phi_p = 0.0, 0.0
    shift, slack, conductance = np.zeros(places), np.zeros(places), np.zeros(places)
    slope, pot, by_salt = np.zeros(units), np.zeros(units), np.zeros(units)
    for r in range(places):
        given[r] = 0.0
    for u in range(units):
        given[place[u]] += y[u]
    for step in range(NEWTON_STEPS):
        for r in range(places):
            slack[r], shift[r], conductance[r] = 0.0, 0.0, 0.0
            s = calm[r]
            for v in range(places):
                s += spread[r, v] * given[v]
            salt[r] = s
        for u in range(units):
            r = place[u]
            side = 0 if r < half else 1
            t = reach[u] - give[u] * y[u]
            theta[u] = t
            s = max(salt[r], SMALLEST_SALT)
            room, d_room = occupancy(t)
            eta, d_eta = kinetic_drop(y[u], exchange[u] * math.sqrt(s * room), alpha[side], thermal)
            level, falls = equilibrium(ocp[side], entropic[side], rise, t)
            pot[u] = level + eta
            moved = (
                -0.5 * y[u] * d_eta
            )  # with the logarithm of the exchange current's salt, or of its occupancy
            slope[u] = max(d_eta - give[u] * (falls + moved * d_room), 1e-3 * d_eta)
            by_salt[u] = moved / s if salt[r] > SMALLEST_SALT else 0.0
            if step == 0 and (u == 0 or place[u - 1] != r):
                psi[r] = pot[u]
            part = 1.0 / slope[u]
            conductance[r] += part
            slack[r] += (psi[r] - pot[u]) * part
            shift[r] += by_salt[u] * part
        for r in range(places):
            extra = 0.0
            if layer_c[r] > 0.0:
                extra = layer_c[r] * psi[r] - layer_old[r]
                conductance[r] += layer_c[r]
            if plating[0] > 0.0 and r < half:
                strength = plating[0] * unit_salt[r]
                up = strength * plated[r] * bounded_exp((1.0 - plating[1]) * psi[r] / thermal)
                down = strength * plating[2] * max(salt[r], 0.0) * bounded_exp(-plating[1] * psi[r] / thermal)
                plating_current[r] = up - down
                extra += up - down
                conductance[r] += ((1.0 - plating[1]) * up + plating[1] * down) / thermal
            if extra != 0.0 or layer_c[r] > 0.0:
                own = extra
                for u in range(units):
                    if place[u] == r:
                        own += y[u]
                given[r] = own
        for r in range(places):
            side = 0 if r < half else 1
            first = side * half
            logarithm, d_logarithm = salt_logarithm(salt[r])
            held = 1.0 / conductance[r]
            residual = psi[r] - slack[r] * held + chi * logarithm
            by = shift[r] * held + chi * d_logarithm
            for v in range(places):
                work[r, v] = by * spread[r, v]
            for v in range(half):
                residual += ohm[r, v] * given[first + v]
                work[r, first + v] += ohm[r, v]
            work[r, r] += held
            rhs[r, 0] = -residual
            rhs[r, 1] = 1.0 if side == 0 else 0.0
            rhs[r, 2] = 1.0 - rhs[r, 1]
        eliminate_three(work, rhs, places)
        off_n, off_p, nn, np_, pn, pp = total[0], total[1], 0.0, 0.0, 0.0, 0.0
        for r in range(half):
            off_n -= given[r] + rhs[r, 0]
            nn += rhs[r, 1]
            np_ += rhs[r, 2]
        for r in range(half, places):
            off_p -= given[r] + rhs[r, 0]
            pn += rhs[r, 1]
            pp += rhs[r, 2]
        determinant = nn * pp - np_ * pn
        phi_n = (off_n * pp - off_p * np_) / determinant
        phi_p = (off_p * nn - off_n * pn) / determinant
        ease = 1.0 if step < EASY_STEPS else 0.5 if step < 3 * EASY_STEPS else 0.2
        worst = 0.0
        for r in range(places):
            rhs[r, 0] = ease * (rhs[r, 0] + phi_n * rhs[r, 1] + phi_p * rhs[r, 2])
        for r in range(places):
            s = 0.0
            for v in range(places):
                s += spread[r, v] * rhs[v, 0]
            change = (rhs[r, 0] - ease * slack[r] + shift[r] * s) / conductance[r]
            psi[r] += change
            given[r] += rhs[r, 0]
            worst = max(worst, abs(change))
            rhs[r, 1], rhs[r, 2] = change, s
        for u in range(units):
            r = place[u]
            y[u] += (ease * (psi[r] - rhs[r, 1] - pot[u]) + rhs[r, 1] - by_salt[u] * rhs[r, 2]) / slope[u]
        if worst < UPDATE_TOLERANCE_V:
            for u in range(units):
                theta[u] = reach[u] - give[u] * y[u]
            for r in range(places):
                salt[r] += rhs[r, 2]
            return phi_n, phi_p, step + 1
    return phi_n, phi_p, -1


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def eliminate_three(matrix, rhs, n):  # type: ignore[no-untyped-def]
    """Solve in place for three right-hand sides (n, 3); resistances dominate the diagonal, so no rows are swapped."""
    for k in range(n):
        pivot = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * pivot
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
            for j in range(3):
                rhs[i, j] -= factor * rhs[k, j]
    for k in range(n - 1, -1, -1):
        pivot = 1.0 / matrix[k, k]
        for j in range(3):
            value = rhs[k, j]
            for i in range(k + 1, n):
                value -= matrix[k, i] * rhs[i, j]
            rhs[k, j] = value * pivot
