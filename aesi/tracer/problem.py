"""What all hypotheses of one case share: the cell, the records, the tolerances, and one way to simulate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from aesi.errors import AesiError
from aesi.numerics.noise.coloured import ColouredNoise, whiten
from aesi.numerics.typing import Array
from aesi.parameters import Parameter
from aesi.physics import simulate
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Effect
from aesi.records import Hold, Measurement, Run
from aesi.tracer.cycler_zero import ZERO, is_slow, zero_knob
from aesi.tracer.knobs import SOC0, Knob, free_knobs, soc_knob, tolerated_knob, values_by_owner
from aesi.tracer.records import Record
from aesi.tracer.stepping import stepping

TOLERANCES: Mapping[str, Mapping[str, float] | float] = {
    "solid_diffusivity": 0.03,
    "voltage_sensor_offset": 3e-4,
}
"""What a good parametrisation and a good voltmeter leave open: relative on logarithmic parameters, else in
the
parameter's unit. Every hypothesis may use it, so that none is found for it."""

LOOSENED: Mapping[str, Mapping[str, float]] = {
    "concentration_dependent_diffusivity": {"solid_diffusivity": 0.7},
    "lithium_inventory_loss": {SOC0: 0.02},
}
"""Tolerances that an effect widens: who does not know how a diffusivity runs does not know its level either, and where
the electrodes have shifted against each other, charge, voltage and either electrode give different states of charge."""

Hypothesis = tuple[str, ...]
"""Ids of the effects that are in, in the order in which they were added."""


def needed(effects: Sequence[ActiveEffect], data: Measurement) -> tuple[ActiveEffect, ...]:
    """The effects that have something to say of a record: not those that infer what it holds as a measurement."""
    return tuple(a for a in effects if a.effect.infers is None or data.temperature_degc is None)


