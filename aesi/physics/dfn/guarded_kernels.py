"""Compiled solution of a step for which Newton's method on currents fails: particles nearly full or empty, or
potentials that rise with lithium.

There the kinetic drop is a logarithm of the remaining room, and a small step in current passes the end of it. So the
currents are eliminated place by place: each is found by bracketing, for the potential there. Newton's method runs on
the potentials, with steps halved until they reduce the residual.
"""

import math

from aesi.physics.dfn.direction_kernels import UPDATE_TOLERANCE_V, add_side_currents, newton_direction
from aesi.physics.dfn.local_kernels import SMALLEST_SALT, salt_logarithm, unit_potential
from aesi.physics.espm.kernels import compiled

LOST_V = 1e-3
"""Largest last update with which the solution is accepted when the number of Newton's steps is used up."""
LOCAL_TOLERANCE_V = 1e-6
LOCAL_STEPS = 60
MOST_STEPS = 60
SMALLEST_SHARE = 1.0 / 256.0
"""Smallest share of a Newton step; it is taken even if it does not reduce the residual."""


@compiled
def solve_guarded(p, e, t, n, spread, total, t_k, thermal, y, theta, psi, reaction, salt):  # type: ignore[no-untyped-def]
    """As `solve_reaction`, from its start values of potentials and currents (`n.psi_in`, `n.y_in`)."""
    half = psi.shape[0] // 2
    phi_n, phi_p, share, before, worst = 0.0, 0.0, 1.0, math.inf, math.inf
    chi = 2.0 * (1.0 - e.transference) * thermal
    restore_start_values(p, e, n, total, y, psi, reaction)
    for step in range(MOST_STEPS):
        currents_at_potentials(
            p, e, t, n, spread, thermal, t_k - e.reference_k, y, theta, psi, reaction, salt
        )
        set_excess(p, e, t, n, thermal, y, psi, reaction, salt)
        merit = residual_norm(e, t, n, chi, thermal, total, psi, reaction, salt)
        if step > 0 and not merit < before and share > SMALLEST_SHARE:
            share *= 0.5
            for r in range(psi.shape[0]):
                psi[r] -= share * n.d_psi[r]
                reaction[r] -= share * n.d_reaction[r]
            continue
        before, share = merit, 1.0
        phi_n, phi_p = newton_direction(p, t, n, spread, chi, total, psi, reaction, salt, half)
        worst = 0.0
        for r in range(psi.shape[0]):
            worst = max(worst, abs(n.d_psi[r]))
            psi[r] += n.d_psi[r]
            reaction[r] += n.d_reaction[r]
        if worst < UPDATE_TOLERANCE_V:
            break
    for u in range(y.shape[0]):
        y[u] += n.d_y[u]
        theta[u] = t.theta_base[u] - t.theta_per_y[u] * y[u]
    for r in range(psi.shape[0]):
        salt[r] += n.d_salt[r]
    return phi_n, phi_p, MOST_STEPS if worst < LOST_V else -MOST_STEPS


@compiled
def restore_start_values(p, e, n, total, y, psi, reaction):  # type: ignore[no-untyped-def]
    """Restore the start values n.y_in and n.psi_in, with a reaction whose sum over an electrode is its current."""
    half = psi.shape[0] // 2
    reaction[:] = 0.0
    for u in range(y.shape[0]):
        y[u] = n.y_in[u]
        reaction[p.place[u]] += y[u]
    off_n, off_p = total[0], total[1]
    for r in range(half):
        off_n -= reaction[r]
        off_p -= reaction[half + r]
    for r in range(psi.shape[0]):
        psi[r] = n.psi_in[r]
        reaction[r] += e.node_share[r] * (off_n if r < half else off_p)


