"""Temperatures that a cell may have and that more likely are those of a sensor at fault, or in another unit."""

from __future__ import annotations

import numpy as np

from aesi.data.channels.checks import Columns, Context

WARMEST_START_DEGC = 62.0
"""Tests of cells are at most at 60 degC; a room is at 68 to 77 degF."""
JUMP_K, JUMP_S = 5.0, 60.0
"""Between two rows no further apart: the measured records have 3.4 K in 60 s and 0.6 K in a second at most."""


def temperature_doubts(data: Columns, context: Context) -> list[str]:
    """A sentence on a temperature that may be, and is more likely something else; none without one."""
    if "temperature_degc" not in data:
        return []
    temperature_degc, time_s = data["temperature_degc"], data["time_s"]
    if not temperature_degc.any():
        return [
            "Its temperature is 0 degC in every row, which loggers write where no sensor is connected: "
            "--column temperature_degc= leaves it out."
        ]
    if temperature_degc[0] > WARMEST_START_DEGC:
        return [
            f"Its temperature starts at {temperature_degc[0]:.4g} degC, warmer than cells are tested; if that is in "
            "Fahrenheit: --unit temperature_degc=F."
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
