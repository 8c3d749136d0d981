"""Detection of a temperature column that the voltage of its record contradicts: a sensor that is dead or off the cell.

The declared cell is simulated at other temperatures, each constant over the record. If it follows the record at one of
them, and its error at the temperature of the column is many times larger, either the column is wrong or the cell
responds like a colder or warmer one; a single record does not tell which.

Measured on 112 records of three cells with a temperature, -20 to 40 degC. With each file that was calibrated to their
cell, or is of the model before it (277 pairs), 12 are followed within FOLLOWS_V at another temperature, and the error
at their column is at most 2.28 times as large: none is reported. With files of other cells, scaled to the size of
theirs (837 pairs), 28 are followed so and 15 are reported, since their kinetics differ, which the sentence mentions as
a cause: five drives of a Panasonic at 2 to 16 degC with files of an LG 18650HG2 (3.0 to 4.1 times), and five of the HG2
at 24 degC with files of the Panasonic and of an NCA cell (3.1 to 7.0). With the LG M50 that shipped cells were fitted
from it is 2.9 times at most. With 0 degC for their column 11 of 28 are followed by their own file, and all are reported
(3.3 to 153 times).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from aesi.constants import MV_PER_V, ZERO_CELSIUS_K
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.physics.simulation import ModelName, simulate
from aesi.records import Hold, Measurement

GRID_DEGC = (-20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0, 50.0)
"""Temperatures that are tried, with that of the cell's file."""
CLEAR_V = 0.03
"""RMS error of the declared cell, V, below which it is no evidence against a temperature: a usual error of measured
cells."""
FOLLOWS_V = 0.04
"""RMS error, V, within which the declared cell follows a record, as calibrated files do on most of those records at
their temperature."""
TIMES = 3.0
"""Least ratio of the error at the column's temperature to that at another one: above the 2.28 of records with the file
of their cell."""
FURTHER_K = 8.0
"""Least distance of another temperature, K: a step of the grid, minus the usual warming of a cell."""


@dataclass(frozen=True)
class OtherTemperature:
    """degc, left_v : mean temperature of the rows, and the RMS error of the declared cell at it, V.  there_degc,
    there_v : temperature with the smallest RMS error, and that error, V.  constant : whether all rows have the same
    temperature, which no sensor on a cell under load tells."""

    degc: float
    left_v: float
    there_degc: float
    there_v: float
    constant: bool = False

    def sentence(
        self,
        name: str,
        model: str = "the declared model",
        otherwise: str = "the cell answers as one at that temperature would",
        *,
        given: bool = False,
    ) -> str:
        """The sentence for a reader.  name : of the record.  model : the simulated one, in words.  otherwise : clause
        on the cause if the temperature is right.  given : True for a temperature by --temperature, without a column."""
        if given:
            wrong = "what was given is not the cell's (correct --temperature FILE=DEGC)"
        elif self.constant:
            wrong = (
                "it is the same in all rows: stated or of a chamber, and not the cell's, of a dead sensor, or in "
                "another unit (--unit temperature_degc=degF; --column temperature_degc=DEGC states another, --column "
                "temperature_degc= leaves it out)"
            )
        else:
            wrong = (
                "it is in another unit (--unit temperature_degc=degF), its sensor is at fault or not on the cell "
                "(--column temperature_degc= leaves it out)"
            )
        return (
            f"{name}: its voltage contradicts its temperature. The error of {model} is {MV_PER_V * self.left_v:.1f} mV "
            f"at {self.degc:.4g} degC, which it is taken at, and {MV_PER_V * self.there_v:.1f} mV at "
            f"{self.there_degc:.4g} degC: {wrong}, or {otherwise}."
        )


def contradicted_temperature(
    cell: Cell,
    record: Measurement,
    soc0: float,
    hold: Hold,
    effects: Iterable[ActiveEffect] = (),
    model: ModelName = "espm",
) -> OtherTemperature | None:
    """The temperature at which a cell with its effects follows a record; None where the record's own temperature is not
    contradicted, where it has none, and without a voltage in every row.

    soc0 : state of charge at the first row.  hold : how the current runs between the rows.
    """
    if record.temperature_degc is None or not np.all(np.isfinite(record.voltage_v)):
        return None
    error_v = partial(_rmse_at, cell, record, soc0, hold, tuple(effects), model)
    return other_temperature(record.temperature_degc, cell.initial_temperature_k - ZERO_CELSIUS_K, error_v)


def _rmse_at(
    cell: Cell,
    record: Measurement,
    soc0: float,
    hold: Hold,
    effects: tuple[ActiveEffect, ...],
    model: ModelName,
    degc: Array,
) -> float | None:
    """RMS error of the cell at temperatures degc (n,), V; None where it cannot be simulated."""
    try:
        run = simulate(
            cell,
            record.time_s,
            record.current_a,
            soc0,
            effects,
            degc,
            hold,
            on_depletion="clip",
            model=model,
        )
    except AesiError:
        return None
    return rms(record.voltage_v - run.voltage_v)


def other_temperature(
    column_degc: Array, declared_degc: float, error_v: Callable[[Array], float | None]
) -> OtherTemperature | None:
    """The temperature at which the declared cell follows a record; None where its column is not contradicted.

    column_degc : (n,) of the record.  declared_degc : of the cell's file.
    error_v : temperatures (n,) degC -> RMS error of the declared cell, V; None where it cannot be simulated.
    """
    left_v, mean = error_v(column_degc), float(np.mean(column_degc))
    if left_v is None or not CLEAR_V < left_v < np.inf:  # this way round, NaN is no evidence
        return None
    tried = {
        degc: there_v
        for degc in {*GRID_DEGC, round(declared_degc, 2)}
        if abs(degc - mean) >= FURTHER_K
        and (there_v := error_v(np.full(len(column_degc), degc))) is not None
        and np.isfinite(there_v)
    }
    if not tried:
        return None
    best = min(tried, key=lambda degc: tried[degc])
    if not (tried[best] <= FOLLOWS_V and left_v >= TIMES * tried[best]):
        return None
    return OtherTemperature(mean, left_v, best, tried[best], bool(np.ptp(column_degc) == 0.0))
