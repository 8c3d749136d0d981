"""Frozen records that pass between the rooms: data, simulations, error series, failures.

SI units and seconds; current is positive on discharge; voltage error e = V_measured - V_model, in volts.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array, BoolArray, ComplexArray
from aesi.over_time import over_time, time_unit

if TYPE_CHECKING:
    import pandas as pd
    from plotly.graph_objects import Figure

Hold = Literal["linear", "backward"]
"""How the current runs between samples: straight lines, or constant since the row before (as loggers do)."""


SLOW_SAMPLING_S = 5.0
"""Rows further apart than this are a logger's, which writes at the end of an interval; closer ones hardly differ."""


def assumed_hold(time_s: Array) -> Hold:
    """How the current runs between rows where nobody says: constant since the row before where rows are far apart."""
    return "backward" if float(np.diff(time_s).max(initial=0.0)) > SLOW_SAMPLING_S else "linear"


def hold_sentence(name: str, hold: Hold, declared: bool) -> str:
    """What was taken, for a reader."""
    words = {
        "linear": "in straight lines between rows",
        "backward": "constant since the row before, as loggers write",
    }
    other = {"linear": "backward", "backward": "linear"}[hold]
    return f"{name}: the current is taken {words[hold]}" + (
        " as declared." if declared else f"; --hold {other} takes it otherwise."
    )


def digest(*arrays: Array | None) -> str:
    """SHA-256 of the bytes of the arrays, 16 hexadecimal digits; None counts as an empty array."""
    sha = hashlib.sha256()
    for array in arrays:
        sha.update(b"|" if array is None else np.ascontiguousarray(array, dtype=float).tobytes())
    return sha.hexdigest()[:16]


def _extent(time_s: Array) -> str:
    """Rows and duration, for a short text."""
    if not len(time_s):
        return "no rows"
    unit, divisor = time_unit(float(time_s[-1] - time_s[0]))
    return f"{len(time_s):,} rows over {(time_s[-1] - time_s[0]) / divisor:,.4g} {unit}"


@dataclass(frozen=True, eq=False)
class Measurement:
    """One continuous test of one cell.

    time_s, current_a, voltage_v : (n,) s (strictly increasing), A (discharge positive), V.
    temperature_degc : (n,) degC, or None where it was not measured.
    notes : what a reader dropped, mapped or resampled, one sentence each.
    hold : how the current runs between rows, where it was declared; else `assumed_hold` tells.
    """

    time_s: Array
    current_a: Array
    voltage_v: Array
    temperature_degc: Array | None = None
    name: str = "measurement"
    source: str = ""
    notes: tuple[str, ...] = ()
    hold: Hold | None = None

    def __post_init__(self) -> None:
        n = len(self.time_s)
        for label in ("current_a", "voltage_v", "temperature_degc"):
            column = getattr(self, label)
            if column is not None and len(column) != n:
                raise DataError(f"{self.name}: {label} has {len(column)} rows, time_s has {n}.")

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        warm = "" if self.temperature_degc is None else ", with temperature"
        return f"Measurement({self.name!r}, {_extent(self.time_s)}{warm})"

    def to_frame(self) -> pd.DataFrame:
        """The columns as a table, one row a sample; the temperature where it was measured."""
        import pandas as pd

        columns = {
            name: getattr(self, name) for name in ("time_s", "current_a", "voltage_v", "temperature_degc")
        }
        return pd.DataFrame({name: values for name, values in columns.items() if values is not None})

    def plot(self) -> Figure:
        """Voltage, current and temperature over time: a plotly figure."""
        panels = {"voltage, V": {"measured": self.voltage_v}, "current, A": {"current": self.current_a}}
        if self.temperature_degc is not None:
            panels["temperature, degC"] = {"temperature": self.temperature_degc}
        return over_time(self.time_s, panels)

    @property
    def digest(self) -> str:
        """Content hash of the four columns."""
        return digest(self.time_s, self.current_a, self.voltage_v, self.temperature_degc)

    def held(self, hold: Hold | None) -> Measurement:
        """The record with how its current was declared to run between rows."""
        return replace(self, hold=hold)

    def take(self, rows: slice | Array) -> Measurement:
        """The given rows, as a measurement of the same name."""
        temperature = None if self.temperature_degc is None else self.temperature_degc[rows]
        return replace(
            self,
            time_s=self.time_s[rows],
            current_a=self.current_a[rows],
            voltage_v=self.voltage_v[rows],
            temperature_degc=temperature,
        )

    def between(self, start_s: float, stop_s: float) -> Measurement:
        """The rows with start_s <= time_s < stop_s."""
        low, high = np.searchsorted(self.time_s, [start_s, stop_s])
        return self.take(slice(int(low), int(high)))


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One impedance spectrum of a cell at rest.

    frequency_hz : (n,) Hz.  z_ohm : (n,) ohm, the imaginary part negative where capacitive.
    soc or discharged_ah (since full) : the state.  temperature_degc, voltage_v : None where not measured.
    """

    name: str
    frequency_hz: Array
    z_ohm: ComplexArray
    soc: float | None = None
    discharged_ah: float | None = None
    voltage_v: float | None = None
    temperature_degc: float | None = None


@dataclass(frozen=True, eq=False)
class Run:
    """One simulation: voltage and the internal states, a value a sample.

    series : name -> (n,) array. Always there: c_sp, c_sn (surface, mol/m3), c_e0, c_eL (electrolyte at the
    negative and the positive current collector, mol/m3), soc, temperature_k; effects add their own.
    profiles : across the electrodes, where they were asked for: x_m (places,) from the negative collector, and by
    sample and place (n, places): surface_stoichiometry, reaction_a_m2 of particle surface (delithiation positive),
    electrolyte_mol_m3, and potential_v of the solid against the electrolyte.
    """

    time_s: Array
    current_a: Array
    voltage_v: Array
    series: dict[str, Array] = field(default_factory=dict)
    profiles: dict[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        low, high = float(self.voltage_v.min()), float(self.voltage_v.max())
        return f"Run({_extent(self.time_s)}, {low:.3f} to {high:.3f} V, states {', '.join(self.series)})"

    def to_frame(self) -> pd.DataFrame:
        """Time, current, voltage and states as a table, one row a sample."""
        import pandas as pd

        columns = {"time_s": self.time_s, "current_a": self.current_a, "voltage_v": self.voltage_v}
        return pd.DataFrame(columns | self.series)

    def plot(self) -> Figure:
        """Voltage, current and state of charge over time: a plotly figure."""
        panels = {"voltage, V": {"simulated": self.voltage_v}, "current, A": {"current": self.current_a}}
        if "soc" in self.series:
            panels["state of charge"] = {"state of charge": self.series["soc"]}
        return over_time(self.time_s, panels)

    @property
    def states(self) -> pd.DataFrame:
        """The series as a table, one row a sample."""
        import pandas as pd

        return pd.DataFrame(self.series)


INPUT_NAMES = ("I", "c_sp", "c_sn", "c_e0", "c_eL")
"""The inputs U of the sparse model, in the paper's order."""


