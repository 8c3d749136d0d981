"""Compiled solution of a step for which Newton's method on currents fails: particles nearly full or empty, or
potentials that rise with lithium.

There the kinetic drop is a logarithm of the remaining room, and a small step in current passes the end of it. So the
currents are eliminated place by place: each is found for a given potential by bracketing. Newton's method runs on the
potentials, with steps halved until they reduce the residual.
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
def solve_guarded(p, e, t, n, spread, total, t_k, thermal, y, theta, psi, given, salt):  # type: ignore[no-untyped-def]
    """As `solve_reaction`, from its start values of potentials and currents (`n.psi_in`, `n.y_in`)."""
    half = psi.shape[0] // 2
    phi_n, phi_p, share, before, worst = 0.0, 0.0, 1.0, math.inf, math.inf
    chi = 2.0 * (1.0 - e.transference) * thermal
    begin(p, e, n, total, y, psi, given)
    for step in range(MOST_STEPS):
        local_currents(p, e, t, n, spread, thermal, t_k - e.reference_k, y, theta, psi, given, salt)
        excess(p, e, t, n, thermal, y, psi, given, salt)
        merit = apart(e, t, n, chi, thermal, total, psi, given, salt)
        if step > 0 and not merit < before and share > SMALLEST_SHARE:
            share *= 0.5
            for r in range(psi.shape[0]):
                psi[r] -= share * n.d_psi[r]
                given[r] -= share * n.d_given[r]
            continue
        before, share = merit, 1.0
        phi_n, phi_p = newton_direction(p, t, n, spread, chi, total, psi, given, salt, half)
        worst = 0.0
        for r in range(psi.shape[0]):
            worst = max(worst, abs(n.d_psi[r]))
            psi[r] += n.d_psi[r]
            given[r] += n.d_given[r]
        if worst < UPDATE_TOLERANCE_V:
            break
    for u in range(y.shape[0]):
        y[u] += n.d_y[u]
        theta[u] = t.reach[u] - t.give[u] * y[u]
    for r in range(psi.shape[0]):
        salt[r] += n.d_salt[r]
    return phi_n, phi_p, MOST_STEPS if worst < LOST_V else -MOST_STEPS


@compiled
def begin(p, e, n, total, y, psi, given):  # type: ignore[no-untyped-def]
    """Restore the start values, with a reaction whose sum is the current of each electrode."""
    half = psi.shape[0] // 2
    given[:] = 0.0
    for u in range(y.shape[0]):
        y[u] = n.y_in[u]
        given[p.place[u]] += y[u]
    off_n, off_p = total[0], total[1]
    for r in range(half):
        off_n -= given[r]
        off_p -= given[half + r]
    for r in range(psi.shape[0]):
        psi[r] = n.psi_in[r]
        given[r] += e.node_share[r] * (off_n if r < half else off_p)


@compiled
def local_currents(p, e, t, n, spread, thermal, rise, y, theta, psi, given, salt):  # type: ignore[no-untyped-def]
    """Currents y of all units at the potentials psi, their slopes, and the sums of these at each place."""
    places, half = psi.shape[0], psi.shape[0] // 2
    for r in range(places):
        n.shift[r], n.conductance[r] = 0.0, 0.0
        salt[r] = t.calm_salt[r]
        for v in range(places):
            salt[r] += spread[r, v] * given[v]
    for u in range(y.shape[0]):
        r = p.place[u]
        side = 0 if r < half else 1
        exchange, film = t.rates[2 + side] * p.exchange[u], 1.0 / (t.rates[6 + side] * p.reactive[u])
        y[u], n.slope[u], n.by_salt[u] = local_current(
            e, side, exchange, film, t.reach[u], t.give[u], max(salt[r], SMALLEST_SALT), thermal, rise, psi[r], y[u]
        )  # fmt: skip
        if salt[r] <= SMALLEST_SALT:
            n.by_salt[u] = 0.0
        n.pot[u] = psi[r]
        theta[u] = t.reach[u] - t.give[u] * y[u]
        n.conductance[r] += 1.0 / n.slope[u]
        n.shift[r] += n.by_salt[u] / n.slope[u]


@compiled
def local_current(e, side, exchange, film, reach, give, s, thermal, rise, psi, y):  # type: ignore[no-untyped-def]
    """Current of a unit at potential psi, its slope and by_salt: bracketed Newton's steps, in the logarithm of the
    current where kinetics limit it, in the current where filling does."""
    low, high, slope, by_salt = -math.inf, math.inf, 1.0, 0.0
    for _ in range(LOCAL_STEPS):
        pot, slope, by_salt, d_eta, scale = unit_potential(
            e, side, exchange, film, reach - give * y, give, y, s, thermal, rise
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
def excess(p, e, t, n, thermal, y, psi, given, salt):  # type: ignore[no-untyped-def]
    """n.slack (places,) A/m2: current of units, double layers and plating at their potentials minus `given`."""
    for r in range(psi.shape[0]):
        n.slack[r] = 0.0
    for u in range(y.shape[0]):
        n.slack[p.place[u]] += y[u]
    if e.has_layers or e.plating[0] > 0.0:
        add_side_currents(e, t, n, thermal, psi, n.slack, salt)
    for r in range(psi.shape[0]):
        n.slack[r] -= given[r]


@compiled
def apart(e, t, n, chi, thermal, total, psi, given, salt):  # type: ignore[no-untyped-def]
    """Residual norm: the largest of the errors of potentials over R T / F and of the excess currents over (share of the
    current + exchange current) of their place."""
    half = psi.shape[0] // 2
    worst = 0.0
    for side in range(2):
        lowest, highest = math.inf, -math.inf
        for r in range(side * half, (side + 1) * half):
            phi = psi[r] + chi * salt_logarithm(salt[r])[0]
            for v in range(half):
                phi += t.ohm[r, v] * given[side * half + v]
            lowest, highest = min(lowest, phi), max(highest, phi)
            held = e.node_share[r] * abs(total[side]) + t.rates[2 + side] * e.exchange[r]
            worst = max(worst, abs(n.slack[r]) / held)
        worst = max(worst, 0.5 * (highest - lowest) / thermal)
    return worst
