"""Functions of one scaled variable: Chebyshev polynomials, trigonometric and hyperbolic functions.

    T_1(x) = x,   T_2(x) = 2 x**2 - 1,   T_{n+1}(x) = 2 x T_n(x) - T_{n-1}(x)

They are numbered so that compiled loops can name them: 0 is the constant one, 1 to 5 are T_1 to T_5, and
6 to 11 are sin, cos, tan, sinh, cosh and tanh.
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array, IntArray

MAX_ORDER = 5
"""Highest order of the Chebyshev polynomials; the functions after them are special ones."""
FUNCTIONS = ("1", "T1", "T2", "T3", "T4", "T5", "sin", "cos", "tan", "sinh", "cosh", "tanh")
SPECIAL = range(MAX_ORDER + 1, len(FUNCTIONS))
"""The numbers of the functions that are not polynomials."""


@kept_njit(inline="always")
def value(function: int, x: float) -> float:
    """One function at one point."""
    if function == 0:
        return 1.0
    if function == 1:
        return x
    if function == 2:
        return 2.0 * x * x - 1.0
    if function == 3:
        return x * (4.0 * x * x - 3.0)
    if function == 4:
        return 8.0 * x * x * (x * x - 1.0) + 1.0
    if function == 5:
        return x * (16.0 * x * x * x * x - 20.0 * x * x + 5.0)
    if function == 6:
        return np.sin(x)
    if function == 7:
        return np.cos(x)
    if function == 8:
        return np.tan(x)
    if function == 9:
        return np.sinh(x)
    if function == 10:
        return np.cosh(x)
    return np.tanh(x)


@kept_njit(inline="always")
def slope(function: int, x: float) -> float:
    """Derivative of one function at one point."""
    if function == 0:
        return 0.0
    if function == 1:
        return 1.0
    if function == 2:
        return 4.0 * x
    if function == 3:
        return 12.0 * x * x - 3.0
    if function == 4:
        return 32.0 * x * x * x - 16.0 * x
    if function == 5:
        return 80.0 * x * x * x * x - 60.0 * x * x + 5.0
    if function == 6:
        return np.cos(x)
    if function == 7:
        return -np.sin(x)
    if function == 8:
        return 1.0 / np.cos(x) ** 2
    if function == 9:
        return np.cosh(x)
    if function == 10:
        return np.sinh(x)
    return 1.0 / np.cosh(x) ** 2


@kept_njit()
def values(function: int, x: Array) -> Array:
    """One function along a series, (n,)."""
    out = np.empty(len(x))
    for k in range(len(x)):
        out[k] = value(function, x[k])
    return out


@kept_njit()
def slopes(function: int, x: Array) -> Array:
    """Derivative of one function along a series, (n,)."""
    out = np.empty(len(x))
    for k in range(len(x)):
        out[k] = slope(function, x[k])
    return out


@kept_njit()
def clipped_values(functions: IntArray, x: Array, out: Array) -> None:
    """Functions of many points within [-1, 1], (12, n) rows filled where named: loops that vectorise.

    sin and sinh, and cos and cosh, share the terms of their power series, which end below 1e-17 at |x| = 1.
    """
    special = False
    for q in functions:
        if q > MAX_ORDER:
            special = True
        elif q == 0:
            out[0, :] = 1.0
        else:
            for j in range(len(x)):
                out[q, j] = value(q, x[j])
    if not special:
        return
    sin, cos, tan, sinh, cosh, tanh = out[6], out[7], out[8], out[9], out[10], out[11]
    for j in range(len(x)):
        z = x[j] * x[j]
        w = z * z
        odd_a = 1.0 + w * (1 / 120 + w * (1 / 362880 + w * (1 / 6227020800 + w / 355687428096000)))
        odd_b = z * (1 / 6 + w * (1 / 5040 + w * (1 / 39916800 + w / 1307674368000)))
        even_a = 1.0 + w * (1 / 24 + w * (1 / 40320 + w * (1 / 479001600 + w / 20922789888000)))
        even_b = z * (
            1 / 2 + w * (1 / 720 + w * (1 / 3628800 + w * (1 / 87178291200 + w / 6402373705728000)))
        )
        sin[j] = x[j] * (odd_a - odd_b)
        sinh[j] = x[j] * (odd_a + odd_b)
        cos[j] = even_a - even_b
        cosh[j] = even_a + even_b
        tan[j] = sin[j] / cos[j]
        tanh[j] = sinh[j] / cosh[j]
