"""The voltage error of the physics on a record: measured minus simulated, with what the sparse model reads."""

from __future__ import annotations

import numpy as np

from aesi.constants import ZERO_CELSIUS_K
from aesi.records import INPUT_NAMES, ErrorSeries, Measurement, Run


def error_series(measurement: Measurement, run: Run, dt_s: float) -> ErrorSeries:
    """The voltage error of a simulation of an evenly sampled measurement, with the inputs of the sparse model.

    Where no temperature was measured it is the one that the physics ran at: an error that is learnt there is no more
    known at another one than if it had been measured.
    """
    degc = measurement.temperature_degc
    inputs = np.column_stack([measurement.current_a, *(run.series[name] for name in INPUT_NAMES[1:])])
    return ErrorSeries(
        name=measurement.name,
        dt_s=dt_s,
        time_s=measurement.time_s,
        error_v=measurement.voltage_v - run.voltage_v,
        inputs=inputs,
        soc=run.series["soc"],
        model_v=run.voltage_v,
        temperature_degc=run.series["temperature_k"] - ZERO_CELSIUS_K if degc is None else degc,
    )
