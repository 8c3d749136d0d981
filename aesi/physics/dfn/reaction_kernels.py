"""Compiled solution of one step: the reaction at every place of both electrodes, coupled by the salt.

Places are the Gauss points, those of the negative electrode first, each counted from its collector. At place r

    psi_r = U(theta_u) + eta(y_u, theta_u, s_r)           for each unit u there (a particle of one size),
    psi_r + chi ln s_r + sum_v ohm[r, v] Y_v = Phi        with the collector's potential Phi of its electrode,
    Y_r = sum_u y_u + double layer + plating,             sum over an electrode Y_v = its current,

with theta_u = reach_u - give_u y_u and s_r = calm_r + sum_v spread[r, v] Y_v: what particles and salt do within a
step is linear in the reaction at its end. Newton's method on Y and Phi; units and psi are eliminated place by place.
Where it goes to and fro, at the edges of potentials, its steps are halved until they bring it nearer.
"""

import math

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K
from aesi.physics.dfn.local_kernels import (
    SMALLEST_SALT,
    compiled,
    equilibrium,
    kinetic_drop,
    occupancy,
    rate_course,
    salt_logarithm,
)
from aesi.physics.espm.electrode_kernels import bounded_exp

GAS_OVER_FARADAY = GAS_CONSTANT_J_MOL_K / FARADAY_C_MOL

UPDATE_TOLERANCE_V = 5e-5
"""Newton's method squares what is left: after an update below this the error is about its square over 2 R T / F,
0.05 uV."""
EASY_STEPS = 6
"""So many without looking back; most steps need two."""
MOST_STEPS = 40
SMALLEST_SHARE = 1.0 / 256.0
"""Of a Newton step, below which it is taken although it does not bring the solution nearer."""
SMALLEST_SLOPE = 1e-3
"""Of the kinetic slope: what filling takes off it would make a place run away, near the edge of a potential."""
LOST_V = 1e-3
"""A solution is found where what is left of the equations is below this, though Newton's steps do not end."""


@compiled
def solve_reaction(p, e, t, n, spread, total, t_k, y, theta, psi, given, salt, plated, plating):  # type: ignore[no-untyped-def]
    """Currents y of all units (A per m2 of cell); returns the collectors' potentials and the number of steps, negative
    where none solves the equations.

    p, e, t, n : Particles, Electrodes, DfnTrial and NewtonScratch, see `layout`.  spread : (places, places) m2/A.
    total : (2,) current of each electrode, delithiation positive.  t_k : K.
    y, psi : start values in, solution out.  theta, given (Y), salt (over rest), plating (places,) : out.
    """
    places, half = psi.shape[0], psi.shape[0] // 2
    phi_n, phi_p, share, merit_before, merit = 0.0, 0.0, 1.0, 0.0, 0.0
    thermal = GAS_OVER_FARADAY * t_k
    chi = 2.0 * (1.0 - e.transference) * thermal
    for r in range(places):
        given[r] = 0.0
    for u in range(y.shape[0]):
        given[p.place[u]] += y[u]
    for step in range(MOST_STEPS):
        evaluate_units(
            p, e, t, n, spread, thermal, t_k - e.reference_k, step == 0, y, theta, psi, given, salt
        )
        if e.has_layers or e.plating[0] > 0.0:
            add_side_currents(p, e, t, n, thermal, y, psi, given, salt, plated, plating)
        if step > EASY_STEPS:
            merit = distance(p, t, n, chi, psi, given, salt, phi_n, phi_p)
            if step > EASY_STEPS + 1 and merit >= merit_before and share > SMALLEST_SHARE:
                share *= 0.5
                for r in range(places):
                    psi[r] -= share * n.d_psi[r]
                    given[r] -= share * n.d_given[r]
                for u in range(y.shape[0]):
                    y[u] -= share * n.d_y[u]
                phi_n -= share * n.d_phi[0]
                phi_p -= share * n.d_phi[1]
                continue
            merit_before, share = merit, 1.0
        new_n, new_p = newton_direction(p, t, n, spread, chi, total, psi, given, salt, half)
        n.d_phi[0], n.d_phi[1] = new_n - phi_n, new_p - phi_p
        phi_n, phi_p = new_n, new_p
        worst = 0.0
        for r in range(places):
            psi[r] += n.d_psi[r]
            given[r] += n.d_given[r]
            worst = max(worst, abs(n.d_psi[r]))
        for u in range(y.shape[0]):
            y[u] += n.d_y[u]
        if worst < UPDATE_TOLERANCE_V:
            for u in range(y.shape[0]):
                theta[u] = t.reach[u] - t.give[u] * y[u]
            for r in range(places):
                salt[r] += n.d_salt[r]
            return phi_n, phi_p, step + 1
    return phi_n, phi_p, MOST_STEPS if merit < LOST_V else -MOST_STEPS