@dataclass(frozen=True, eq=False)
class ErrorSeries:
    """The voltage error over one continuous, evenly sampled record, and what may drive it.

    error_v : (n,) V, V_measured - V_model.  inputs : (n, n_inputs) SI, columns `input_names`.
    soc : (n,).  model_v : (n,) V, the physics model's voltage (so V_measured = model_v + error_v).
    physics : name -> (n,) V, what other physics models say of the same record, for comparison.
    The sparse model maps (error_v[k], inputs[k]) to error_v[k + 1]; records are never joined across a gap.
    """

    name: str
    dt_s: float
    time_s: Array
    error_v: Array
    inputs: Array
    soc: Array
    model_v: Array
    input_names: tuple[str, ...] = INPUT_NAMES
    physics: Mapping[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.error_v)

    def __repr__(self) -> str:
        return f"ErrorSeries({self.name!r}, {_extent(self.time_s)}, inputs {', '.join(self.input_names)})"

    @property
    def current_a(self) -> Array:
        """(n,) A, discharge positive."""
        return self.inputs[:, self.input_names.index("I")]

    @property
    def digest(self) -> str:
        """Content hash of error and inputs."""
        return digest(self.error_v, self.inputs)

    def take(self, rows: slice, name: str | None = None) -> ErrorSeries:
        """A contiguous piece of the record."""
        return replace(
            self,
            name=name or self.name,
            time_s=self.time_s[rows],
            error_v=self.error_v[rows],
            inputs=self.inputs[rows],
            soc=self.soc[rows],
            model_v=self.model_v[rows],
            physics={name: voltage[rows] for name, voltage in self.physics.items()},
        )

    def left_by(self, name: str) -> Array:
        """(n,) V: measured minus what the named physics model says; of the model itself where nothing else is known."""
        other = self.physics.get(name)
        return self.error_v if other is None else self.error_v + self.model_v - other


Role = Literal["train", "valid", "test"]
ROLES: tuple[Role, ...] = ("train", "valid", "test")


@dataclass(frozen=True, eq=False)
class HeldOutDrive:
    """A training record under physics that was fitted without some of its samples.

    rows : these samples.
    """

    series: ErrorSeries
    rows: slice


@dataclass(frozen=True)
class Split:
    """Records by role. The test records choose nothing: they are met once, by the model already chosen."""

    train: tuple[ErrorSeries, ...]
    valid: tuple[ErrorSeries, ...]
    test: tuple[ErrorSeries, ...]


@dataclass(frozen=True, eq=False)
class FreeRun:
    """A prediction without measured voltage after its start.

    error_v : (n,) V, the predicted error; held at its last value inside the range after a divergence.
    diverged_at : the first sample at which the prediction left ten times the trained range, or None.
    outside : (n,) True where an input lies outside the range the model was trained on.
    excess : (n,) how far the sample lies from what the model was fitted to, 0 where not at all: of its leverage, in
    units of that of the fitted rows (`aesi.sparse.leverage`); None where the model cannot tell.
    """

    error_v: Array
    diverged_at: int | None
    outside: BoolArray
    excess: Array | None = None


class ErrorModel(Protocol):
    """What every model of the voltage error offers: sparse ensembles, baselines, the bare ESPM (zero)."""

    @property
    def name(self) -> str:
        """What tables call it."""
        ...

    def one_step(self, series: ErrorSeries) -> Array:
        """(n,) V: the prediction of error_v[k] given the measured error_v[k - 1]; the first is error_v[0]."""
        ...

    def free_run(self, series: ErrorSeries, error0_v: float | None = None) -> FreeRun:
        """Prediction from `error0_v` (default: the measured error_v[0]) with its own feedback only."""
        ...

    def k_step(self, series: ErrorSeries, steps: int) -> Array:
        """(n,) V: the prediction of error_v[k] given error_v[k - steps] and the inputs since; first
        `steps` values as in a free run from the first sample."""
        ...


@dataclass(frozen=True)
class Failed:
    """An expected failure inside a search or a fit: a value, not an exception."""

    reason: str
    time_s: float | None = None