@compiled
def currents_at_potentials(p, e, t, n, spread, thermal, rise, y, theta, psi, reaction, salt):  # type: ignore[no-untyped-def]
    """Currents y of all units at the potentials psi, their slopes, and the sums of these at each place."""
    places, half = psi.shape[0], psi.shape[0] // 2
    for r in range(places):
        n.shift[r], n.conductance[r] = 0.0, 0.0
        salt[r] = t.base_salt[r]
        for v in range(places):
            salt[r] += spread[r, v] * reaction[v]
    for u in range(y.shape[0]):
        r = p.place[u]
        side = 0 if r < half else 1
        exchange, film = t.rates[2 + side] * p.exchange[u], 1.0 / (t.rates[6 + side] * p.reactive[u])
        y[u], n.slope[u], n.by_salt[u] = current_at_potential(
            e, side, exchange, film, t.theta_base[u], t.theta_per_y[u],
            max(salt[r], SMALLEST_SALT), thermal, rise, psi[r], y[u],
        )  # fmt: skip
        if salt[r] <= SMALLEST_SALT:
            n.by_salt[u] = 0.0
        n.pot[u] = psi[r]
        theta[u] = t.theta_base[u] - t.theta_per_y[u] * y[u]
        n.conductance[r] += 1.0 / n.slope[u]
        n.shift[r] += n.by_salt[u] / n.slope[u]


@compiled
def current_at_potential(e, side, exchange, film, theta_base, theta_per_y, s, thermal, rise, psi, y):  # type: ignore[no-untyped-def]
    """Current of a unit at potential psi, its slope and by_salt: bracketed Newton's steps, in the logarithm of the
    current where kinetics limit it, in the current where filling does."""
    low, high, slope, by_salt = -math.inf, math.inf, 1.0, 0.0
    for _ in range(LOCAL_STEPS):
        pot, slope, by_salt, d_eta, scale = unit_potential(
            e, side, exchange, film, theta_base - theta_per_y * y, theta_per_y, y, s, thermal, rise
        )
        off = psi - pot
        if abs(off) < LOCAL_TOLERANCE_V:
            break
        if off > 0.0:
            low = y
        else:
            high = y
        if slope > 2.0 * d_eta:
            after = y + off / slope
        else:
            along = 0.5 * y / scale
            after = (
                2.0
                * scale
                * math.sinh(
                    math.asinh(along)
                    + min(max(off / (2.0 * scale * math.sqrt(1.0 + along * along) * slope), -20.0), 20.0)
                )
            )
        if not low < after < high:
            after = (
                2.0
                * scale
                * math.sinh(0.5 * (math.asinh(0.5 * low / scale) + math.asinh(0.5 * high / scale)))
            )
        if not low < after < high:
            break
        y = after
    return y, slope, by_salt


@compiled
def set_excess(p, e, t, n, thermal, y, psi, reaction, salt):  # type: ignore[no-untyped-def]
    """Set n.excess (places,) A/m2: current of units, double layers and plating at their potentials minus `reaction`."""
    for r in range(psi.shape[0]):
        n.excess[r] = 0.0
    for u in range(y.shape[0]):
        n.excess[p.place[u]] += y[u]
    if e.has_layers or e.plating[0] > 0.0:
        add_side_currents(e, t, n, thermal, psi, n.excess, salt)
    for r in range(psi.shape[0]):
        n.excess[r] -= reaction[r]


@compiled
def residual_norm(e, t, n, chi, thermal, total, psi, reaction, salt):  # type: ignore[no-untyped-def]
    """Residual norm: the largest of the errors of potentials over R T / F and of the excess currents over (share of the
    current + exchange current) of their place."""
    half = psi.shape[0] // 2
    worst = 0.0
    for side in range(2):
        lowest, highest = math.inf, -math.inf
        for r in range(side * half, (side + 1) * half):
            phi = psi[r] + chi * salt_logarithm(salt[r])[0]
            for v in range(half):
                phi += t.ohm[r, v] * reaction[side * half + v]
            lowest, highest = min(lowest, phi), max(highest, phi)
            held = e.node_share[r] * abs(total[side]) + t.rates[2 + side] * e.exchange[r]
            worst = max(worst, abs(n.excess[r]) / held)
        worst = max(worst, 0.5 * (highest - lowest) / thermal)
    return worst
