"""Errors of the declared, recalibrated and written model on every file as measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from aesi.errors import AesiError
from aesi.numerics.blocks import INTERVAL_BLOCKS, resampled_interval
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.physics.depletion import ran_out
from aesi.records import Hold, Run
from aesi.tracer.case.records import PreparedRecord
from aesi.tracer.likelihood.model_state import ModelState

State = Literal["before", "recalibrated", "after"]
STATES: tuple[State, ...] = get_args(State)
Part = Literal["fit", "test"]
States = Mapping[State, ModelState]
NAMES: Mapping[State, str] = {
    "before": "the declared model",
    "recalibrated": "the recalibrated model",
    "after": "the written model",
}

RESAMPLES = 4000
"""Bootstrap resamples: the ends of a 95 % interval are then known to a quarter of a percentile."""


@dataclass(frozen=True)
class Errors:
    """Errors of a voltage, V: root mean square, mean absolute, largest."""

    rmse_v: float
    mae_v: float
    max_v: float

    @classmethod
    def of(cls, residual_v: Array) -> Errors:
        """From residuals (n,) V."""
        size = np.abs(residual_v)
        return cls(rms(size), float(size.mean()), float(size.max()))


@dataclass(frozen=True, eq=False)
class FileOutcome:
    """The models on one part of one file.

    soc : (n,) state of charge in the written model or, where it cannot be simulated here, in the first that can be; NaN
    where none can.
    voltages : state -> (n,) V, NaN where that model cannot be simulated on this part.  unsimulated : state -> why it
    cannot.  noise_v : standard deviation of the measured voltage's noise, V.  gain_v : RMSE of `recalibrated` minus
    that of `after`, with its 95 % block-bootstrap interval, V; NaN where one of them has no voltage.  emptied_s : state
    -> time at which its simulation ran out of lithium or salt, s; only states that did.
    start_slope_v : (n,) V, change of the voltage of `after` by one standard deviation of an initial state that was not
    fitted; None where it was fitted, or `after` cannot be simulated with it.  at_its_temperature : whether the record
    has a temperature.  hold : how its current was taken to run between its rows.
    """

    name: str
    part: Part
    time_s: Array
    current_a: Array
    soc: Array
    measured_v: Array
    noise_v: float
    voltages: Mapping[State, Array]
    gain_v: tuple[float, float, float]
    emptied_s: Mapping[State, float] = field(default_factory=dict)
    start_slope_v: Array | None = None
    unsimulated: Mapping[State, str] = field(default_factory=dict)
    at_its_temperature: bool = False
    hold: Hold = "linear"

    def residual_v(self, state: State) -> Array:
        """(n,) V, measured - model."""
        return self.measured_v - self.voltages[state]

    def beyond_start_v(self) -> Array:
        """(n,) V, residual of `after` once the initial state is refitted within its uncertainty."""
        left = self.residual_v("after")
        if self.start_slope_v is None:
            return left
        known = float(self.start_slope_v @ self.start_slope_v) + self.noise_v**2
        return np.asarray(left - self.start_slope_v * float(self.start_slope_v @ left) / known)

    def errors(self, state: State) -> Errors | None:
        """Errors of a state; None where it cannot be simulated."""
        return None if state in self.unsimulated else Errors.of(self.residual_v(state))


def outcomes(
    records: Sequence[PreparedRecord],
    states: States,
    tests: Sequence[PreparedRecord],
    rng: np.random.Generator,
) -> tuple[FileOutcome, ...]:
    """The models on every file, fit part and test part apart."""
    out = []
    for index, record in enumerate(records):
        runs = {name: _simulated(state, record, index) for name, state in states.items()}
        cut = record.n_fit_whole
        out.append(_outcome(record, "fit", slice(0, cut), runs, rng))
        if cut < len(record.data):
            out.append(_outcome(record, "test", slice(cut, len(record.data)), runs, rng))
    for record in tests:
        runs = {name: _simulated(state, record, None) for name, state in states.items()}
        rows = slice(record.lead_rows, len(record.data))
        found = _outcome(record, "test", rows, runs, rng)
        slope_v = None
        if record.continues is None:  # else it starts at the fitted state of the record that it continues
            with suppress(AesiError):
                slope_v = states["after"].start_slope_v(record)[rows]
        out.append(replace(found, start_slope_v=slope_v))
    return tuple(out)


@dataclass(frozen=True, eq=False)
class _Simulated:
    """A simulation over the rows of a record.

    voltage_v, soc : (n,), NaN from the row on where it fails.  empty : (n,) True where lithium or salt ran out.
    why : a sentence on the failure; '' where there is none.
    """

    voltage_v: Array
    soc: Array
    empty: BoolArray
    why: str


def _simulated(state: ModelState, record: PreparedRecord, index: int | None) -> _Simulated:
    """A simulation over a record, or over its fit part alone where it fails beyond that."""
    n = len(record.data)
    try:
        return _padded(state.simulated(record, index, thin=False), n, "")
    except AesiError as error:
        why = str(error)
    fitted = 0 if index is None else record.n_fit_whole
    if 0 < fitted < n:
        seen = replace(record, data=record.data.take(slice(0, fitted)))
        with suppress(AesiError):
            return _padded(state.simulated(seen, index, thin=False), n, why)
    return _Simulated(np.full(n, np.nan), np.full(n, np.nan), np.zeros(n, dtype=bool), why)


def _padded(run: Run, n: int, why: str) -> _Simulated:
    rest = n - len(run)
    voltage_v, soc = (np.append(v, np.full(rest, np.nan)) for v in (run.voltage_v, run.series["soc"]))
    return _Simulated(
        voltage_v, soc, np.append(run.series["depleted"] > 0.0, np.zeros(rest, dtype=bool)), why
    )


def _outcome(
    record: PreparedRecord,
    part: Part,
    rows: slice,
    runs: Mapping[State, _Simulated],
    rng: np.random.Generator,
) -> FileOutcome:
    data = record.data.take(rows)
    voltages = {s: run.voltage_v[rows] for s, run in runs.items()}
    unsimulated = {s: runs[s].why for s, voltage_v in voltages.items() if not np.isfinite(voltage_v).all()}
    gain = (np.nan, np.nan, np.nan)
    if unsimulated.keys().isdisjoint(("recalibrated", "after")):
        gain = rmse_difference(
            data.voltage_v - voltages["recalibrated"], data.voltage_v - voltages["after"], rng
        )
    emptied_s = {
        state: float(data.time_s[np.argmax(empty)])
        for state, run in runs.items()
        if np.any(empty := run.empty[rows])
    }
    told: State = next((state for state in ("after", *STATES) if state not in unsimulated), "after")
    return FileOutcome(
        record.name,
        part,
        data.time_s,
        data.current_a,
        runs[told].soc[rows],
        data.voltage_v,
        record.noise_full_v,
        voltages,
        gain,
        emptied_s,
        unsimulated=unsimulated,
        at_its_temperature=data.temperature_degc is not None,
        hold=record.hold,
    )


def depletion_notes(files: Sequence[FileOutcome]) -> tuple[str, ...]:
    """A sentence for each file on which a model ran out of lithium or salt, after which its voltage is meaningless."""
    first: dict[str, dict[State, float]] = {}
    for f in files:
        for state, at_s in f.emptied_s.items():
            first.setdefault(f.name, {}).setdefault(state, at_s)
    return tuple(
        ran_out(name, {NAMES[state]: at_s for state, at_s in states.items()})
        for name, states in first.items()
    )


def rmse_difference(first_v: Array, second_v: Array, rng: np.random.Generator) -> tuple[float, float, float]:
    """RMSE of `first_v` minus that of `second_v`, with the 95 % interval of a moving-block bootstrap, V; NaN for fewer
    than two rows."""
    n = len(first_v)
    if n < 2:
        return np.nan, np.nan, np.nan
    block = max(n // INTERVAL_BLOCKS, 1)
    sums = [np.concatenate([[0.0], np.cumsum(e**2)]) for e in (first_v, second_v)]
    starts = rng.integers(0, n - block + 1, size=(RESAMPLES, -(-n // block)))
    means = [(s[starts + block] - s[starts]).sum(axis=1) / (starts.shape[1] * block) for s in sums]
    low, high = resampled_interval(np.sqrt(means[0]) - np.sqrt(means[1]), starts.shape[1], 0.95)
    value = Errors.of(first_v).rmse_v - Errors.of(second_v).rmse_v
    return value, low, high


def held_out_rmse_v(
    state: ModelState, records: Sequence[PreparedRecord], tests: Sequence[PreparedRecord]
) -> float | None:
    """RMSE on the test data, thinned, V; None where there are none."""
    parts = [_residual_v(state, record, None)[record.lead_rows_thin :] for record in tests]
    for index, record in enumerate(records):
        if record.n_fit < len(record.thin):
            parts.append(_residual_v(state, record, index)[record.n_fit :])
    held_out = [part for part in parts if len(part)]
    return rms(np.concatenate(held_out)) if held_out else None


def _residual_v(state: ModelState, record: PreparedRecord, index: int | None) -> Array:
    """(n_thin,) V, measured - model, of a thinned record.  index : its place among the fitted ones, or None."""
    return np.asarray(record.thin.voltage_v - state.simulated(record, index, thin=True).voltage_v)
