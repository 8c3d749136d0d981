"""A cycler's reading of a simulated cell: noise, then the resolution of its converters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aesi.data.laboratory.simulator import TrueRun
from aesi.numerics.typing import Array
from aesi.records import LABORATORY, Measurement


@dataclass(frozen=True)
class Instrument:
    """Standard deviations of the white noise, and the resolution of each channel (0 writes all digits)."""

    voltage_noise_v: float = 1e-3
    current_noise_a: float = 4e-3
    temperature_noise_k: float = 0.05
    voltage_step_v: float = 1e-4
    current_step_a: float = 1e-4
    temperature_step_k: float = 0.01

    def write(
        self,
        trace: TrueRun,
        name: str,
        rng: np.random.Generator,
        temperature: bool,
        notes: tuple[str, ...] = (),
    ) -> Measurement:
        """The trace as a measurement, with a temperature column where `temperature` is True."""
        n = len(trace.time_s)
        current = trace.current_a + self.current_noise_a * rng.standard_normal(n)
        voltage = trace.voltage_v + self.voltage_noise_v * rng.standard_normal(n)
        warmth = trace.temperature_degc + self.temperature_noise_k * rng.standard_normal(n)
        return Measurement(
            time_s=trace.time_s,
            current_a=_stepped(current, self.current_step_a),
            voltage_v=_stepped(voltage, self.voltage_step_v),
            temperature_degc=_stepped(warmth, self.temperature_step_k) if temperature else None,
            name=name,
            source=LABORATORY,
            notes=notes,
        )


def _stepped(values: Array, step: float) -> Array:
    return step * np.round(values / step) if step else values
