"""Compiled relations of an interface: overpotential of a reaction, and a double layer over a step."""

import math

from numba import njit

from aesi.physics.espm.kernels import FASTMATH, compiled, mean_asinh

SMALLEST_EXPONENT, LARGEST_EXPONENT = -60.0, 60.0
"""Of what would leave the range of a number."""


@njit(inline="always", fastmath=FASTMATH)
def bounded_exp(x):  # type: ignore[no-untyped-def]
    """exp with its argument kept from overflow."""
    return math.exp(min(max(x, SMALLEST_EXPONENT), LARGEST_EXPONENT))


@compiled
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
def stripped(strength, alpha, before, filled, salt, potential, thermal):  # type: ignore[no-untyped-def]
    """Current of a metal that strips (plates where negative) at the end of a step, its slope in the potential, and the
    metal there: before - filled current, which stays positive whatever the step.

    strength : current per metal and per salt.  before : metal, without what the current at the end does.  filled :
    metal per current.
    """
    up = strength * bounded_exp((1.0 - alpha) * potential / thermal)
    down = strength * salt * bounded_exp(-alpha * potential / thermal)
    metal = (before + filled * down) / (1.0 + filled * up)
    slope = ((1.0 - alpha) * up * metal + alpha * down) / (thermal * (1.0 + filled * up))
    return up * metal - down, slope, metal


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
