"""The sparse model of the voltage error, e[k + 1] = Theta(e[k], U[k]) xi, the paper's equation (8).

A model without terms in the error predicts it from the inputs alone, g(U[k]). Its residual is autocorrelated, so a
measured error improves the prediction of the next ones; `memory` is the lag-one autoregression coefficient of that
residual, and then

    e[k + 1] = g(U[k]) + memory (e[k] - g(U[k - 1]))

which is stable, as memory < 1. (At the start of a record g(U[0]) replaces g(U[-1]), and also the first error where that
was not measured. A model with terms in the error then begins with zero error.)

The model works in scaled variables (scaling.py). Inputs outside the trained range are held at its edge and flagged in
`FreeRun.outside`; a prediction ten times beyond the trained range of the error is a divergence. (A measured first error
may lie there in a model without terms in the error, since it is not fed back and decays.) `reach` gives, for bands, how
far the prediction would move if the terms continued beyond the edge with their slope there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from aesi.errors import DataError
from aesi.numerics.files.restored import reading_back, saved_array, saved_number
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records import ErrorSeries, FreeRun
from aesi.records.checked import checked_dt
from aesi.sparse import free_run
from aesi.sparse.fade import Fade
from aesi.sparse.leverage import Leverage
from aesi.sparse.terms.inputs import model_variables
from aesi.sparse.terms.library import Library, evaluate_terms
from aesi.sparse.terms.scaling import Scaling

SCHEMA = "aesi.sparse_model/7"


@dataclass(frozen=True, eq=False)
class SparseModel:
    """Active terms and their coefficients, in scaled variables.

    library : the active terms, over the error and the inputs.  coefficients : (m,), none of them zero.
    dt_s : sampling interval of the training records, s; the model is a map over one such step.
    memory : see above; 0 for a model with terms in e.
    inclusion : (m,) share of the ensemble's members that hold each term.
    low, high : (m,) 5th and 95th percentile of each coefficient over the ensemble's members.
    leverage : of the fit. Bands of a free run need it; a `fade` uses it too, and then shrinks the correction further.
    fade : shrinkage towards the physics, for a model without terms in e; None for no shrinkage.
    """

    name: str
    library: Library
    coefficients: Array
    scaling: Scaling
    dt_s: float
    memory: float = 0.0
    inclusion: Array | None = None
    low: Array | None = None
    high: Array | None = None
    leverage: Leverage | None = None
    fade: Fade | None = None

    def __repr__(self) -> str:
        return f"SparseModel({self.name!r}, {len(self.terms)} terms, step {self.dt_s:g} s)"

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the active terms."""
        return self.library.names

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the model's inputs; inputs that a record lacks are derived where possible."""
        return self.library.variables[1:]

    def named(self, name: str) -> SparseModel:
        """The same model under another name."""
        return replace(self, name=name)

    def coefficient_table(self) -> dict[str, float]:
        """Name of each term -> coefficient, in scaled variables."""
        return dict(zip(self.terms, self.coefficients.tolist(), strict=True))

    def inclusion_table(self) -> dict[str, float]:
        """Name of each term -> share of the ensemble's members that hold it; empty where that is not known."""
        if self.inclusion is None:
            return {}
        return dict(zip(self.terms, self.inclusion.tolist(), strict=True))

    @property
    def has_feedback(self) -> bool:
        """Whether any term holds the error."""
        return bool(self._error_functions.any())

    def one_step(self, series: ErrorSeries) -> Array:
        """(n,) V: the prediction of error_v[k] given error_v[k - 1]; the first is the measured error_v[0]."""
        return self.k_step(series, 1)

    def free_run(self, series: ErrorSeries, error0_v: float | None = None) -> FreeRun:
        """Prediction of the whole record without measured errors after the first.

        error0_v : initial error, V; None takes the measured error_v[0], or the value by the inputs where that is NaN.
        """
        start_v = float(series.error_v[0]) if error0_v is None else error0_v
        variables = self._variables(series)
        error_v, diverged = self._free_run_from(self._drive(variables, series), start_v)
        variables[:, 0] = error_v
        return FreeRun(
            error_v,
            None if diverged < 0 else diverged + 1,
            self.scaling.is_outside(variables),
            self._leverage_excess(variables),
        )

    def k_step(self, series: ErrorSeries, steps: int) -> Array:
        """(n,) V: the prediction of error_v[k] given error_v[k - steps]; the first ones from error_v[0].

        steps : whole number, at least 1.  Raises DataError for any other.
        """
        free_run.check_steps(self.name, steps)
        return self._predicted_ahead(self._drive(self._variables(series), series), series.error_v, steps)

    def reach(self, series: ErrorSeries, steps: int | None = None, error0_v: float | None = None) -> Array:
        """(n,) V, >= 0: change of the prediction if inputs were not held at the edge of their trained range, but the
        terms continued beyond it with their slope there.

        steps : for a prediction so many samples ahead (`k_step`); None for a `free_run`.  error0_v : as there.
        """
        variables = self._variables(series)
        overshoot = self.scaling.cut_off(variables)
        if not overshoot[:, 1:].any():
            return np.zeros(len(series))
        start_v = float(series.error_v[0]) if error0_v is None else error0_v
        held, extrapolated = (
            self._free_run_from(drive, start_v)[0]
            if steps is None
            else self._predicted_ahead(drive, series.error_v, steps)
            for drive in (self._drive(variables, series), self._drive(variables, series, overshoot))
        )
        return np.abs(extrapolated - held)

    def outside(self, series: ErrorSeries) -> BoolArray:
        """(n,) True where an input or the measured error lies outside the trained range."""
        return self.scaling.is_outside(self._variables(series))

    def kept(self, series: ErrorSeries) -> Array:
        """(n,) share of the correction that is applied along a record, w of fade.py; 1 where it does not fade, 0 of one
        that helped on no left-out drive (amplitude 0)."""
        if self.fade is None:
            return np.ones(len(series))
        if self.fade.amplitude == 0.0:
            return np.zeros(len(series))
        return self.fade.kept(*self._fade_inputs(self._variables(series), series))

    def to_dict(self) -> dict[str, Any]:
        """Plain values, and an array in the leverage. Terms are given by their factors (variable, function) and, for
        readers, by name."""
        return {
            "schema": SCHEMA,
            "name": self.name,
            "variables": list(self.library.variables),
            "terms": [[list(factor) for factor in term.factors] for term in self.library.terms],
            "term_names": list(self.terms),
            "coefficients": self.coefficients.tolist(),
            "scaling": self.scaling.to_dict(),
            "dt_s": self.dt_s,
            "memory": self.memory,
            "leverage": None if self.leverage is None else self.leverage.to_dict(),
            "fade": None if self.fade is None else self.fade.to_dict(),
        } | {
            key: None if values is None else values.tolist()
            for key, values in (("inclusion", self.inclusion), ("low", self.low), ("high", self.high))
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> SparseModel:
        """Inverse of `to_dict`. Raises DataError for anything else."""
        with reading_back("sparse model", DataError):
            if data.get("schema") != SCHEMA:
                raise DataError(
                    f"not a sparse model of this version: schema is {data.get('schema')!r}, expected {SCHEMA!r}; "
                    "run the experiment again."
                )
            library = Library.of_saved(data["variables"], data["terms"])
            m, n = len(library), len(library.variables)
            leverage, fade = data["leverage"], data["fade"]
            optional = {
                key: None if data[key] is None else saved_array(data[key], key, (m,))
                for key in ("inclusion", "low", "high")
            }
            return cls(
                str(data["name"]),
                library,
                saved_array(data["coefficients"], "coefficients", (m,)),
                Scaling.from_dict(data["scaling"], n),
                checked_dt(data["dt_s"]),
                saved_number(data["memory"], "memory", 0.0, 1.0),
                **optional,
                leverage=None if leverage is None else Leverage.from_dict(leverage, m),
                fade=None if fade is None else Fade.from_dict(fade, n - 1),
            )

    @cached_property
    def _error_functions(self) -> IntArray:
        return np.unique(self.library.feedbacks)

    def _variables(self, series: ErrorSeries) -> Array:
        return model_variables(series, self.input_names, self.dt_s)

    def _leverage_excess(self, variables: Array) -> Array | None:
        if self.leverage is None:
            return None
        return self.leverage.excess(evaluate_terms(self.library.terms, self.scaling.apply(variables)))

    def _free_run_from(self, drive: Array, start_v: float) -> tuple[Array, int]:
        """(free run (n,) V, index at which the scaled run diverged or -1).  start_v : initial error, V; NaN where it is
        not known."""
        start = self._start_by_inputs_v(drive) if np.isnan(start_v) else start_v
        scaled0 = float(self.scaling.error_to_scaled(np.array(start)))
        if self.has_feedback:
            scaled, diverged = free_run.run_with_feedback(drive[:, :-1], self._error_functions, scaled0)
        else:
            by_inputs = drive[0, :-1]
            scaled, diverged = free_run.held_at_divergence(
                free_run.autoregressive_run(by_inputs, self.memory, scaled0), by_inputs, scaled0
            )
        return np.append(start, self.scaling.error_to_volts(scaled)), diverged

    def _start_by_inputs_v(self, drive: Array) -> float:
        """The error at the first sample of a record without a measured error, V."""
        return 0.0 if self.has_feedback else float(self.scaling.error_to_volts(drive[0, :1])[0])

    def _predicted_ahead(self, drive: Array, error_v: Array, steps: int) -> Array:
        """(n,) V, each predicted from the measured error `steps` samples earlier."""
        measured = self.scaling.error_to_scaled(error_v)
        if self.has_feedback:
            scaled = free_run.ahead_with_feedback(drive[:, :-1], self._error_functions, measured, steps)
        else:
            scaled = free_run.autoregressive_ahead(drive[0, :-1], self.memory, measured, steps)
        return np.append(error_v[:1], self.scaling.error_to_volts(scaled))

    def _drive(self, variables: Array, series: ErrorSeries, overshoot: Array | None = None) -> Array:
        """(n_functions, n): for each function of the error, the sum of its terms' input parts.  overshoot : as for
        `evaluate_terms`."""
        products = evaluate_terms(
            [term.without_error() for term in self.library.terms], self.scaling.apply(variables), overshoot
        )
        drive = np.stack(
            [
                self.coefficients[of_function] @ products[of_function]
                for of_function in (self.library.feedbacks == q for q in self._error_functions)
            ]
        )
        return drive if self.fade is None else self._fade_weight(variables, series) * drive

    def _fade_weight(self, variables: Array, series: ErrorSeries) -> Array:
        """(n,) weight of the correction, a w of fade.py."""
        assert self.fade is not None
        return self.fade.weight(*self._fade_inputs(variables, series))

    def _fade_inputs(
        self, variables: Array, series: ErrorSeries
    ) -> tuple[Array, Array, Array | None, Array | None]:
        """The arguments of `Fade.weight` for each row: inputs that are not clipped, state of charge, temperature in
        degC, and excess leverage."""
        not_clipped = self.scaling.apply(variables) + self.scaling.cut_off(variables)
        return not_clipped[:, 1:], series.soc, series.temperature_degc, self._leverage_excess(variables)
