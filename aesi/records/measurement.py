"""Measured data: a test of current and voltage, an impedance spectrum, and how a current runs between rows."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import DataError, in_words
from aesi.numerics.typing import AnyArray, Array, ComplexArray, Numbers
from aesi.over_time import extent, over_time, range_words, stamp
from aesi.records.checked import (
    check_row,
    check_times,
    complex_numbers,
    is_finite_number,
    numbers,
    of_columns,
    row_words,
)

if TYPE_CHECKING:
    import pandas as pd
    from plotly.graph_objects import Figure

Hold = Literal["linear", "backward"]
"""How the current runs between samples: straight lines, or constant since the row before (as loggers do)."""
HOLD_WORDS: Mapping[Hold, str] = {
    "linear": "linear between rows",
    "backward": "constant since the row before",
}
"""What follows 'the current is' for each hold."""
OTHER_HOLD: Mapping[Hold, Hold] = {"linear": "backward", "backward": "linear"}
LABORATORY = "virtual laboratory (PyBaMM)"
"""Source of a record that was simulated, not measured."""


SLOW_SAMPLING_S = 5.0
"""Rows further apart than this are a logger's, which writes at the end of an interval; closer ones hardly differ."""


def assumed_hold(time_s: Array) -> Hold:
    """How the current runs between rows where nobody says: constant since the row before where rows are far apart."""
    return "backward" if float(np.diff(time_s).max(initial=0.0)) > SLOW_SAMPLING_S else "linear"


def hold_sentence(name: str, hold: Hold, declared: bool, option: str = "--hold {}", *, why: str = "") -> str:
    """A sentence on the hold that was used.

    option : how a user sets another hold, with {} in its place.  why : clause, why it was taken if nobody declared it;
    empty where nothing but the rows' distance says.
    """
    taken = f"the current is taken {'as ' if hold == 'linear' else ''}{HOLD_WORDS[hold]}"
    if declared:
        return f"{name}: {taken}, as declared."
    reason = why or ("as loggers write" if hold == "backward" else "")
    return f"{name}: {', '.join(filter(None, (taken, reason)))}; {option.format(OTHER_HOLD[hold])} takes it otherwise."


@dataclass(frozen=True)
class InferredHold:
    """The hold of a record that declares none.

    hold : how the current runs.  reason : clause, why it is not the assumed one.
    """

    hold: Hold
    reason: str


def measured_on_case(temperature_degc: Array) -> bool:
    """True where this temperature column (n,) was measured. One that never changes was stated: a chamber's set point,
    or an assumed temperature."""
    return bool(np.ptp(temperature_degc) > 0.0)


def at_its_temperature(temperature_degc: Array) -> str:
    """A clause on the temperature at which a record with this column (n,) is simulated."""
    low, high = float(np.min(temperature_degc)), float(np.max(temperature_degc))
    if not measured_on_case(temperature_degc):
        return f"at {low:.4g} degC in every row, as stated"
    return f"at its measured temperature, {range_words(f'{low:.1f}', f'{high:.1f}')} degC"


def digest(*arrays: Array | None) -> str:
    """SHA-256 of the bytes of the arrays, 16 hexadecimal digits; None differs from an empty array."""
    sha = hashlib.sha256()
    for array in arrays:
        sha.update(b"|" if array is None else np.ascontiguousarray(array, dtype=float).tobytes())
    return sha.hexdigest()[:16]


def _rows(column: AnyArray) -> str:
    return f"{len(column)} rows" if column.ndim == 1 else f"the shape {column.shape}"


