"""Compiled relations that all models share: tables, potentials, kinetics, weights of an exact step."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from aesi.numerics.compiled import kept_njit
from aesi.physics.espm.layout import CACHE_SLOTS

FASTMATH = {"reassoc", "contract", "arcp", "nsz"}
compiled: Callable[[Any], Any] = kept_njit(
    nogil=True, fastmath=FASTMATH, error_model="numpy", _nrt=False, forceinline=True
)
"""Options of every function that numba does not inline itself. numba counts references to each array that it takes out
of a named tuple, one atomic instruction per use. Without counting (nothing here allocates) a sample of the porous
electrode takes 2.5 us instead of 8.4. A division by zero gives infinity, as in numpy: beyond the end of a cell a trial
may underflow, and the fault before it has to be reported.

LLVM inlines each function into its caller. Calls would be to weak symbols, of which a process uses the first loaded:
that of the caller, of the function itself where this process compiled it, or of another kernel that uses it. These sum
in different orders, so that a discovery differed in the last digits between the process that compiled and later ones,
and in flat directions in its simulations. Inlining also saves 26 to 43 % of the time of a sample."""
NANOSECONDS = 1e9
BEYOND_RANGE_V = 10.0
"""Slope (V per unit of stoichiometry) at which open-circuit potentials continue to fall outside [0, 1]."""
SMALLEST_OCCUPANCY = 1e-9
NEARLY_DRY = 0.1
"""Share of the salt at rest below which the reaction moves to places with more salt, which a single particle does not
model. There the salt of a porous electrode tends to zero, and that of a uniform reaction becomes negative (an LG
18650HG2 under US06 at 10 degC: 56 mol/m3 against -104 at the wall)."""
SMALLEST_EXPONENT = -10.0
"""Lower limit of the exponent of the remaining salt, so that products of its powers do not underflow."""
ROUND_OFF = 1e-9
"""Share of a part of a step below which the remainder of a step is not a further part: stamps are rounded."""
LEFT_PART = 0.125
"""Share of a part of a step up to which the remainder is divided among the other parts. Rows of 1 s are usual, and
clocks that are slow by up to a tenth are searched for. If rows of 1.0000001 s were taken in two steps, a clock slow by
1e-7 would move the voltage of an LG M50 by up to 0.08 mV and that of an LG 18650HG2 by 0.20."""
LARGEST_RATIO = 1e12
"""Upper limit of a ratio, above which the product of ten factors would overflow."""


@njit(inline="always", fastmath=FASTMATH)
def lookup(table, position):  # type: ignore[no-untyped-def]
    """Linear interpolation on a uniform grid over [0, 1]; constant beyond."""
    last = table.shape[0] - 1
    s = min(max(position, 0.0), 1.0) * last
    i = min(int(s), last - 1)
    return table[i] + (s - i) * (table[i + 1] - table[i])


@njit(inline="always", fastmath=FASTMATH)
def parts_of(step, longest, most, finer):  # type: ignore[no-untyped-def]
    """Number of equal parts of a step, at most `most`; each is about as long as min(step, longest) / finer."""
    return min(max(1, math.ceil(finer * max(1.0, step / longest) - LEFT_PART)), most)


@njit(inline="always", fastmath=FASTMATH)
def share_ahead(step, last):  # type: ignore[no-untyped-def]
    """Share, at most 1, of the last step's change of the explicit part by which that part is extrapolated over a step.

    step, last : lengths of this and the last step, s; last is 0 for none. Without the limit, a long step after a short
    one would extrapolate the beginning of a jump's transient. With it, no sequence of long and short steps is unstable
    where equal ones are stable: growth is at most 0.96 per step in 20,000 cycles of 2 to 5 lengths with ratios up to
    400, with an explicit rest of 0.316 of the exactly stepped diffusivity (`EXTRAPOLATED_MARGIN`). With a limit of 2 it
    is at most 1.18, without a limit hundreds.
    """
    return min(step / last, 1.0) if last > 0.0 else 0.0


@njit(inline="always", fastmath=FASTMATH)
def open_circuit(table, theta):  # type: ignore[no-untyped-def]
    """Potential (V) at `theta`; outside [0, 1] it continues to fall at a constant slope."""
    inside = min(max(theta, 0.0), 1.0)
    return lookup(table, inside) - BEYOND_RANGE_V * (theta - inside)


@njit(inline="always", fastmath=FASTMATH)
def positive_salt(salt):  # type: ignore[no-untyped-def]
    """Salt concentration over rest, kept positive: unchanged down to `NEARLY_DRY`, then decaying to zero with the same
    slope there."""
    return (
        salt if salt >= NEARLY_DRY else NEARLY_DRY * math.exp(max(salt / NEARLY_DRY, SMALLEST_EXPONENT) - 1.0)
    )


@njit(inline="always", fastmath=FASTMATH)
def salt_at_separator(c, c0):  # type: ignore[no-untyped-def]
    """Salt over rest at the edge of the separator, the lower one of the two electrodes.

    c : nodes of three equal layers that share their ends, mol/m3.
    """
    layer = (c.shape[0] - 1) // 3
    return min(c[layer], c[2 * layer]) / c0


@njit(inline="always", fastmath=FASTMATH)
def out_of_range(theta_n, theta_p, driest):  # type: ignore[no-untyped-def]
    """The state that left its range: 1 negative surface, 2 positive surface, 3 electrolyte, 0 none."""
    if not 0.0 <= theta_n <= 1.0:
        return 1
    if not 0.0 <= theta_p <= 1.0:
        return 2
    if not driest > 0.0:
        return 3
    return 0


@njit(inline="always", fastmath=FASTMATH)
def step_weights(rate, dt):  # type: ignore[no-untyped-def]
    """exp(-rate dt), and the integrals over the step that weigh the input at its start and at its end."""
    z = rate * dt
    if z < 1e-4:
        decay = 1.0 - z * (1.0 - 0.5 * z)
        whole = dt * (1.0 - 0.5 * z)
        end = dt * (0.5 - z / 6.0)
    else:
        decay = math.exp(-z)
        whole = -math.expm1(-z) / rate
        end = (1.0 - whole / dt) / rate
    return decay, whole - end, end


@njit(inline="always", fastmath=FASTMATH)
def slot_of(dt, keys):  # type: ignore[no-untyped-def]
    """(slot of the weights of a step of dt s, True where they have to be computed).

    keys : (slots,) nanoseconds of the steps whose weights are kept; that of this step is entered.
    """
    key = np.int64(dt * NANOSECONDS + 0.5)
    slot = key % CACHE_SLOTS
    missing = keys[slot] != key
    keys[slot] = key
    return slot, missing


@njit(inline="always", fastmath=FASTMATH)
def mean_asinh(s, c1, c2, c3):  # type: ignore[no-untyped-def]
    """Average over an electrode of asinh(s / sqrt(c)) from three Gauss points, c relative to rest, s >= 0."""
    y1, y2, y3 = s / math.sqrt(c1), s / math.sqrt(c2), s / math.sqrt(c3)
    t1 = y1 + math.sqrt(y1 * y1 + 1.0)
    t2 = y2 + math.sqrt(y2 * y2 + 1.0)
    t3 = y3 + math.sqrt(y3 * y3 + 1.0)
    if s > LARGEST_RATIO:
        return (5.0 * (math.log(t1) + math.log(t3)) + 8.0 * math.log(t2)) / 18.0
    outer, inner = t1 * t3, t2 * t2  # weights 5/18, 8/18, 5/18, and one logarithm for all three
    return math.log(outer * outer * outer * outer * outer * inner * inner * inner * inner) / 18.0


@njit(inline="always", fastmath=FASTMATH)
def kinetic_ratio(density, exchange, theta):  # type: ignore[no-untyped-def]
    """|j| / (2 F K sqrt(x (1 - x))), with a positive lower limit of x (1 - x)."""
    occupancy = max(theta * (1.0 - theta), SMALLEST_OCCUPANCY)
    return abs(density) / (2.0 * exchange * math.sqrt(occupancy))
