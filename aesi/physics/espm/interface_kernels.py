"""Compiled relations of an interface: overpotential of a reaction, and a double layer over a step."""

import math

from numba import njit

from aesi.physics.espm.kernels import FASTMATH, compiled, mean_asinh

SMALLEST_EXPONENT, LARGEST_EXPONENT = -60.0, 60.0
"""Limits of exponents, against overflow and underflow."""
MOST_STEPS = 30
LARGEST_CHANGE = 4.0
SMALLEST_CHANGE = 1e-4
"""Change of an overpotential over R T / F below which the iteration stops. The error after a step is at most a twelfth
of the cube of its change: round-off, below this limit."""


@njit(inline="always", fastmath=FASTMATH)
def bounded_exp(x):  # type: ignore[no-untyped-def]
    """exp with its argument limited against overflow."""
    return math.exp(min(max(x, SMALLEST_EXPONENT), LARGEST_EXPONENT))


@njit(inline="always", fastmath=FASTMATH)
def asymmetric_start(x, alpha):  # type: ignore[no-untyped-def]
    """Start value of `asymmetric` for x: exact for alpha of one half, and for a large current."""
    half = 0.5 * abs(x)
    eta = 2.0 * math.copysign(math.log(half + math.sqrt(1.0 + half * half)), x)
    if half > 1.0:
        eta *= 0.5 / (alpha if x > 0.0 else 1.0 - alpha)
    return eta


@compiled
def asymmetric(x, alpha, eta):  # type: ignore[no-untyped-def]
    """Overpotential over R T / F of a current x over its exchange current, and its slope in x, for
    x = exp(alpha eta) - exp(-(1 - alpha) eta).  eta : start value.
    """
    gradient = 1.0
    for _ in range(MOST_STEPS):
        forward = alpha * bounded_exp(alpha * eta)
        back = (1.0 - alpha) * bounded_exp(-(1.0 - alpha) * eta)
        gradient = forward + back
        bend = alpha * forward - (1.0 - alpha) * back
        change = (forward / alpha - back / (1.0 - alpha) - x) / gradient
        change /= 1.0 - min(0.5 * change * bend / gradient, 0.5)
        change = min(max(change, -LARGEST_CHANGE), LARGEST_CHANGE)
        eta -= change
        if abs(change) < SMALLEST_CHANGE:
            gradient -= change * bend
            break
    return eta, 1.0 / gradient


@compiled
def overpotential(y, exchange, occupancy, g1, g2, g3, log_salt, alpha, thermal):  # type: ignore[no-untyped-def]
    """Overpotential (V) of a current y and its slope, for j = j0 (exp(alpha f eta) - exp(-(1 - alpha) f eta)).

    exchange : at unit salt and occupancy.  g1..g3 : salt at Gauss points.  log_salt : its mean logarithm.
    """
    alone = exchange * math.sqrt(occupancy)
    if alpha == 0.5:
        mid = 2.0 * alone * math.exp(0.5 * log_salt)
        x = y / mid
        slope = 2.0 * thermal / (mid * math.sqrt(1.0 + x * x))
        s = abs(y) / (2.0 * alone)
        return 2.0 * thermal * math.copysign(mean_asinh(s, g1, g2, g3), y), slope
    here1, here2, here3 = alone * math.sqrt(g1), alone * math.sqrt(g2), alone * math.sqrt(g3)
    x1, x2, x3 = y / here1, y / here2, y / here3
    eta2, slope2 = asymmetric(x2, alpha, asymmetric_start(x2, alpha))
    eta1, slope1 = asymmetric(x1, alpha, eta2 + slope2 * (x1 - x2))
    eta3, slope3 = asymmetric(x3, alpha, eta2 + slope2 * (x3 - x2))
    eta = (5.0 * (eta1 + eta3) + 8.0 * eta2) / 18.0
    slope = (5.0 * (slope1 / here1 + slope3 / here3) + 8.0 * slope2 / here2) / 18.0
    return thermal * eta, thermal * slope


@njit(inline="always", fastmath=FASTMATH)
def stripped(strength, alpha, before, filled, salt, potential, thermal):  # type: ignore[no-untyped-def]
    """(current of stripping (plating where negative) at the end of a step, its slope in the potential, metal there).

    The metal is before - filled current, which is positive for every step.  strength : current per metal and per salt.
    before : metal at the end for zero current there.  filled : metal per current.
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
    """Current at the end of a step of z time constants over its mean, for the exponential decay after a jump."""
    return z / math.expm1(min(z, LARGEST_EXPONENT)) if z > 1e-6 else 1.0 - 0.5 * z
