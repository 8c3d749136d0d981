"""What a calibration is told beside the cell's file and the rows of its records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import NamedTuple

from aesi.physics.simulation import ModelName
from aesi.records import Spectrum


class Prior(NamedTuple):
    """What is known of a parameter from elsewhere, in the unit in which a report has it (of a factor, times the start
    file's).  sd : standard deviation, in that unit; of the natural logarithm for factors, double layers and the thermal
    conductivity.
    """

    value: float
    sd: float


@dataclass(frozen=True)
class Conditions:
    """Under which the records were taken, and what the file is to them; mappings are by record name.

    soc0 : state of charge at the first row of every record that its voltage does not contradict.
    temperatures_degc : of records without a column.
    dates : days of the records: what is of another day may be of another age.  as_of : of the file's state, the last
    with a load without it.
    model : that is fitted, "espm" or "dfn"; None takes "espm".
    same_cell : the file is of this very cell, so that a charge that is missing was lost and the stoichiometries of full
    charge may be far from the file's; else it may be of a cell of another size, and its area is scaled to the charge
    of a full discharge.
    spectra : impedance of this very cell, fitted beside the records.
    priors : of parameters as the report names them, in place of those that every cell has; a `Prior` or its two values.
    """

    soc0: float | None = None
    temperatures_degc: Mapping[str, float] = field(default_factory=dict)
    dates: Mapping[str, date] = field(default_factory=dict)
    as_of: date | None = None
    model: ModelName | None = None
    same_cell: bool = False
    spectra: tuple[Spectrum, ...] = ()
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
