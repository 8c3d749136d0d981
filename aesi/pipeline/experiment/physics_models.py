"""The physics models that a correction stands beside, each from the training rows alone.

    ESPM                          as declared
    ESPM, one resistor            one contact resistance fitted
    ESPM, initial state fitted    one shift of the state of charge at the start
    ESPM recalibrated             all of `aesi.pipeline.experiment.recalibrate`

The correction is learned on one of them (`cell.start`). Errors that calibrate bands, and the validation figure, have
to come from drives that the physics had not seen either, so everything is fitted once more without each training drive,
where there are several.

A record that the recalibration has seen starts where the fit has it, one whose start is given there. Any other one
starts where the recalibrated cell reads it to start, as it will once it is saved: its potentials are nearer than the
declared ones. Trained on two drives of an LG M50 with an undeclared hysteresis, potential, loss of lithium, diffusivity
or loss of material, it leaves 3.2, 18.0, 21.2, 8.7 and 5.4 mV RMS of six others that begin at rest; from the declared
cell's reading 3.6, 28.7, 22.8, 8.9 and 5.4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from aesi.errors import DataError
from aesi.physics import ActiveEffect, Cell, InitialState, ModelName
from aesi.pipeline.experiment.recalibrate import Beginning, FitRecord, recalibrate
from aesi.pipeline.product.deviations import (
    ALL,
    INITIAL_STATE,
    RESISTOR,
    PhysicsStart,
    deviating,
    slopes_v,
    start_v,
)
from aesi.pipeline.product.error_series import as_resampled, error_series
from aesi.records import ErrorSeries, Hold, Measurement, Run

DECLARED = "ESPM"
RECALIBRATED = "ESPM recalibrated"
FREE = {"ESPM, one resistor": RESISTOR, "ESPM, initial state fitted": INITIAL_STATE, RECALIBRATED: ALL}
"""Name -> places in PRIORS of the parameters that are fitted."""
PHYSICS_NAMES = (DECLARED, *FREE)


@dataclass(frozen=True, eq=False)
class PhysicsModels:
    """by_name : the physics of each name.  start : the name of the one that is corrected."""

    by_name: Mapping[str, PhysicsStart]
    start: str

    @property
    def chosen(self) -> PhysicsStart:
        """The physics that the correction is learned on."""
        return self.by_name[self.start]

    def carried(self, share: float) -> PhysicsModels:
        """The models with this share of each deviation of the recalibrated one."""
        whole = self.by_name[RECALIBRATED]
        if share == 1.0:
            return self
        z = share * np.array(whole.deviations)
        moved = deviating(whole.declared, whole.effects, ALL, z, whole.model)
        moved = replace(moved, missed_v=whole.missed_v)
        return replace(self, by_name={**self.by_name, RECALIBRATED: moved})

    def begin(self, name: str, record: FitRecord, hold: Hold) -> tuple[float, float]:
        """State of charge at the first row, in the windows of the named physics, and its standard deviation where it
        was read from a voltage, else zero."""
        if (read := self.own_reading(name, record, hold)) is not None:
            return read.soc, read.read_sd
        return self.by_name[name].soc0(record.soc0), record.soc0_sd

    def own_reading(self, name: str, record: FitRecord, hold: Hold) -> InitialState | None:
        """Where the named physics itself reads the record to start; None where it starts as declared.

        Baselines start as declared: what is fitted of them may be the shift of just this reading. So does a record
        whose start is given, and one whose voltage belongs to no state of the cell as recalibrated.
        """
        if name != RECALIBRATED or record.begins is None or record.rows.any():
            return None
        each = self.by_name[name]
        try:
            return record.begins.under(each.cell, each.effects, hold, each.model)
        except DataError:  # by the declared cell it does
            return None

    def run(self, name: str, record: FitRecord, hold: Hold, rows: Measurement | None = None) -> Run:
        """The record under the named physics, from where that has it start; at the given rows of it, its even ones by
        default."""
        soc0, _ = self.begin(name, record, hold)
        return self.by_name[name].run(record.measurement if rows is None else rows, soc0, hold)

    def series(self, record: FitRecord, dt_s: float, hold: Hold) -> tuple[ErrorSeries, bool]:
        """The error of the chosen physics along a record, what the others say beside it, and whether it ran empty.

        Voltages are simulated at the rows as they were logged; what a correction reads, at the even ones.
        """
        runs = {name: self.run(name, record, hold, record.logged) for name in self.by_name}
        says = {name: each.voltage_v for name, each in runs.items()}
        read = [runs[self.start]]
        series = replace(error_series(record.logged, read[0], dt_s), physics=says)
        if record.logged is not record.measurement:
            read.append(self.run(self.start, record, hold))
            # No correction is asked at these rows.
            own = replace(series, inputs=record.logged.current_a[:, None], input_names=("I",))
            series = as_resampled(error_series(record.measurement, read[1], dt_s), own)
        series = replace(
            series,
            missed_v=self.by_name[RECALIBRATED].missed_v,
            ran_out_s=min(
                (t for run in (*runs.values(), *read) if (t := _ran_out_s(run)) is not None), default=None
            ),
        )
        return series, any(_ran_out_s(run) is not None for run in read)

    def with_slopes(self, series: ErrorSeries, record: FitRecord, hold: Hold) -> ErrorSeries:
        """The series of the record with what each parameter of the chosen physics, and its start, is worth along it."""
        chosen, data = self.chosen, record.measurement
        soc0, soc0_sd = self.begin(self.start, record, hold)
        # Neighbours are told apart at the even rows, where each is simulated.
        model_v = chosen.run(data, soc0, hold).voltage_v
        slopes = slopes_v(chosen.cell, chosen.effects, data, soc0, hold, chosen.model, model_v)
        begins_v = None
        if soc0_sd > 0.0:
            begins_v = start_v(chosen, data, soc0, soc0_sd, hold, model_v)
        return replace(series, slopes_v=slopes, start_v=begins_v)


def _ran_out_s(run: Run) -> float | None:
    """s, when a run is first held where it ran empty or full; None where it never is."""
    out = run.series["depleted"] > 0.0
    return float(run.time_s[np.argmax(out)]) if out.any() else None


def physics_models(
    cell: Cell,
    effects: tuple[ActiveEffect, ...],
    records: Mapping[str, FitRecord],
    hold: Hold,
    start: str,
    begin: PhysicsModels | None = None,
    model: ModelName = "espm",
    *,
    own_charges: bool,
) -> PhysicsModels:
    """All physics models, fitted to the rows that the records admit; start : "declared" or "recalibrated".

    begin : fitted to nearly the same rows.  own_charges : see `recalibrate`.
    """
    known = {} if begin is None else begin.by_name
    fitted = {
        name: recalibrate(cell, effects, records, hold, free, known.get(name), model, own_charges=own_charges)
        for name, free in FREE.items()
    }
    by_name = {DECLARED: PhysicsStart(cell, cell, effects, model=model), **fitted}
    return PhysicsModels(by_name, RECALIBRATED if start == "recalibrated" else DECLARED)


def without(records: Mapping[str, FitRecord], name: str, rows: slice) -> dict[str, FitRecord]:
    """The records with the given rows of one of them kept from the fit."""
    seen = records[name].rows.copy()
    seen[rows] = False
    return {**records, name: replace(records[name], rows=seen)}


def no_rows(
    measurement: Measurement, soc0: float, soc0_sd: float = 0.0, begins: Beginning | None = None
) -> FitRecord:
    """A record of which no fit sees anything yet."""
    return FitRecord(measurement, soc0, np.zeros(len(measurement), dtype=bool), soc0_sd, begins)