@dataclass(frozen=True, eq=False)
class Measurement:
    """One continuous test of one cell; lists and pandas columns are converted to arrays of floats, arrays are copied.

    time_s, current_a, voltage_v : (n,) s (strictly increasing), A (discharge positive), V (NaN where it is unknown).
    temperature_degc : (n,) degC, or one value for all rows; None where it was not measured.
    notes : what a reader dropped, mapped or resampled, one sentence each.
    hold : declared course of the current between rows, or None; `hold_taken` says how it is taken then.
    examined_digest : content hash of the rows that a reader examined; empty where none did.
    soc0 : state of charge at the first row, 0 to 1, where it is known; None where the voltage has to tell.
    """

    time_s: Array
    current_a: Array
    voltage_v: Array
    temperature_degc: Array | None = None
    name: str = "measurement"
    source: str = ""
    notes: tuple[str, ...] = ()
    hold: Hold | None = None
    examined_digest: str = ""
    soc0: float | None = None

    if TYPE_CHECKING:  # what is given need not be arrays yet

        def __init__(
            self,
            time_s: Numbers,
            current_a: Numbers,
            voltage_v: Numbers,
            temperature_degc: Numbers | None = None,
            name: str = "measurement",
            source: str = "",
            notes: tuple[str, ...] = (),
            hold: Hold | None = None,
            examined_digest: str = "",
            soc0: float | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        """Raises DataError, naming column and row, for columns that are not numbers or differ in length, for a name
        that is no text, for an unknown hold, and for a soc0 that is no state of charge."""
        if not isinstance(self.name, str):
            raise DataError(
                f"the name of a measurement is {self.name!r}, which is no text; leave it out, or give one."
            )
        if self.hold is not None:
            self._check_hold(self.hold, ", or leave it out")
        if self.soc0 is not None and not (is_finite_number(self.soc0) and 0.0 <= self.soc0 <= 1.0):
            raise DataError(
                f"{self.name}: soc0 = {in_words(self.soc0)} is no state of charge; give one from 0 (empty) to 1 (full)."
            )
        for label in ("time_s", "current_a", "voltage_v"):
            if getattr(self, label) is None:
                raise DataError(
                    f"{self.name}: {label} is None; give one row of numbers, NaN for unknown voltages."
                )
        columns = {
            label: numbers(getattr(self, label), f"{self.name}: {label}")
            for label in ("time_s", "current_a", "voltage_v", "temperature_degc")
            if getattr(self, label) is not None
        }
        time = columns["time_s"]
        if "temperature_degc" in columns and not columns["temperature_degc"].ndim:
            columns["temperature_degc"] = np.full(time.shape, columns["temperature_degc"])
        for label, column in columns.items():
            if label != "voltage_v":  # which may be unknown
                check_row(column, f"{self.name}: {label}")
            if column.shape != time.shape:
                raise DataError(f"{self.name}: {label} has {_rows(column)}, time_s has {_rows(time)}.")
            object.__setattr__(self, label, np.array(column))  # its own, whatever becomes of what was given
        check_times(time, f"{self.name}: time_s")

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def hold_taken(self) -> Hold:
        """How the current is taken to run between rows: as declared, else as `assumed_hold` says; a profile without a
        voltage, which no logger wrote, in straight lines."""
        lone = not np.isfinite(self.voltage_v).any()
        return self.hold or ("linear" if lone else assumed_hold(self.time_s))

    @property
    def charge_ah(self) -> float:
        """Charge taken out over the record, Ah, with the current as `hold_taken` between rows."""
        return float(self.steps_as(self.hold_taken).sum()) / SECONDS_PER_HOUR

    def discharged_ah(self, hold: Hold) -> Array:
        """(n,) Ah, charge taken out since the first row, minus the charge put in.

        Exact for a current that runs as `hold` says. This matters where rows are minutes apart: straight lines turn a
        pulse into a triangle.  Raises DataError for an unknown hold.
        """
        return np.concatenate([[0.0], np.cumsum(self.steps_as(hold))]) / SECONDS_PER_HOUR

    def steps_as(self, hold: Hold) -> Array:
        """(n - 1,) A s, charge taken out between rows; `discharged_ah` is their sum.  Raises DataError for an unknown
        hold."""
        self._check_hold(hold)
        mean = self.current_a[1:] if hold == "backward" else 0.5 * (self.current_a[1:] + self.current_a[:-1])
        return mean * np.diff(self.time_s)

    def _check_hold(self, hold: Hold, otherwise: str = "") -> None:
        if hold not in get_args(Hold):
            words = " or ".join(map(repr, get_args(Hold)))
            raise DataError(f"{self.name}: hold = {in_words(hold)} is not known; give {words}{otherwise}.")

    def __repr__(self) -> str:
        warm = "" if self.temperature_degc is None else ", with temperature"
        return f"Measurement({self.name!r}, {extent(self.time_s)}{warm})"

    def to_frame(self) -> pd.DataFrame:
        """The columns as a table, one row per sample; the temperature only where it was measured."""
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
        return over_time(self.time_s, panels, held=("current",) if self.hold_taken == "backward" else ())

    @property
    def digest(self) -> str:
        """Content hash of the four columns."""
        return digest(self.time_s, self.current_a, self.voltage_v, self.temperature_degc)

    @property
    def was_examined(self) -> bool:
        """True where a reader examined exactly these rows; a part of them, or a changed current, has to be examined
        again."""
        return self.examined_digest == self.digest

    @property
    def file_digest(self) -> str:
        """Content hash of the rows as they were read, also of a record that was thinned or cut since; of the rows
        themselves where no reader examined them."""
        return self.examined_digest or self.digest

    def held(self, hold: Hold | None) -> Measurement:
        """The record with this hold as the declared one; None declares none."""
        return replace(self, hold=hold)

    def begun_at(self, soc0: float | None) -> Measurement:
        """The record with this state of charge at its first row, 0 to 1, as the known one; None knows none."""
        return replace(self, soc0=soc0)

    def take(self, rows: slice | Array) -> Measurement:
        """The given rows, as a measurement of the same name; of a known state of charge at the first row only where
        that row is among them."""
        temperature = None if self.temperature_degc is None else self.temperature_degc[rows]
        time = self.time_s[rows]
        begins = bool(len(time)) and time[0] == self.time_s[0]
        return replace(
            self,
            time_s=time,
            current_a=self.current_a[rows],
            voltage_v=self.voltage_v[rows],
            temperature_degc=temperature,
            soc0=self.soc0 if begins else None,
        )

    def between(self, start_s: float, stop_s: float) -> Measurement:
        """The rows with start_s <= time_s < stop_s.  Raises DataError where there is none."""
        bounds = numbers([start_s, stop_s], f"{self.name}: start_s or stop_s")
        low, high = np.searchsorted(self.time_s, bounds)
        if np.isnan(bounds).any() or low >= high:
            runs = (
                f" It runs from {stamp(self.time_s[0])} to {stamp(self.time_s[-1])} s." if len(self) else ""
            )
            raise DataError(f"{self.name} has no row from {bounds[0]:g} s up to {bounds[1]:g} s.{runs}")
        return self.take(slice(int(low), int(high)))


Measurement.__init__ = of_columns(Measurement.__init__)  # type: ignore[method-assign]


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One impedance spectrum of a cell at rest; lists and columns of a table are converted to arrays.

    frequency_hz : (n,) Hz, at least one.  z_ohm : (n,) ohm, the imaginary part negative where capacitive.
    soc or discharged_ah (Ah since full) : the state of charge.  temperature_degc, voltage_v : None where not measured.
    """

    name: str
    frequency_hz: Array
    z_ohm: ComplexArray
    soc: float | None = None
    discharged_ah: float | None = None
    voltage_v: float | None = None
    temperature_degc: float | None = None

    if TYPE_CHECKING:  # what is given need not be arrays yet

        def __init__(
            self,
            name: str,
            frequency_hz: Numbers,
            z_ohm: Numbers,
            soc: float | None = None,
            discharged_ah: float | None = None,
            voltage_v: float | None = None,
            temperature_degc: float | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        """Raises DataError for frequencies and impedances that are not finite numbers, differ in length, or are none,
        and for a frequency or an |Z| that is not above 0."""
        frequency = numbers(self.frequency_hz, f"{self.name}: frequency_hz")
        z = complex_numbers(self.z_ohm, f"{self.name}: z_ohm")
        for label, part in (("frequency_hz", frequency), ("z_ohm", z.real), ("z_ohm", z.imag)):
            check_row(part, f"{self.name}: {label}")
        if frequency.shape != z.shape:
            raise DataError(f"{self.name}: z_ohm has {_rows(z)}, frequency_hz has {_rows(frequency)}.")
        if not len(frequency):
            raise DataError(f"{self.name} has no frequency; a spectrum needs at least one.")
        for label, size, unit in (("frequency_hz", frequency, "Hz"), ("|Z|", np.abs(z), "ohm")):
            if not (size > 0.0).all():
                row = int(np.argmin(size > 0.0))
                raise DataError(
                    f"{self.name}: {label} is {size[row]:g} {unit} in {row_words(row)}; it has to be above 0."
                )
        object.__setattr__(self, "frequency_hz", np.array(frequency))
        object.__setattr__(self, "z_ohm", z)

    @property
    def digest(self) -> str:
        """Content hash of frequencies and impedance."""
        return digest(self.frequency_hz, self.z_ohm.real, self.z_ohm.imag)

    def __repr__(self) -> str:
        across = range_words(f"{self.frequency_hz.min():.3g}", f"{self.frequency_hz.max():.3g}")
        return f"Spectrum({self.name!r}, {len(self.frequency_hz)} points, {across} Hz)"

    def to_frame(self) -> pd.DataFrame:
        """Frequency and impedance as a table, one row a point."""
        import pandas as pd

        real, imag = self.z_ohm.real, self.z_ohm.imag
        return pd.DataFrame({"frequency_hz": self.frequency_hz, "z_real_ohm": real, "z_imag_ohm": imag})
