"""Compiled relations at one place of a porous electrode: kinetics, potential, salt."""

import math

from numba import njit

from aesi.physics.espm.interface_kernels import asymmetric, asymmetric_start
from aesi.physics.espm.kernels import BEYOND_RANGE_V, FASTMATH, SMALLEST_OCCUPANCY

SMALLEST_SLOPE = 1e-3
"""Lower limit of a unit's slope, as a share of the kinetic slope: near the edge of a potential, filling reduces the
slope until the place runs away."""
SMALLEST_SALT = 1e-4
"""Share of the rest concentration below which the logarithm is continued by its tangent."""


@njit(inline="always", fastmath=FASTMATH)
def kinetic_drop(y, exchange, alpha, thermal):  # type: ignore[no-untyped-def]
    """Overpotential (V) of a current y at an exchange current, both per cell area, and its slope in y."""
    if alpha == 0.5:
        x = 0.5 * y / exchange
        root = math.sqrt(1.0 + x * x)
        return 2.0 * thermal * math.copysign(math.log(abs(x) + root), x), thermal / (exchange * root)
    x = y / exchange
    eta, slope = asymmetric(x, alpha, asymmetric_start(x, alpha))
    return thermal * eta, thermal * slope / exchange


@njit(inline="always", fastmath=FASTMATH)
def row_lookup(tables, row, position):  # type: ignore[no-untyped-def]
    """As `kernels.lookup`, for one row of tables; a view of the row would cost more than the value."""
    last = tables.shape[1] - 1
    s = min(max(position, 0.0), 1.0) * last
    i = min(int(s), last - 1)
    return tables[row, i] + (s - i) * (tables[row, i + 1] - tables[row, i])


@njit(inline="always", fastmath=FASTMATH)
def equilibrium(ocp, entropic, side, rise, theta):  # type: ignore[no-untyped-def]
    """Open-circuit potential (V) at a surface stoichiometry and its slope; it continues to fall outside [0, 1]."""
    inside = min(max(theta, 0.0), 1.0)
    last = ocp.shape[1] - 1
    s = inside * last
    cell = min(int(s), last - 1)
    step = ocp[side, cell + 1] - ocp[side, cell]
    value = ocp[side, cell] + (s - cell) * step - BEYOND_RANGE_V * (theta - inside)
    if rise != 0.0:
        value += rise * row_lookup(entropic, side, inside)
    return value, step * last if theta == inside else -BEYOND_RANGE_V


@njit(inline="always", fastmath=FASTMATH)
def occupancy(theta):  # type: ignore[no-untyped-def]
    """x (1 - x) with a positive lower limit, and the slope of its logarithm."""
    product = theta * (1.0 - theta)
    if product < SMALLEST_OCCUPANCY:
        return SMALLEST_OCCUPANCY, 0.0
    return product, (1.0 - 2.0 * theta) / product


@njit(inline="always", fastmath=FASTMATH)
def value_and_slope(table, side, theta):  # type: ignore[no-untyped-def]
    """(value, slope) of an electrode's table over stoichiometry at a surface stoichiometry."""
    last = table.shape[1] - 1
    s = min(max(theta, 0.0), 1.0) * last
    i = min(int(s), last - 1)
    step = table[side, i + 1] - table[side, i]
    return table[side, i] + (s - i) * step, step * last


@njit(inline="always", fastmath=FASTMATH)
def salt_logarithm(s):  # type: ignore[no-untyped-def]
    """Logarithm of the salt over its rest concentration and its slope; a straight line near zero."""
    if s < SMALLEST_SALT:
        return math.log(SMALLEST_SALT) + s / SMALLEST_SALT - 1.0, 1.0 / SMALLEST_SALT
    return math.log(s), 1.0 / s


@njit(inline="always", fastmath=FASTMATH)
def unit_potential(e, side, exchange, film, surface, theta_per_y, y, s, thermal, rise):  # type: ignore[no-untyped-def]
    """Potential of a unit at a current y, its slopes in y and in the salt s, the kinetic part of the slope, and the
    exchange current.  film : factor on the film's ohm m2: that of temperature over reactive surface."""
    room, d_room = occupancy(surface)
    quicker, d_quicker = value_and_slope(e.rate, side, surface)
    scale = exchange * quicker * math.sqrt(s * room)
    eta, d_eta = kinetic_drop(y, scale, e.alpha[side], thermal)
    level, falls = equilibrium(e.ocp, e.entropic, side, rise, surface)
    ohm, d_ohm = value_and_slope(e.film, side, surface)
    moved = -0.5 * y * d_eta  # slope in the logarithm of salt or occupancy, by the exchange current
    resistance = film * ohm
    slope = d_eta + resistance
    slope = max(
        slope - theta_per_y * (falls + moved * (d_room + 2.0 * d_quicker / quicker) + film * d_ohm * y),
        SMALLEST_SLOPE * slope,
    )
    return level + eta + resistance * y, slope, moved / s, d_eta, scale
