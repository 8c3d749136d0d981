"""What a composite negative electrode's silicon has lost by the time of a record.

Silicon gives up its lithium after the graphite, above `SILICON_V`, and loses capacity first. A cell that lost some of
it keeps every feature of its graphite at the same charge from full and is empty sooner: the end of the negative
potential draws together towards the stoichiometry x_s at which silicon begins,

    U_then(x) = U(x_s - (x_s - x)/share)        x < x_s                                                       (1)

Seen on the C/20 discharges of an LG 18650HG2 at 25, 40 and 0 degC, the cycler's zero taken out: 2.87, 2.77 and 2.68 Ah
to 2.8 V, with the peaks of dV/dQ at the same 1.1 and 2.1 Ah and the same edge at 2.35 Ah; what follows the edge takes
0.52, 0.42 and 0.33 Ah. Active material lost evenly would have moved the edge by 0.15 Ah.
Leaves out the silicon's own hysteresis and rate.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.calibration.shapes import GRID
from aesi.numerics.typing import Array
from aesi.physics.cell import Electrode
from aesi.physics.cell.relations import LookupTable

SILICON_V = 0.22
"""V against Li/Li+, below which graphite has its plateaus. A convention: the foot of the edge above."""
SILICON_SD = 0.3
"""Standard deviation of the logarithm of the share that is left. A convention, of the size of the shares seen above,
0.81 and 0.63."""


def silicon_edge(electrode: Electrode) -> float:
    """Stoichiometry below which the electrode gives up its lithium above `SILICON_V`."""
    x = np.linspace(1e-6, 1.0 - 1e-6, GRID)
    return float(x[int(np.argmax(electrode.ocp(x) < SILICON_V))])


def stretched(x: Array, edge: float, share: float) -> Array:
    """(n,) stoichiometries of the electrode as new that have the potential of x (n,) now, (1); may be below nought."""
    return np.where(x < edge, edge - (edge - x) / share, x)


def with_silicon(electrode: Electrode, edge: float, share: float) -> Electrode:
    """The electrode with a share of its silicon's capacity, (1)."""
    if share == 1.0:
        return electrode
    x = np.linspace(0.0, 1.0, GRID)
    as_new = stretched(x, edge, share)
    volts = electrode.ocp(np.clip(as_new, 0.0, 1.0))
    steepest = (
        float((electrode.ocp(x[:1]) - electrode.ocp(x[1:2]))[0]) / x[1]
    )  # goes on beyond the empty electrode
    volts = volts + steepest * np.maximum(-as_new, 0.0)
    return replace(electrode, ocp=LookupTable(tuple(map(float, x)), tuple(map(float, volts))))
