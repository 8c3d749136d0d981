"""Compiled solution of one step: the reaction at every place of both electrodes, coupled by the salt.

Places are the Gauss points, those of the negative electrode first, each counted from its collector. At place r

    psi_r = U(theta_u) + eta(y_u, theta_u, s_r) + R(theta_u) y_u    for each unit u there (a particle of one size),
    psi_r + chi ln s_r + sum_v ohm[r, v] Y_v = Phi        with the collector's potential Phi of its electrode,
    Y_r = sum_u y_u + double layer + plating,             sum over an electrode Y_v = its current,

with theta_u = theta_base_u - theta_per_y_u y_u and s_r = base_salt_r + sum_v spread[r, v] Y_v: particles and salt at
the end of a step are linear in the reaction there. Newton's method on Y and Phi; units and psi are eliminated place by
place. Where it oscillates, at the edges of potentials, `guarded_kernels` starts again.
"""

from numba import njit

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K
from aesi.physics.dfn.direction_kernels import UPDATE_TOLERANCE_V, add_side_currents, newton_direction
from aesi.physics.dfn.guarded_kernels import solve_guarded
from aesi.physics.dfn.local_kernels import SMALLEST_SALT, unit_potential
from aesi.physics.espm.kernels import FASTMATH, compiled

GAS_OVER_FARADAY = GAS_CONSTANT_J_MOL_K / FARADAY_C_MOL
EASY_STEPS = 6
"""Newton's steps before `guarded_kernels` takes over; most time steps need two."""


@compiled
def solve_reaction(p, e, t, n, spread, total, t_k, y, theta, psi, reaction, salt):  # type: ignore[no-untyped-def]
    """Currents y of all units (A per m2 of cell). Returns the collectors' potentials, V, and the number of steps,
    negative where no solution was found.

    p, e, t, n : Particles, Electrodes, DfnTrial and NewtonScratch, see `layout`.  spread : (places, places) m2/A.
    total : (2,) current of each electrode, delithiation positive.  t_k : K.
    y, psi : start values in, solution out.  theta, reaction (Y), salt (over rest) : out.
    """
    places, half = psi.shape[0], psi.shape[0] // 2
    phi_n, phi_p = 0.0, 0.0
    thermal = GAS_OVER_FARADAY * t_k
    chi = 2.0 * (1.0 - e.transference) * thermal
    sum_units(p, y, reaction)
    for r in range(places):
        n.psi_in[r] = psi[r]
    for u in range(y.shape[0]):
        n.y_in[u] = y[u]
    for step in range(EASY_STEPS):
        evaluate_units(
            p, e, t, n, spread, thermal, t_k - e.reference_k, step == 0, y, theta, psi, reaction, salt
        )
        if e.has_layers or e.plating[0] > 0.0:
            sum_units(p, y, reaction)
            add_side_currents(e, t, n, thermal, psi, reaction, salt)
        phi_n, phi_p = newton_direction(p, t, n, spread, chi, total, psi, reaction, salt, half)
        worst = 0.0
        for r in range(places):
            psi[r] += n.d_psi[r]
            reaction[r] += n.d_reaction[r]
            worst = max(worst, abs(n.d_psi[r]))
        for u in range(y.shape[0]):
            y[u] += n.d_y[u]
        if worst < UPDATE_TOLERANCE_V:
            for u in range(y.shape[0]):
                theta[u] = t.theta_base[u] - t.theta_per_y[u] * y[u]
            for r in range(places):
                salt[r] += n.d_salt[r]
            return phi_n, phi_p, step + 1
    return solve_guarded(p, e, t, n, spread, total, t_k, thermal, y, theta, psi, reaction, salt)


@njit(inline="always", fastmath=FASTMATH)
def sum_units(p, y, reaction):  # type: ignore[no-untyped-def]
    """Set reaction (places,): the sum of the currents of the units at each place."""
    for r in range(reaction.shape[0]):
        reaction[r] = 0.0
    for u in range(y.shape[0]):
        reaction[p.place[u]] += y[u]


@compiled
def evaluate_units(p, e, t, n, spread, thermal, rise, first, y, theta, psi, reaction, salt):  # type: ignore[no-untyped-def]
    """Salt at the places; potential of every unit, its slopes in y and in the salt; their sums at each place."""
    places, half = psi.shape[0], psi.shape[0] // 2
    for r in range(places):
        n.excess[r], n.shift[r], n.conductance[r] = 0.0, 0.0, 0.0
        s = t.base_salt[r]
        for v in range(places):
            s += spread[r, v] * reaction[v]
        salt[r] = s
    for u in range(y.shape[0]):
        r = p.place[u]
        side = 0 if r < half else 1
        surface = t.theta_base[u] - t.theta_per_y[u] * y[u]
        theta[u] = surface
        n.pot[u], n.slope[u], n.by_salt[u] = unit_potential(
            e,
            side,
            t.rates[2 + side] * p.exchange[u],
            1.0 / (t.rates[6 + side] * p.reactive[u]),
            surface,
            t.theta_per_y[u],
            y[u],
            max(salt[r], SMALLEST_SALT),
            thermal,
            rise,
        )[:3]
        if salt[r] <= SMALLEST_SALT:
            n.by_salt[u] = 0.0
        if first and (u == 0 or p.place[u - 1] != r):
            psi[r] = n.pot[u]
        part = 1.0 / n.slope[u]
        n.conductance[r] += part
        n.excess[r] += (psi[r] - n.pot[u]) * part
        n.shift[r] += n.by_salt[u] * part
