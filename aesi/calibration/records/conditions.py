"""Knowledge for a calibration in addition to the cell's file and the rows of its records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import NamedTuple

from aesi.physics.simulation import ModelName
from aesi.records import Spectrum


class Prior(NamedTuple):
    """A user's prior of a parameter, in the unit of the report (a factor is relative to the start file).

    sd : standard deviation in that unit; of the natural logarithm for factors, double layers and the thermal
    conductivity.
    """

    value: float
    sd: float


@dataclass(frozen=True)
class Conditions:
    """The conditions of the records, and their relation to the file; mappings are by record name.

    soc0 : state of charge at the first row, for every record whose voltage does not contradict it.
    temperatures_degc : degC, of records without a temperature column.
    dates : days of the records; records of different days may have different ages.  as_of : day of the file's state;
    None takes the last with a load.
    model : "espm" or "dfn"; None takes "espm".
    same_cell : True where the file is of this very cell: missing charge was lost, and the stoichiometries of full
    charge may be far from the file's. False where it may be of a cell of another size: its area is scaled to the
    charge of a full discharge.
    spectra : impedance spectra of this very cell, fitted together with the records.
    priors : parameter, as named in the report -> a `Prior` or its two values, in place of the default prior.
    """

    soc0: float | None = None
    temperatures_degc: Mapping[str, float] = field(default_factory=dict)
    dates: Mapping[str, date] = field(default_factory=dict)
    as_of: date | None = None
    model: ModelName | None = None
    same_cell: bool = False
    spectra: tuple[Spectrum, ...] = ()
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
