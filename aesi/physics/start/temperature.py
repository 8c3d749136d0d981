"""A column of temperatures that the voltage of its record contradicts: a sensor that is dead, or not on the cell.

The declared cell is simulated at other temperatures, each the same in every row. Where it follows the record at one of
them and leaves many times as much at that of the column, the column is what is wrong with the record, or the cell
answers as one that much colder or warmer would: a single record does not tell which.

Measured on 112 records of three cells with a temperature, -20 to 40 degC. With each file that was calibrated to their
cell, or is of the model before it (277 pairs), 12 are followed within FOLLOWS_V at another temperature, and their
column leaves at most 2.28 times as much as that one: none is told. With files of other cells, brought to the size of
theirs (837 pairs), 28 are followed so and 15 are told, for their kinetics are others, which the sentence leaves open:
five drives of a Panasonic at 2 to 16 degC with files of an LG 18650HG2 (3.0 to 4.1 times), and five of the HG2 at 24
degC with files of the Panasonic and of an NCA cell (3.1 to 7.0). With the LG M50 that shipped cells were fitted from
it is 2.9 times at most. With 0 degC for their column 11 of 28 are followed by their own file, and all are told (3.3 to
153 times).
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
"""Tried, and that of the cell's file."""
CLEAR_V = 0.03
"""An error of the declared cell below it is no evidence against a temperature: models of measured cells err by that."""
FOLLOWS_V = 0.04
"""What the declared cell leaves where it follows a record: calibrated files at most of those, at their temperature."""
TIMES = 3.0
"""What the column leaves, over what another temperature does: above the 2.28 of records with the file of their cell."""
FURTHER_K = 8.0
"""A step of the grid, less what a cell warms by: closer temperatures are no other ones."""


@dataclass(frozen=True)
class OtherTemperature:
    """degc : in the mean of the rows, at which the declared cell leaves `left_v` (RMS).  there_degc, there_v : of the
    temperature at which it leaves least."""

    degc: float
    left_v: float
    there_degc: float
    there_v: float

    def sentence(
        self,
        name: str,
        model: str = "the declared model",
        otherwise: str = "the cell answers as one at that temperature would",
        *,
        given: bool = False,
    ) -> str:
        """For a reader.  name : of the record.  model : that was simulated, in words.  otherwise : what is so where the
        temperature is right.  given : it was, with --temperature, and there is no column."""
        wrong = (
            "what was given is not the cell's (correct --temperature FILE=DEGC)"
            if given
            else "it is in another unit (--unit temperature_degc=degF), its sensor is at fault or not on the cell "
            "(--column temperature_degc= leaves it out)"
        )
        return (
            f"{name}: its voltage contradicts its temperature. At {self.degc:.4g} degC, which it is taken at, "
            f"{model} leaves {MV_PER_V * self.left_v:.1f} mV, at {self.there_degc:.4g} degC "
            f"{MV_PER_V * self.there_v:.1f} mV: {wrong}, or {otherwise}."
        )


def contradicted_temperature(
    cell: Cell,
    record: Measurement,
    soc0: float,
    hold: Hold,
    effects: Iterable[ActiveEffect] = (),
    model: ModelName = "espm",
) -> OtherTemperature | None:
    """Another temperature by which a cell with its effects follows a record; None where the record's own is not
    contradicted, and without one, or without a voltage in every row.

    soc0 : state of charge at the first row.  hold : how the current runs between the rows.
    """
    if record.temperature_degc is None or not np.all(np.isfinite(record.voltage_v)):
        return None
    left_v = partial(_left_v, cell, record, soc0, hold, tuple(effects), model)
    return other_temperature(record.temperature_degc, cell.initial_temperature_k - ZERO_CELSIUS_K, left_v)


def _left_v(
    cell: Cell,
    record: Measurement,
    soc0: float,
    hold: Hold,
    effects: tuple[ActiveEffect, ...],
    model: ModelName,
    degc: Array,
) -> float | None:
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
    """Another temperature by which the declared cell follows a record; None where its column is not contradicted.

    column_degc : (n,) of the record.  declared_degc : of the cell's file.
    error_v : RMS, V, that the declared cell leaves at temperatures (n,) degC; None where it cannot be simulated.
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
    return OtherTemperature(mean, left_v, best, tried[best])
