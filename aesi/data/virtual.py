"""The virtual laboratory: simulated measurements of a cell, by PyBaMM's porous-electrode model.

It replaces measurements that are not public. The cell is a DFN with additional effects that an extended
single-particle model does not contain; `DEFAULT_MIX` are the default ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from aesi.data.laboratory.changes import find_change
from aesi.data.laboratory.instrument import Instrument
from aesi.data.laboratory.simulator import Applied, LaboratoryModel, Setup, simulate_truth
from aesi.data.profiles.profile import OTHER_LOAD, PULSE_C, Profile, paper_profiles
from aesi.errors import DataError, did_you_mean
from aesi.numerics.typing import Array
from aesi.records import Measurement

DEFAULT_MIX = ("ocv_hysteresis", "series_resistance")
"""8 mV of hysteresis on the negative electrode, and contacts that drop 8 mV at 1C."""

DROP_AT_1C_V = 0.008
"""Voltage drop at 1C of a contact or a film at magnitude 1: similar to the voltage error of a calibrated model."""
PARASITIC_SHARE = 0.005
"""Charge of a parasitic current per hour at magnitude 1, as a share of the capacity."""
INSTRUMENT = Instrument()
"""What writes all virtual records."""

STRENGTHS: dict[str, Callable[[float, float], dict[str, float]]] = {
    "self_heating": lambda m, q: {"cooling_w_m2_k": 10.0 / m},
    "ambient_temperature": lambda m, q: {"shift_k": -5.0 * m},
    "series_resistance": lambda m, q: {"resistance_ohm": m * DROP_AT_1C_V / q},
    "film_growth": lambda m, q: {"growth_ohm_ah": m * DROP_AT_1C_V / q**2},
    "ocv_hysteresis": lambda m, q: {"negative_v": 8e-3 * m, "decay": 50.0},
    "ocp_shape": lambda m, q: {"positive_v": 0.01 * m},
    "concentration_dependent_diffusivity": lambda m, q: {"negative_slope": 2.0 * m},
    "solid_diffusivity": lambda m, q: {"negative_factor": 1.5**-m},
    "electrolyte_transport": lambda m, q: {"conductivity_factor": 1.5**-m, "diffusivity_factor": 1.5**-m},
    "charge_transfer_kinetics": lambda m, q: {"negative_factor": 2.0**-m},
    "asymmetric_kinetics": lambda m, q: {"negative_alpha": 0.5 + 0.15 * m},
    "double_layer": lambda m, q: {"capacity_f_m2": 10.0 * m},
    "lithium_inventory_loss": lambda m, q: {"negative_stoichiometry": 0.02 * m},
    "active_material_loss_negative": lambda m, q: {"share": 0.05 * m},
    "active_material_loss_positive": lambda m, q: {"share": 0.05 * m},
    "particle_size_distribution": lambda m, q: {"negative_spread": 0.3 * m, "positive_spread": 0.3 * m},
    "leakage_current": lambda m, q: {"leak_a": m * PARASITIC_SHARE * q},
}
"""Change -> function from magnitude (1 is typical) and capacity q in Ah to the values of the change."""


@dataclass(frozen=True)
class Laboratory:
    """A cell file, and changes to its cell.

    effects : ids of changes, at `magnitude` times their typical strength.  values : change id -> value name -> value,
    which replaces the typical one.  thermocouple : whether the records have a temperature column; None gives them one
    where the cell heats itself.  seed : seed of the instruments' noise.
    """

    bpx: Path
    model: LaboratoryModel = "DFN"
    effects: tuple[str, ...] = DEFAULT_MIX
    magnitude: float = 1.0
    values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    thermocouple: bool | None = None
    seed: int = 0

    @property
    def capacity_ah(self) -> float:
        """Nominal capacity of the declared cell."""
        return nominal_capacity_ah(self.bpx)

    def setup(self) -> Setup:
        """The cell file, the model and the changes, as the simulator takes them.

        Raises DataError for an unknown change, for values of one that is not made, and for a magnitude at which one has
        no strength.
        """
        for name in self.values:
            if name not in self.effects:
                made = ", ".join(self.effects) or "none"
                raise DataError(
                    f"values are given of {name!r}, which is no change that the laboratory makes"
                    f"{did_you_mean(name, self.effects)} It makes {made}; name it in effects, or leave its values out."
                )
        return Setup(self.bpx, self.model, tuple(self._apply(name) for name in self.effects))

    def measure(self, profile: Profile) -> Measurement:
        """One record: the simulated profile as the instruments write it. The noise depends on seed and profile name.

        Raises DataError or SimulationError as `laboratory.simulator.simulate_truth` does.
        """
        rng = np.random.default_rng([self.seed, *profile.name.encode()])
        mix = ", ".join(self.effects) or "nothing added"
        note = f"{profile.name}: virtual, {self.model} of {self.bpx.name} with {mix}; seed {self.seed}."
        written = "self_heating" in self.effects if self.thermocouple is None else self.thermocouple
        trace = simulate_truth(self.setup(), profile)
        notes = (note, *self._outside(profile.name, trace.voltage_v))
        return INSTRUMENT.write(trace, profile.name, rng, written, notes)

    def _outside(self, name: str, voltage_v: Array) -> tuple[str, ...]:
        """A note where the voltage leaves the declared window; a cycler would stop there."""
        low, high = voltage_window_v(self.bpx)
        least, most = float(voltage_v.min()), float(voltage_v.max())
        if low <= least and most <= high:
            return ()
        return (f"{name}: the voltage runs from {least:.3f} to {most:.3f} V, outside {low:g} to {high:g} V.",)

    def _apply(self, name: str) -> Applied:
        change = find_change(name)
        if name not in STRENGTHS:
            raise DataError(
                f"The change {change.id} has no typical strength; give its values to the simulator."
            )
        try:
            typical = STRENGTHS[name](self.magnitude, self.capacity_ah)
        except ZeroDivisionError:  # of a change that is none where its value is infinite
            raise DataError(
                f"The change {change.id} has no value at magnitude 0; give another magnitude, or leave the change out."
            ) from None
        return Applied(name, {**typical, **self.values.get(name, {})})


@dataclass(frozen=True)
class VirtualExperiment:
    """Records by role; soc0 : state of charge at the first row, by record name."""

    train: tuple[Measurement, ...]
    valid: tuple[Measurement, ...]
    test: tuple[Measurement, ...]
    soc0: dict[str, float]


def paper_experiment(
    laboratory: Laboratory, dt_s: float, pulse_c: float = PULSE_C, other_load: float = OTHER_LOAD
) -> VirtualExperiment:
    """The paper's experiment, a row every dt_s (s): 88,200 training rows at 10 Hz, 8,820 at 1 Hz.

    pulse_c, other_load : as for `paper_profiles`.
    Raises DataError or SimulationError as `Laboratory.measure` does.
    """
    profiles = paper_profiles(laboratory.capacity_ah, dt_s, pulse_c, other_load)

    def measured(role: str) -> tuple[Measurement, ...]:
        return tuple(laboratory.measure(profile) for profile in profiles[role])

    soc0 = {profile.name: profile.soc0 for role in profiles.values() for profile in role}
    return VirtualExperiment(measured("train"), measured("valid"), measured("test"), soc0)


def nominal_capacity_ah(bpx: Path) -> float:
    """The nominal capacity a BPX file states. Raises DataError where it cannot be read."""
    return _declared(bpx, "Nominal cell capacity [A.h]")


def voltage_window_v(bpx: Path) -> tuple[float, float]:
    """Lower and upper cut-off a BPX file states. Raises DataError where they cannot be read."""
    return _declared(bpx, "Lower voltage cut-off [V]"), _declared(bpx, "Upper voltage cut-off [V]")


def stoichiometry_span(bpx: Path, electrode: str) -> float:
    """Maximum minus minimum stoichiometry that a BPX file states for "Negative electrode" or "Positive electrode".
    Raises DataError where they cannot be read."""
    low, high = (_declared(bpx, f"{end} stoichiometry", electrode) for end in ("Minimum", "Maximum"))
    return high - low


def _declared(bpx: Path, name: str, part: str = "Cell") -> float:
    import json

    try:
        content = json.loads(bpx.read_text(encoding="utf-8"))
        return float(content["Parameterisation"][part][name])
    except OSError as error:
        raise DataError(f"The cell file {bpx} cannot be opened: {error.strerror}.") from None
    except (ValueError, KeyError, TypeError) as error:
        raise DataError(f"{bpx.name} states no {name!r} ({error}).") from None