@compiled
def evaluate_units(p, e, t, n, spread, thermal, rise, first, y, theta, psi, given, salt):  # type: ignore[no-untyped-def]
    """Salt at the places; potential of every unit, its slopes in y and in the salt; what they come to at a place."""
    places, half = psi.shape[0], psi.shape[0] // 2
    for r in range(places):
        n.slack[r], n.shift[r], n.conductance[r] = 0.0, 0.0, 0.0
        s = t.calm_salt[r]
        for v in range(places):
            s += spread[r, v] * given[v]
        salt[r] = s
    for u in range(y.shape[0]):
        r = p.place[u]
        side = 0 if r < half else 1
        surface = t.reach[u] - t.give[u] * y[u]
        theta[u] = surface
        s = max(salt[r], SMALLEST_SALT)
        room, d_room = occupancy(surface)
        quicker, d_quicker = rate_course(e.rate, side, surface)
        eta, d_eta = kinetic_drop(
            y[u], t.rates[2 + side] * p.exchange[u] * quicker * math.sqrt(s * room), e.alpha[side], thermal
        )
        level, falls = equilibrium(e.ocp, e.entropic, side, rise, surface)
        n.pot[u] = level + eta
        moved = (
            -0.5 * y[u] * d_eta
        )  # with the logarithm of the salt, or of the occupancy, in the exchange current
        n.slope[u] = max(
            d_eta - t.give[u] * (falls + moved * (d_room + 2.0 * d_quicker)), SMALLEST_SLOPE * d_eta
        )
        n.by_salt[u] = moved / s if salt[r] > SMALLEST_SALT else 0.0
        if first and (u == 0 or p.place[u - 1] != r):
            psi[r] = n.pot[u]
        part = 1.0 / n.slope[u]
        n.conductance[r] += part
        n.slack[r] += (psi[r] - n.pot[u]) * part
        n.shift[r] += n.by_salt[u] * part


@compiled
def add_side_currents(p, e, t, n, thermal, y, psi, given, salt, plated, plating):  # type: ignore[no-untyped-def]
    """Double layers and plating of each place, into `given` and the conductance."""
    half = psi.shape[0] // 2
    given[:] = 0.0
    for u in range(y.shape[0]):
        given[p.place[u]] += y[u]
    for r in range(psi.shape[0]):
        given[r] += t.layer_c[r] * psi[r] - t.layer_old[r]
        n.conductance[r] += t.layer_c[r]
        if e.plating[0] > 0.0 and r < half:
            strength = e.plating[0] * e.node_share[r]
            up = strength * plated[r] * bounded_exp((1.0 - e.plating[1]) * psi[r] / thermal)
            down = strength * e.plating[2] * max(salt[r], 0.0) * bounded_exp(-e.plating[1] * psi[r] / thermal)
            plating[r] = up - down
            given[r] += up - down
            n.conductance[r] += ((1.0 - e.plating[1]) * up + e.plating[1] * down) / thermal


@compiled
def distance(p, t, n, chi, psi, given, salt, phi_n, phi_p):  # type: ignore[no-untyped-def]
    """Largest of what is left of the equations (V)."""
    places, half = psi.shape[0], psi.shape[0] // 2
    worst = 0.0
    for r in range(places):
        first = 0 if r < half else half
        residual = psi[r] + chi * salt_logarithm(salt[r])[0] - (phi_n if r < half else phi_p)
        for v in range(half):
            residual += t.ohm[r, v] * given[first + v]
        worst = max(worst, abs(residual))
    for u in range(n.pot.shape[0]):
        worst = max(worst, abs(n.pot[u] - psi[p.place[u]]))
    return worst


@compiled
def newton_direction(p, t, n, spread, chi, total, psi, given, salt, half):  # type: ignore[no-untyped-def]
    """Newton's step: d_given, d_psi, d_y, d_salt, and the new potentials of both collectors."""
    places = 2 * half
    for r in range(places):
        first = 0 if r < half else half
        logarithm, d_logarithm = salt_logarithm(salt[r])
        held = 1.0 / n.conductance[r]
        residual = psi[r] - n.slack[r] * held + chi * logarithm
        by = n.shift[r] * held + chi * d_logarithm
        for v in range(places):
            n.matrix[r, v] = by * spread[r, v]
        for v in range(half):
            residual += t.ohm[r, v] * given[first + v]
            n.matrix[r, first + v] += t.ohm[r, v]
        n.matrix[r, r] += held
        n.rhs[r, 0] = -residual
        n.rhs[r, 1] = 1.0 if r < half else 0.0
        n.rhs[r, 2] = 1.0 - n.rhs[r, 1]
    eliminate_three(n.matrix, n.rhs, places)
    off_n, off_p, nn, np_, pn, pp = total[0], total[1], 0.0, 0.0, 0.0, 0.0
    for r in range(half):
        off_n -= given[r] + n.rhs[r, 0]
        nn += n.rhs[r, 1]
        np_ += n.rhs[r, 2]
    for r in range(half, places):
        off_p -= given[r] + n.rhs[r, 0]
        pn += n.rhs[r, 1]
        pp += n.rhs[r, 2]
    determinant = nn * pp - np_ * pn
    phi_n = (off_n * pp - off_p * np_) / determinant
    phi_p = (off_p * nn - off_n * pn) / determinant
    for r in range(places):
        n.d_given[r] = n.rhs[r, 0] + phi_n * n.rhs[r, 1] + phi_p * n.rhs[r, 2]
    for r in range(places):
        s = 0.0
        for v in range(places):
            s += spread[r, v] * n.d_given[v]
        n.d_salt[r] = s
        n.d_psi[r] = (n.d_given[r] - n.slack[r] + n.shift[r] * s) / n.conductance[r]
    for u in range(n.pot.shape[0]):
        r = p.place[u]
        n.d_y[u] = (psi[r] - n.pot[u] + n.d_psi[r] - n.by_salt[u] * n.d_salt[r]) / n.slope[u]
    return phi_n, phi_p


@compiled
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
