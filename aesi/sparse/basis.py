"""Functions of one scaled variable: Chebyshev polynomials, trigonometric and hyperbolic functions.

    T_1(x) = x,   T_2(x) = 2 x**2 - 1,   T_{n+1}(x) = 2 x T_n(x) - T_{n-1}(x)

They are numbered so that compiled loops can name them: 0 is the constant one, 1 to 5 are T_1 to T_5, and
6 to 11 are sin, cos, tan, sinh, cosh and tanh.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from aesi.numerics.typing import Array

MAX_ORDER = 5
FUNCTIONS = ("1", "T1", "T2", "T3", "T4", "T5", "sin", "cos", "tan", "sinh", "cosh", "tanh")
SPECIAL = range(MAX_ORDER + 1, len(FUNCTIONS))
"""The numbers of the functions that are not polynomials."""


@njit(cache=True, inline="always")
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


@njit(cache=True, inline="always")
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


@njit(cache=True)
def values(function: int, x: Array) -> Array:
    """One function along a series, (n,)."""
    out = np.empty(len(x))
    for k in range(len(x)):
        out[k] = value(function, x[k])
    return out


@njit(cache=True)
def slopes(function: int, x: Array) -> Array:
    """Derivative of one function along a series, (n,)."""
    out = np.empty(len(x))
    for k in range(len(x)):
        out[k] = slope(function, x[k])
    return out
