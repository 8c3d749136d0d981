"""Loss of silicon in a composite negative electrode up to the time of a record.

Silicon is delithiated after the graphite, above `SILICON_V`, and loses capacity first. In a cell that lost silicon
every feature of the graphite stays at the same charge from full, and empty comes earlier: the end of the negative
potential is compressed towards the stoichiometry x_s at which silicon begins,

    U_then(x) = U(x_s - (x_s - x)/share)        x < x_s                                                       (1)

A negative electrode whose potential in the file is that of graphite has no silicon (`may_have_silicon`). The others may
or may not have it: (1) only changes the capacity of the electrode above `SILICON_V`.

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
HELD_V, HELD_SHARE = 0.4, 0.06
"""An electrode that gives up more than HELD_SHARE of its window above HELD_V, V against Li/Li+, holds more there than
graphite does, and may have silicon. Of the parameter sets of PyBaMM and the shipped files graphite gives up 0 to 4.2 %
there (Kim, Marquis, Ramadass 0, Mohtat 1.9, Panasonic NCR18650PF 2.2 and 2.5, Ai 3.0, the 30 Ah NMC 3.4, Ecker 4.2),
graphite with SiOx 7.5 to 12.8 % (LG M50 of O'Regan 7.5, of O'Kane 8.2, of Chen 8.6, LG 18650HG2 9.2 to 12.8; Prada's
LFP cell, which has the potential of an LG M50, 10.7). From 0.3 or 0.5 V on they are less far apart: up to 6.4 and from
10.6 %, up to 2.8 and from 4.6 %."""
SILICON_SD = 0.3
"""Standard deviation of the logarithm of the share that is left. A convention, of the size of the shares seen above,
0.81 and 0.63."""


def silicon_edge(electrode: Electrode) -> float:
    """x_s of (1): stoichiometry below which the potential of the electrode is above `SILICON_V`."""
    x = np.linspace(1e-6, 1.0 - 1e-6, GRID)
    return float(x[int(np.argmax(electrode.ocp(x) < SILICON_V))])


def may_have_silicon(electrode: Electrode) -> bool:
    """Whether the electrode's own potential is of one that may have silicon, see `HELD_V`."""
    window = np.linspace(electrode.theta_min, electrode.theta_max, GRID)
    return bool(np.mean(electrode.ocp(window) > HELD_V) > HELD_SHARE)


def stretched(x: Array, edge: float, share: float) -> Array:
    """(n,) stoichiometries of the new electrode with the potential of x (n,) in the aged one, (1); may be negative."""
    return np.where(x < edge, edge - (edge - x) / share, x)


def with_silicon(electrode: Electrode, edge: float, share: float) -> Electrode:
    """The electrode with this share of its silicon's capacity left, (1)."""
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
