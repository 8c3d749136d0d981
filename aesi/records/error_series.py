"""The voltage error over a record, what may drive it, and what every model of it offers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from aesi.errors import InputError
from aesi.numerics.typing import Array, BoolArray
from aesi.over_time import extent
from aesi.records.horizons import steps_ahead
from aesi.records.measurement import digest
from aesi.records.steps import known_by, rows_until

INPUT_NAMES = ("I", "c_sp", "c_sn", "c_e0", "c_eL")
"""The inputs U of the sparse model, in the paper's order."""


@dataclass(frozen=True, eq=False)
class ErrorSeries:
    """The voltage error over one continuous, evenly sampled record, and what may drive it.

    error_v : (n,) V, V_measured - V_model.  inputs : (n, n_inputs) SI, columns `input_names`.
    soc : (n,).  model_v : (n,) V, the physics model's voltage (so V_measured = model_v + error_v).
    physics : name -> (n,) V, what other physics models say of the same record, for comparison.
    temperature_degc : (n,) of the cell, as measured, else as the physics had it; None where neither is known.
    slopes_v : (n, k) V, change of the physics model's voltage by one prior standard deviation of each of k parameters;
    None where not computed.
    start_v : (n,) V, >= 0, change of it by one standard deviation of the initial state of charge, where that was read
    from a voltage; None elsewhere.
    missed_v : V, error of the physics model that a recalibration allowed for; it scales what the rows leave open of the
    parameters. None without a recalibration.
    ran_out_s : s, time from which the physics model, or another one of `physics`, is held at the limit of depletion, so
    that the error means nothing. None where none of them ran out, or where that is not known.
    own : the error over the record's own rows, at their times, where these are not the stamps but between them or
    denser; the values at a stamp are interpolated or averages then. None where the rows are the stamps.
    current_beside_a : (n,) A, discharge positive, where the current is none of the inputs; None where it is one.
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
    temperature_degc: Array | None = None
    slopes_v: Array | None = None
    missed_v: float | None = None
    ran_out_s: float | None = None
    start_v: Array | None = None
    own: ErrorSeries | None = None
    current_beside_a: Array | None = None

    def __len__(self) -> int:
        return len(self.error_v)

    def __repr__(self) -> str:
        return f"ErrorSeries({self.name!r}, {extent(self.time_s)}, inputs {', '.join(self.input_names)})"

    @property
    def current_a(self) -> Array:
        """(n,) A, discharge positive.  Raises InputError for a record without a current."""
        if "I" in self.input_names:
            return self.inputs[:, self.input_names.index("I")]
        if self.current_beside_a is None:
            raise InputError(
                f"{self.name} has no current: I is none of its inputs, and nothing stands beside them."
            )
        return self.current_beside_a

    @property
    def collector_mol_m3(self) -> Array | None:
        """(n,) mol/m3, the lower one of the salt concentrations at the two collectors; None without these inputs."""
        at = [self.input_names.index(name) for name in ("c_e0", "c_eL") if name in self.input_names]
        return self.inputs[:, at].min(axis=1) if at else None

    @property
    def degc_or_nan(self) -> Array:
        """(n,) degC of the cell, NaN where it is not known."""
        return np.full(len(self), np.nan) if self.temperature_degc is None else self.temperature_degc

    def steps(self, horizon_s: float) -> int:
        """Number of steps in a horizon (s).  Raises InputError for a horizon that the step does not
        divide."""
        return steps_ahead(horizon_s, self.dt_s)

    @property
    def digest(self) -> str:
        """Content hash of error and inputs."""
        return digest(self.error_v, self.inputs)

    @property
    def before_depletion(self) -> BoolArray:
        """(n,) True for the rows before `ran_out_s`, all where no physics model ran out."""
        return self.time_s < (np.inf if self.ran_out_s is None else self.ran_out_s)

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
            temperature_degc=None if self.temperature_degc is None else self.temperature_degc[rows],
            slopes_v=None if self.slopes_v is None else self.slopes_v[rows],
            start_v=None if self.start_v is None else self.start_v[rows],
            current_beside_a=None if self.current_beside_a is None else self.current_beside_a[rows],
            own=self._own_of(rows),
        )

    def _own_of(self, rows: slice) -> ErrorSeries | None:
        """`own` of a piece: the own rows in its steps, and the last one before its first stamp where none is in that
        step."""
        start, stop, _ = rows.indices(len(self))
        if self.own is None or stop <= start:
            return None
        if (start, stop) == (0, len(self)):
            return self.own
        until = np.append(0, rows_until(self.own.time_s, self.time_s))
        return self.own.take(slice(min(int(until[start]), int(until[start + 1]) - 1), int(until[stop])))

    @property
    def with_known_error(self) -> ErrorSeries:
        """The record with the error at each stamp that is known from the own rows until there (`known_by`): what a
        prediction that starts there may use. Itself where the rows are the stamps."""
        if self.own is None:
            return self
        return replace(self, error_v=known_by(self.own.time_s, self.own.error_v, self.time_s))

    def left_by(self, name: str) -> Array:
        """(n,) V, error of the named physics model, measured minus simulated; `error_v` itself for an unknown name."""
        other = self.physics.get(name)
        return self.error_v if other is None else self.error_v + self.model_v - other


@dataclass(frozen=True, eq=False)
class FreeRun:
    """A prediction without measured voltage after its start.

    error_v : (n,) V, the predicted error; held at its last value inside the range after a divergence.
    diverged_at : the first sample at which the prediction left ten times the trained range, or None.
    outside : (n,) True where an input lies outside the range the model was trained on.
    excess : (n,) how far the sample lies from what the model was fitted to, 0 where not at all: of the root of its
    leverage, in units of that of the fitted rows (`aesi.sparse.leverage`); None where the model cannot tell.
    """

    error_v: Array
    diverged_at: int | None
    outside: BoolArray
    excess: Array | None = None


class ErrorModel(Protocol):
    """The interface of every model of the voltage error: sparse ensembles, baselines, the bare ESPM (zero)."""

    @property
    def name(self) -> str:
        """Its name in tables."""
        ...

    def one_step(self, series: ErrorSeries) -> Array:
        """(n,) V: the prediction of error_v[k] given the measured error_v[k - 1]; the first is error_v[0]."""
        ...

    def free_run(self, series: ErrorSeries, error0_v: float | None = None) -> FreeRun:
        """Prediction from `error0_v` with its own feedback only; by default from the measured error_v[0], and where
        that is NaN from what the inputs give."""
        ...

    def k_step(self, series: ErrorSeries, steps: int) -> Array:
        """(n,) V: the prediction of error_v[k] given error_v[k - steps] and the inputs since; first
        `steps` values as in a free run from the first sample."""
        ...
