"""The voltage error of the physics on a record: measured minus simulated, with what the sparse model reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.constants import ZERO_CELSIUS_K
from aesi.data.resample import BetweenStamps
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


def as_resampled(even: ErrorSeries, own: ErrorSeries) -> ErrorSeries:
    """The error at even stamps, with the model's voltage averaged from the record's own rows (`ErrorSeries.own`) just
    as the measured one was, instead of simulated at the stamps.

    even : of the measurement on its stamps, by a simulation of these.  own : of the rows that it was made of, by a
    simulation of the same physics from the same start; its `physics` become those of the stamps.
    A step of a current that is held over the step moves a cell's voltage by millivolts until its end: of a record that
    a calibrated LG HG2 and Panasonic 18650PF themselves simulate in rows of 0.1 s, steps of 1 s were 4 mV RMS off.
    """
    brought = BetweenStamps(own.time_s, even.time_s).as_voltage
    model_v = brought(own.model_v)
    return replace(
        even,
        error_v=even.error_v + even.model_v - model_v,
        model_v=model_v,
        physics={name: brought(voltage) for name, voltage in own.physics.items()},
        own=own,
    )
