"""The rows that a calibration simulates, those that count in the fit, and the steps of its model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.calibration.start import charge_hold
from aesi.data.thinning import Spacing, averaged_over, condensed, current_steps
from aesi.numerics.typing import BoolArray
from aesi.records import Hold, Measurement

WINDOW_S = 1.0
"""Rows of a drive are averaged over this: solid diffusion and the electrolyte are slower."""
MOST_ROWS = 4000
"""Most rows of a drive in a fit; the averaging window grows until there are no more."""
STEADY_ROWS = 400
"""Number of rows of a record of constant currents, besides those after its steps."""
SPACING = Spacing(first_s=0.2, growth=0.4)
SOON_S = 1.0
"""A row with a step of the current in it does not count in the fit where the next row follows this soon."""


@dataclass(frozen=True, eq=False)
class Thinned:
    """The rows that a fit simulates.

    data : the rows.  hold : how the current runs between them.
    trusted : (rows,) False where a step of the current lies within the row: instruments read current and voltage some
    hundredths of a second apart.
    """

    data: Measurement
    trusted: BoolArray
    hold: Hold


def thinned(data: Measurement, capacity_ah: float) -> Thinned:
    """The rows that a fit uses.  capacity_ah : converts the C-rate of a step of the current to A."""
    span_s = float(data.time_s[-1] - data.time_s[0])
    steady = condensed(data, capacity_ah, span_s / STEADY_ROWS, SPACING, charge_hold(data))
    if steady is None:
        rows = averaged_over(data, max(WINDOW_S, span_s / MOST_ROWS))
        return Thinned(rows, np.ones(len(rows), dtype=bool), "linear")
    rows, _ = steady
    gaps = np.diff(rows.time_s)
    followed = np.append(gaps[1:], np.inf) < SOON_S
    trusted = np.concatenate([[True], ~(current_steps(rows, capacity_ah) & followed)])
    return Thinned(rows, trusted, charge_hold(data))