@dataclass(frozen=True, eq=False)
class Problem:
    """One case.

    effects : id -> Effect, everything that may be tried.  tolerances : see TOLERANCES.  fixed : effects that
    are in
    every simulation (finer numerics, where the declared ones do not suffice).  nuisances : effects that are there for
    their tolerance alone and do not compete.
    model_error_v : what the model is known to miss (V): fits are then plain least squares at this weight, because a
    residual's memory is the model's fault and not the sensor's. None lets the residual's own memory decide.
    outlier_v : beyond this an error counts by its size and no longer by its square (None: never).
    zero_sd_a : what the zero of the cycler's current is uncertain by; it counts in slow records alone.
    steps : of a descent.  weights : (n_fit of all records,) what rows count in fits, None where all are alike.
    """

    cell: Cell
    records: tuple[Record, ...]
    effects: Mapping[str, Effect]
    tolerances: Mapping[str, Mapping[str, float] | float] = field(default_factory=lambda: dict(TOLERANCES))
    fixed: tuple[ActiveEffect, ...] = ()
    nuisances: frozenset[str] = frozenset()
    model_error_v: float | None = None
    outlier_v: float | None = None
    zero_sd_a: float = 0.0
    steps: int = 8
    weights: Array | None = None

    @property
    def competing(self) -> tuple[str, ...]:
        """Ids of the effects that may be found."""
        return tuple(name for name in self.effects if name not in self.nuisances)

    def parameters(self, effect: str) -> Mapping[str, Parameter]:
        """The declared parameters of an effect."""
        return self.effects[effect].parameters

    def knobs(self, hypothesis: Hypothesis) -> list[Knob]:
        """Tolerated knobs first (states of charge, then tolerances), then the free ones of each effect."""
        wider = {tolerated: sd for name in hypothesis for tolerated, sd in LOOSENED.get(name, {}).items()}
        state_sd = wider.get(SOC0, 0.0)
        knobs = [soc_knob(str(i), r.soc0, max(r.soc0_sd, state_sd)) for i, r in enumerate(self.records)]
        if self.zero_sd_a > 0:
            knobs.append(zero_knob(self.zero_sd_a))
        for effect, tolerance in ({**self.tolerances, **wider}).items():
            if effect in self.effects and effect not in hypothesis:
                for name, p in self.parameters(effect).items():
                    sd = tolerance if isinstance(tolerance, float) else tolerance.get(name)
                    if sd is not None:
                        knobs.append(tolerated_knob(effect, name, p, sd))
        for effect in hypothesis:
            knobs += free_knobs(effect, self.parameters(effect))
        return knobs

    def active(self, values: Mapping[str, Mapping[str, float]]) -> tuple[ActiveEffect, ...]:
        """The effects to simulate with, from owner -> name -> value.

        An effect under test is in even at its neutral point: some say the same thing of a cell in other words there
        (windows by voltages), and a fit must not see a step.
        """
        owners = [owner for owner in values if owner not in (SOC0, ZERO.id)]
        return (*self.fixed, *(self.effects[owner].activate(**values[owner]) for owner in owners))

    def read_by(self, values: Mapping[str, Mapping[str, float]], record: Record) -> tuple[ActiveEffect, ...]:
        """What stood between the current of a slow record and what was written of it; of others it is nothing."""
        zero = values.get(ZERO.id)
        return () if zero is None or not is_slow(self.cell, record) else (ZERO.activate(**zero),)

    def predict(self, knobs: Sequence[Knob], x: Array, only: int | None = None) -> list[Array] | None:
        """Voltage of every record's fit part, (n_fit,) V each, or of one of them; None where the model fails."""
        values = values_by_owner(knobs, x)
        out = []
        try:
            effects = self.active(values)
            for i in range(len(self.records)) if only is None else (only,):
                record = self.records[i]
                seen = record.thin.take(slice(0, record.n_fit))
                known = self.read_by(values, record)
                out.append(self.voltage(seen, values[SOC0][str(i)], (*effects, *known), record.thin_hold))
        except (AesiError, FloatingPointError, ZeroDivisionError, OverflowError):
            return None
        if not all(np.isfinite(v).all() for v in out):
            return None
        return out

    def why_not(self, hypothesis: Hypothesis) -> str:
        """Why a hypothesis cannot be simulated at its typical values: one sentence."""
        record = self.records[0]
        try:
            effects = tuple(self.effects[name].activate() for name in hypothesis)
            self.run(record.thin.take(slice(0, record.n_fit)), record.soc0, effects, record.thin_hold)
        except AesiError as error:
            return str(error)
        return "no start of the fit could be simulated."

    def voltage(self, data: Measurement, soc0: float, effects: tuple[ActiveEffect, ...], hold: Hold) -> Array:
        """(n,) V of one measurement."""
        return self.run(data, soc0, effects, hold).voltage_v

    def run(
        self, data: Measurement, soc0: float | None, effects: tuple[ActiveEffect, ...], hold: Hold,
        rest_voltage_v: float | None = None,
    ) -> Run:  # fmt: skip
        """One simulation, at the measured temperature where there is one; stoichiometries that run out are clipped, so
        that a search is not stopped by them."""
        return simulate(
            self.cell,
            data.time_s,
            data.current_a,
            soc0,
            (*needed(effects, data), *stepping(data)),
            data.temperature_degc,
            hold,
            rest_voltage_v=rest_voltage_v,
            on_depletion="clip",
        )

    @property
    def measured(self) -> Array:
        """(n_fit of all records,) V: what fits see."""
        return np.concatenate([r.thin.voltage_v[: r.n_fit] for r in self.records])

    @property
    def slices(self) -> list[slice]:
        """Rows of each record in `measured`."""
        ends = np.cumsum([r.n_fit for r in self.records])
        return [slice(int(e - r.n_fit), int(e)) for e, r in zip(ends, self.records, strict=True)]

    def weighted(self, table: Array) -> Array:
        """Rows (n, m) as fits count them."""
        return table if self.weights is None else table * self.weights[:, None]

    def saturated(self, residual: Array) -> Array:
        """(n,) V: what errors count as; their squares are the loss."""
        if self.outlier_v is None:
            return residual
        size = np.sqrt(2.0 * (np.sqrt(1.0 + (residual / self.outlier_v) ** 2) - 1.0))
        return np.asarray(np.sign(residual) * self.outlier_v * size)

    def leniency(self, residual: Array) -> Array:
        """(n,) what a row of a linearised problem counts, so that its slope is that of the loss."""
        if self.outlier_v is None:
            return np.ones_like(residual)
        return np.asarray((1.0 + (residual / self.outlier_v) ** 2) ** -0.25)

    def whiten(self, table: Array, noise: Sequence[ColouredNoise]) -> tuple[Array, float]:
        """Columns (n, m), weighted and whitened record by record, and the log-determinant of their covariance."""
        table = self.weighted(table)
        parts, total = [], 0.0
        for rows, record, model in zip(self.slices, self.records, noise, strict=True):
            part, log_det = whiten(table[rows], record.thin.time_s[: record.n_fit], model)
            parts.append(part)
            total += log_det
        return np.concatenate(parts), total
