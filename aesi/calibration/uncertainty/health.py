"""State of health of a calibrated cell: resistance, cyclable lithium, active material and capacity, with intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass, fields

import numpy as np

from aesi.calibration.result import NINETY_FIVE, Calibration
from aesi.calibration.written_cell import written_cell
from aesi.constants import MILLI
from aesi.physics.cell import Cell

STEP = 1e-2
"""Step of the slopes, in standard deviations of the priors."""
HEALTH_WORDS = {
    "resistance_mohm": "resistance of contacts and films, mohm",
    "inventory_ah": "cyclable lithium, Ah",
    "negative_ah": "active material of the negative electrode, Ah",
    "positive_ah": "active material of the positive electrode, Ah",
    "capacity_ah": "capacity, Ah",
}


@dataclass(frozen=True)
class Health:
    """State of one check-up, from the calibrated cell.

    resistance_mohm : of contacts and films at half charge, mohm, without electrolyte and electrodes.
    inventory_ah : cyclable lithium in both electrodes, Ah.  negative_ah, positive_ah : capacity of the active material
    of each electrode, Ah.  capacity_ah : between full and empty, Ah.
    """

    resistance_mohm: float
    inventory_ah: float
    negative_ah: float
    positive_ah: float
    capacity_ah: float


def health_of(cell: Cell) -> Health:
    """The state of health from the parameters of a calibrated cell."""
    negative, positive = (cell.electrode_capacity_ah(e) for e in (cell.negative, cell.positive))
    theta_n, theta_p = cell.stoichiometries(1.0)
    return Health(
        resistance_mohm=MILLI * cell.contacts_and_films_ohm,
        inventory_ah=negative * theta_n + positive * theta_p,
        negative_ah=negative,
        positive_ah=positive,
        capacity_ah=cell.capacity_ah,
    )


def health_intervals(found: Calibration) -> Mapping[str, tuple[float, float]]:
    """Quantity -> its 95 % interval, by linear propagation of the fit's covariance. A parameter on an upper bound has
    its slope taken towards the inside."""
    at = np.array(astuple(health_of(written_cell(found.model, found.x))))
    slopes = np.zeros((len(at), len(found.x)))
    for j in range(len(found.x)):
        h = STEP if found.x[j] + STEP <= found.model.high[j] else -STEP
        there = found.x.copy()
        there[j] += h
        slopes[:, j] = (np.array(astuple(health_of(written_cell(found.model, there)))) - at) / h
    reach = NINETY_FIVE * np.sqrt(np.einsum("ij,jk,ik->i", slopes, found.covariance, slopes))
    middle = np.array(astuple(health_of(found.cell)))
    return {
        field.name: (float(max(m - r, 0.0)), float(m + r))
        for field, m, r in zip(fields(Health), middle, reach, strict=True)
    }
