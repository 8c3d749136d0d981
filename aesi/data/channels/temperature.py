"""Temperatures that are possible but more likely from a faulty sensor or in another unit."""

from __future__ import annotations

import numpy as np

from aesi.constants import COLDEST_DEGC
from aesi.data import units
from aesi.data.channels.checks import Columns, Context

WARMEST_START_DEGC = 62.0
"""Initial temperature above which a note is given: cells are tested up to 60 degC; a room has 68 to 77 degF."""
JUMP_K, JUMP_S = 5.0, 60.0
"""Change between two rows at most JUMP_S apart above which a note is given: measured records change by at most 3.4 K in
60 s and 0.6 K in a second."""

WORDS = {"degF": "Fahrenheit", "degC": "degC", "K": "kelvin"}
"""Names of the units of temperature, in the order in which they are tried."""


def temperature_doubts(data: Columns, context: Context) -> list[str]:
    """Notes on temperatures that are possible but more likely wrong; empty without a temperature column."""
    if "temperature_degc" not in data or "temperature_degc" not in context.header:
        return []
    temperature_degc, time_s = data["temperature_degc"], data["time_s"]
    if not temperature_degc.any():
        return [
            "Its temperature is 0 degC in every row, which loggers write where no sensor is connected: "
            "--column temperature_degc= leaves it out."
        ]
    if temperature_degc[0] > WARMEST_START_DEGC:
        likely = _likely_unit(float(temperature_degc[0]), context.unit.get("temperature_degc", "degC"))
        advice = (
            f"if that is in {WORDS[likely]}: --unit temperature_degc={likely}"
            if likely
            else "check the column"
        )
        return [
            f"Its temperature starts at {temperature_degc[0]:.4g} degC, warmer than cells are tested; {advice}."
        ]
    jump = np.where(np.diff(time_s) <= JUMP_S, np.abs(np.diff(temperature_degc)), 0.0)
    if np.any(jump > JUMP_K):
        row = int(np.argmax(jump > JUMP_K)) + 1
        return [
            f"Its temperature goes from {temperature_degc[row - 1]:.4g} to {temperature_degc[row]:.4g} degC within "
            f"{time_s[row] - time_s[row - 1]:.3g} s at {context.where(row)}, faster than a cell's (jumps like it: "
            f"{int(np.sum(jump > JUMP_K))}); every simulation runs at it: correct the rows where the sensor failed, or "
            "--column temperature_degc= leaves it out."
        ]
    return []


def _likely_unit(degc: float, unit: str) -> str | None:
    """A unit other than `unit` in which the number would be a usual temperature of a test; None without one."""
    temperature = units.FACTORS["temperature_degc"]
    number = degc / temperature[unit] - units.OFFSETS.get(unit, 0.0)
    for other in WORDS:
        (there,) = units.to_si("temperature_degc", np.array([number]), other)
        if other != unit and COLDEST_DEGC <= there <= WARMEST_START_DEGC:
            return other
    return None
