"""The physics models that a correction is compared with, each fitted to the training rows alone.

    ESPM                          as declared
    ESPM, one resistor            one contact resistance fitted
    ESPM, initial state fitted    one shift of the state of charge at the start
    ESPM recalibrated             all of `aesi.pipeline.experiment.recalibrate`

The correction is learnt on the declared or on the recalibrated model (`cell.start`). The errors that calibrate bands,
and the validation figure, have to be from drives that the physics has not seen either. If there are several training
drives, all models are therefore fitted once more without each of them.

Initial state of charge of a record under the recalibrated model: a given one is used; a record that the fit has seen
starts at the fitted one; any other record starts where the recalibrated cell reads it from the voltage, as the saved
model will. The potentials of the recalibrated cell are closer to the true ones than those of the declared cell. On
virtual LG M50 cells with an undeclared hysteresis, potential, loss of lithium, diffusivity or loss of material, trained
on two drives, the model leaves 3.2, 18.0, 21.2, 8.7 and 5.4 mV RMS on six other drives that begin at rest; with initial
states read by the declared cell it leaves 3.6, 28.7, 22.8, 8.9 and 5.4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.errors import DataError
from aesi.physics import ActiveEffect, Cell, InitialState, ModelName
from aesi.pipeline.experiment.recalibrate import FitRecord, StateSource, recalibrate
from aesi.pipeline.product.deviations import (
    ALL,
    INITIAL_STATE,
    RESISTOR,
    PhysicsVariant,
    deviating,
    slopes_v,
    start_v,
)
from aesi.pipeline.product.error_series import as_resampled, error_series
from aesi.records import ErrorSeries, Hold, Measurement, Run

DECLARED = "ESPM"
RECALIBRATED = "ESPM recalibrated"
FREE = {"ESPM, one resistor": RESISTOR, "ESPM, initial state fitted": INITIAL_STATE, RECALIBRATED: ALL}
"""Name of a fitted model -> indices in PRIORS of its fitted parameters."""
PHYSICS_NAMES = (DECLARED, *FREE)


@dataclass(frozen=True, eq=False)
class PhysicsModels:
    """The physics models of an experiment.

    by_name : name -> model.  corrected : name of the model that the correction is learnt on.
    recalibration_share : share of the fitted deviations that the recalibrated model has, 0 to 1.
    """

    by_name: Mapping[str, PhysicsVariant]
    corrected: str
    recalibration_share: float = 1.0

    @property
    def chosen(self) -> PhysicsVariant:
        """The model that the correction is learnt on."""
        return self.by_name[self.corrected]

    def with_recalibration_share(self, share: float) -> PhysicsModels:
        """The models, with each deviation of the recalibrated one multiplied by `share`, 0 to 1."""
        whole = self.by_name[RECALIBRATED]
        if share == 1.0:
            return self
        z = share * np.array(whole.deviations)
        moved = deviating(whole.declared, whole.effects, ALL, z, whole.model)
        moved = replace(moved, missed_v=whole.missed_v)
        return replace(self, by_name={**self.by_name, RECALIBRATED: moved}, recalibration_share=share)

    def initial_soc(self, name: str, record: FitRecord, hold: Hold) -> tuple[float, float]:
        """(state of charge at the first row, in the stoichiometry windows of the named model; its standard deviation if
        it was read from a voltage, else 0)."""
        if (read := self.own_reading(name, record, hold)) is not None:
            return read.soc, read.read_sd
        return self.by_name[name].soc0(record.soc0), record.soc0_sd

    def own_reading(self, name: str, record: FitRecord, hold: Hold) -> InitialState | None:
        """The initial state that the named model itself reads from the voltage of the record; None if the state that
        the declared cell reads is used.

        Only the recalibrated model reads it itself. The other fitted models have few free parameters, one of which may
        be the shift of just this reading. The declared reading is also used for records that the fit has seen, and for
        a record whose voltage belongs to no state of the recalibrated cell.
        """
        if name != RECALIBRATED or record.state_source is None or record.rows.any():
            return None
        each = self.by_name[name]
        try:
            return record.state_source.initial_state(each.cell, each.effects, hold, each.model)
        except DataError:  # the voltage belongs to a state of the declared cell only
            return None

    def run(self, name: str, record: FitRecord, hold: Hold, rows: Measurement | None = None) -> Run:
        """A simulation of the record with the named model, from its initial state (`initial_soc`).

        rows : the rows to simulate, by default those on the even time grid.
        """
        soc0, _ = self.initial_soc(name, record, hold)
        return self.by_name[name].run(record.measurement if rows is None else rows, soc0, hold)

    def series(self, record: FitRecord, dt_s: float, hold: Hold) -> tuple[ErrorSeries, bool]:
        """(error series of the chosen model along a record, with the voltages of the other models; whether the chosen
        model ran out of lithium or salt).

        Voltages are simulated at the rows as they were logged and then resampled as the measured ones were. The inputs
        of a correction are simulated at the rows of the even grid.
        """
        runs = {name: self.run(name, record, hold, record.logged) for name in self.by_name}
        voltages_v = {name: each.voltage_v for name, each in runs.items()}
        of_chosen = [runs[self.corrected]]
        series = replace(error_series(record.logged, runs[self.corrected], dt_s), physics=voltages_v)
        if record.logged is not record.measurement:
            on_grid = self.run(self.corrected, record, hold)
            of_chosen.append(on_grid)
            # No correction is evaluated at the logged rows, so that their inputs do not matter.
            own = replace(series, inputs=record.logged.current_a[:, None], input_names=("I",))
            series = as_resampled(error_series(record.measurement, on_grid, dt_s), own)
        out_s = _first_ran_out_s([*runs.values(), *of_chosen])
        series = replace(series, missed_v=self.by_name[RECALIBRATED].missed_v, ran_out_s=out_s)
        return series, _first_ran_out_s(of_chosen) is not None

    def with_slopes(self, series: ErrorSeries, record: FitRecord, hold: Hold) -> ErrorSeries:
        """The series of the record with the change of the voltage by one prior standard deviation of each parameter of
        the chosen model (`slopes_v`), and by one of an initial state that was read from a voltage (`start_v`)."""
        chosen, data = self.chosen, record.measurement
        soc0, soc0_sd = self.initial_soc(self.corrected, record, hold)
        # Differences are taken at the rows of the even grid, where the changed models are simulated as well.
        model_v = chosen.run(data, soc0, hold).voltage_v
        slopes = slopes_v(chosen.cell, chosen.effects, data, soc0, hold, chosen.model, model_v)
        start_change_v = None
        if soc0_sd > 0.0:
            start_change_v = start_v(chosen, data, soc0, soc0_sd, hold, model_v)
        return replace(series, slopes_v=slopes, start_v=start_change_v)


def _first_ran_out_s(runs: Sequence[Run]) -> float | None:
    """Time of the first row at which any of the runs is held at the limit of depletion, s; None if none ever is."""
    held = [(run.time_s, run.series["depleted"] > 0.0) for run in runs]
    return min((float(time_s[np.argmax(out)]) for time_s, out in held if out.any()), default=None)


def physics_models(
    cell: Cell,
    effects: tuple[ActiveEffect, ...],
    records: Mapping[str, FitRecord],
    hold: Hold,
    start: str,
    model: ModelName,
    warm_start: PhysicsModels | None = None,
    *,
    own_charges: bool,
) -> PhysicsModels:
    """All physics models, fitted to the open rows of the records.

    start : the model that is corrected, "declared" or "recalibrated".  model : kind of the physics.
    warm_start : models fitted to nearly the same rows, from which the fits begin.  own_charges : see `recalibrate`.
    """
    known = {} if warm_start is None else warm_start.by_name
    fitted = {
        name: recalibrate(cell, effects, records, hold, free, known.get(name), model, own_charges=own_charges)
        for name, free in FREE.items()
    }
    by_name = {DECLARED: PhysicsVariant(cell, cell, effects, model=model), **fitted}
    return PhysicsModels(by_name, RECALIBRATED if start == "recalibrated" else DECLARED)


def without(records: Mapping[str, FitRecord], name: str, rows: slice) -> dict[str, FitRecord]:
    """The records with the given rows of one of them closed to fits."""
    seen = records[name].rows.copy()
    seen[rows] = False
    return {**records, name: replace(records[name], rows=seen)}


def no_rows(
    measurement: Measurement, soc0: float, soc0_sd: float = 0.0, state_source: StateSource | None = None
) -> FitRecord:
    """A record all of whose rows are closed to fits.  The arguments are those of `FitRecord`."""
    return FitRecord(measurement, soc0, np.zeros(len(measurement), dtype=bool), soc0_sd, state_source)
