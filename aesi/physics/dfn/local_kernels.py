"""Compiled relations at one place of a porous electrode: kinetics, potential, salt."""

import math

from numba import njit

from aesi.physics.espm.electrode_kernels import overpotential
from aesi.physics.espm.kernels import BEYOND_RANGE_V, FASTMATH, SMALLEST_OCCUPANCY, lookup

SMALLEST_SALT = 1e-4
"""Of the rest concentration: below it the logarithm goes on as its tangent."""


@njit(inline="always", fastmath=FASTMATH)
def kinetic_drop(y, exchange, alpha, thermal):  # type: ignore[no-untyped-def]
    """Overpotential (V) of a current y at an exchange current, both per cell area, and its slope in y."""
    if alpha == 0.5:
        x = 0.5 * y / exchange
        root = math.sqrt(1.0 + x * x)
        return 2.0 * thermal * math.copysign(math.log(abs(x) + root), x), thermal / (exchange * root)
    return overpotential(y, exchange, 1.0, 1.0, 1.0, 1.0, 0.0, alpha, thermal)


@njit(inline="always", fastmath=FASTMATH)
def equilibrium(ocp, entropic, rise, theta):  # type: ignore[no-untyped-def]
    """Open-circuit potential (V) at a surface stoichiometry and its slope, falling on outside [0, 1]."""
    inside = min(max(theta, 0.0), 1.0)
    last = ocp.shape[0] - 1
    s = inside * last
    cell = min(int(s), last - 1)
    step = ocp[cell + 1] - ocp[cell]
    value = ocp[cell] + (s - cell) * step - BEYOND_RANGE_V * (theta - inside)
    if rise != 0.0:
        value += rise * lookup(entropic, inside)
    return value, step * last if theta == inside else -BEYOND_RANGE_V


@njit(inline="always", fastmath=FASTMATH)
def occupancy(theta):  # type: ignore[no-untyped-def]
    """x (1 - x), kept off zero, and the slope of its logarithm."""
    product = theta * (1.0 - theta)
    if product < SMALLEST_OCCUPANCY:
        return SMALLEST_OCCUPANCY, 0.0
    return product, (1.0 - 2.0 * theta) / product


@njit(inline="always", fastmath=FASTMATH)
def salt_logarithm(s):  # type: ignore[no-untyped-def]
    """Logarithm of the salt over its rest concentration and its slope; a straight line near zero."""
    if s < SMALLEST_SALT:
        return math.log(SMALLEST_SALT) + s / SMALLEST_SALT - 1.0, 1.0 / SMALLEST_SALT
    return math.log(s), 1.0 / s
