"""State of health of a calibrated cell: resistance, cyclable lithium, active material and capacity, with intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass, fields

import numpy as np

from aesi.calibration.result import NINETY_FIVE, Calibration
from aesi.calibration.uncertainty.propagated import propagated_variance
from aesi.constants import MILLI
from aesi.physics.cell import Cell

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
    """Field of `Health` -> its 95 % interval, in the field's unit, by linear propagation of the fit's covariance; it
    begins at 0 where that would reach below, since none of the quantities can be negative."""
    reach = NINETY_FIVE * np.sqrt(propagated_variance(found, lambda cell: np.array(astuple(health_of(cell)))))
    middle = np.array(astuple(health_of(found.cell)))
    return {
        field.name: (float(max(m - r, 0.0)), float(m + r))
        for field, m, r in zip(fields(Health), middle, reach, strict=True)
    }
